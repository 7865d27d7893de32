// SPDX-License-Identifier: Apache-2.0
// vector_length -- compute the length of the vector (cos, sin), and roughly its direction.
//
// latency  8 cycles from valid to done
// rate     one sample per cycle
// accuracy the length is true within 0.2 % + 0.7 counts; with W = 8 within 0.7 counts for every
//          pair
// method   four rotations by atan 2^-k, k = 1..4, after folding into 45 degrees, leave at most
//          3.58 degrees; the factor 55/64 removes their gain of 1.16372. No multiplier is used.
// source   Volder, IRE Trans. EC-8 (1959) 330
// model    tb/sense/vector_length.py, equal in every bit of every cycle
//
// The output `axis` is 0 for +cos, 1 for +sin, 2 for -cos, 3 for -sin, and on a diagonal the axis
// of cos. `quadrant` is 0 for sin, cos >= 0 and counts in the same sense as `axis`. `tilt` is the
// smaller over the larger channel in quarters, rounded: 0 on an axis, 4 on a diagonal.
`default_nettype none

module vector_length #(
    parameter int W = 8  // bits of a sample, 8 to 16
) (
    input  wire                clk,
    input  wire                rst,       // level: samples in progress are dropped
    input  wire                valid,     // strobe: sin and cos are new
    input  wire signed [W-1:0] sin,       // counts, full scale = 2^(W-1)
    input  wire signed [W-1:0] cos,       // counts, full scale = 2^(W-1)
    output logic               done,      // strobe: the results below are new
    output logic       [ 15:0] length,    // counts: length of the vector
    output logic       [  1:0] axis,      // nearest axis, 0 to 3
    output logic       [  1:0] quadrant,  // quadrant, 0 to 3
    output logic       [  2:0] tilt       // smaller over larger channel, in quarters
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    localparam int F = 4;  // fraction bits of x and y
    localparam int N = W + 1 + F;  // bits of x and y, which stay between -2^W and 2^W

    logic [W-1:0] sin_size, cos_size, major, minor;
    logic sin_low, cos_low;  // the channels are negative
    logic signed [N-1:0] x[1:4];  // after rotation k
    logic signed [N-1:0] y[1:4];
    logic signed [N-1:0] scaled;  // x without the gain of the rotations
    logic [6:0] where[1:6];  // pipeline of axis, quadrant, tilt
    logic [7:0] in_progress;

    wire steep = sin_size > cos_size;
    wire [1:0] here = {sin_low, sin_low ^ cos_low};
    wire [1:0] nearest = steep ? {sin_low, 1'b1} : {cos_low, 1'b0};
    wire [W+2:0] one = (W + 3)'(major);  // compared with eight times minor
    wire [W+2:0] eight = {minor, 3'b0};
    wire beyond_1 = eight > one;
    wire beyond_3 = eight > one + (one << 1);
    wire beyond_5 = eight > one + (one << 2);
    wire beyond_7 = eight > (one << 3) - one;
    wire [2:0] slope = 3'(beyond_1) + 3'(beyond_3) + 3'(beyond_5) + 3'(beyond_7);
    wire signed [N-1:0] x_0 = $signed({1'b0, major, {F{1'b0}}});
    wire signed [N-1:0] y_0 = $signed({1'b0, minor, {F{1'b0}}});
    wire [N-1:0] whole = scaled + N'(1 << (F - 1));  // rounded to nearest

    always_ff @(posedge clk) begin
        in_progress <= {in_progress[6:0], valid};
        if (valid || in_progress != '0) begin
            sin_size <= sin[W-1] ? -sin : sin;
            cos_size <= cos[W-1] ? -cos : cos;
            sin_low  <= sin[W-1];
            cos_low  <= cos[W-1];

            major    <= steep ? sin_size : cos_size;
            minor    <= steep ? cos_size : sin_size;
            where[1] <= {nearest, here, 3'b0};

            x[1]     <= x_0 + (y_0 >>> 1);
            y[1]     <= y_0 - (x_0 >>> 1);
            where[2] <= {where[1][6:3], slope};

            for (int k = 2; k < 5; k++) begin
                x[k] <= y[k-1][N-1] ? x[k-1] - (y[k-1] >>> k) : x[k-1] + (y[k-1] >>> k);
                y[k] <= y[k-1][N-1] ? y[k-1] + (x[k-1] >>> k) : y[k-1] - (x[k-1] >>> k);
            end
            scaled <= x[4] - (x[4] >>> 3) - (x[4] >>> 6);
            for (int k = 3; k < 7; k++) where[k] <= where[k-1];
            {axis, quadrant, tilt} <= where[6];
            length   <= 16'(whole >> F);
        end
        if (rst) in_progress <= '0;
    end
    assign done = in_progress[7];
endmodule

`default_nettype wire
