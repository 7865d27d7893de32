// SPDX-License-Identifier: Apache-2.0
// vector_length -- the length of the vector (cos, sin), and roughly where it points.
//
// latency  8 clk from valid to done
// rate     one sample per clk
// source   Volder, IRE Trans. EC-8 (1959) 330: four rotations by atan 2^-k, k = 1..4, after folding
//          into 45 degrees, leave at most 3.58 degrees; 55/64 takes off their gain of 1.16372. No
//          multiplier
// bound    length is true within 0.2 % + 0.7 counts; with W = 8 within 0.7 counts for every pair
// model    tb/sense/vector_length.py, equal in every bit of every cycle
`default_nettype none

module vector_length #(
    parameter int W = 8  // bits of a sample
) (
    input wire clk,
    input wire rst,  // samples in flight are dropped
    input wire valid,  // strobe: sin and cos are new
    input wire signed [W-1:0] sin,  // full scale = 2^(W-1)
    input wire signed [W-1:0] cos,
    output logic done,  // strobe: what stands below is new
    output logic [15:0] length,  // in units of sin
    output logic       [1:0]   axis,        // nearest axis: 0 +cos, 1 +sin, 2 -cos, 3 -sin; on a diagonal the one of cos
    output logic [1:0] quadrant,  // 0: sin, cos >= 0, then counted in the same sense as axis
    output logic       [2:0]   tilt         // smaller over larger channel in quarters, rounded: 0 on an axis, 4 on a diagonal
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    localparam int F = 4;  // fraction bits of x and y
    localparam int N = W + 1 + F;  // bits of x and y, which stay between -2^W and 2^W

    logic [W-1:0] sin_size, cos_size, major, minor;
    logic sin_low, cos_low;  // the channels have a minus sign
    logic signed [N-1:0] x[1:4];  // after rotation k
    logic signed [N-1:0] y[1:4];
    logic signed [N-1:0] scaled;  // x without the gain of the rotations
    logic [6:0] place[1:6];  // axis, quadrant, tilt on their way
    logic [7:0] on_way;

    wire steep = sin_size > cos_size;
    wire [1:0] here = {sin_low, sin_low ^ cos_low};
    wire [1:0] nearest = steep ? {sin_low, 1'b1} : {cos_low, 1'b0};
    wire [W+2:0] one = (W + 3)'(major);  // an eighth of the eightfold
    wire [W+2:0] eight = {minor, 3'b0};
    wire [2:0]   slope   = 3'(eight > one) + 3'(eight > one + (one << 1)) + 3'(eight > one + (one << 2)) + 3'(eight > (one << 3) - one);
    wire signed [N-1:0] x_0 = $signed({1'b0, major, {F{1'b0}}});
    wire signed [N-1:0] y_0 = $signed({1'b0, minor, {F{1'b0}}});
    wire [N-1:0] whole = scaled + N'(1 << (F - 1));  // plus a half

    always_ff @(posedge clk) begin
        on_way <= {on_way[6:0], valid};
        if (valid || on_way != '0) begin
            sin_size <= sin[W-1] ? -sin : sin;
            cos_size <= cos[W-1] ? -cos : cos;
            sin_low  <= sin[W-1];
            cos_low  <= cos[W-1];

            major    <= steep ? sin_size : cos_size;
            minor    <= steep ? cos_size : sin_size;
            place[1] <= {nearest, here, 3'b0};

            x[1]     <= x_0 + (y_0 >>> 1);
            y[1]     <= y_0 - (x_0 >>> 1);
            place[2] <= {place[1][6:3], slope};

            for (int k = 2; k < 5; k++) begin
                x[k] <= y[k-1][N-1] ? x[k-1] - (y[k-1] >>> k) : x[k-1] + (y[k-1] >>> k);
                y[k] <= y[k-1][N-1] ? y[k-1] + (x[k-1] >>> k) : y[k-1] - (x[k-1] >>> k);
            end
            scaled <= x[4] - (x[4] >>> 3) - (x[4] >>> 6);
            for (int k = 3; k < 7; k++) place[k] <= place[k-1];
            {axis, quadrant, tilt} <= place[6];
            length   <= 16'(whole >> F);
        end
        if (rst) on_way <= '0;
    end
    assign done = on_way[7];
endmodule

`default_nettype wire
