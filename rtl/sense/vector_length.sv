// SPDX-License-Identifier: Apache-2.0
// vector_length -- compute the length of the vector (cos, sin), and roughly its direction.
//
// latency  W + 6 cycles from valid to done
// rate     one sample per W + 6 cycles; one that comes sooner is not seen
// accuracy the length is the true one, rounded to the nearest count
// method   One multiplier squares one channel after the other; the square root is found bit by bit,
//          by adding to or subtracting from a remainder. The tilt is counted by repeated addition.
// source   Freking, Parhi, IEEE Trans. Computers 46 (1997) 1141: square root without restoring
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
    input  wire                rst,       // level: the sample in progress is dropped
    input  wire                valid,     // strobe: sin and cos are new
    input  wire signed [W-1:0] sin,       // counts, full scale = 2^(W-1)
    input  wire signed [W-1:0] cos,       // counts, full scale = 2^(W-1)
    output logic               done,      // strobe: the results below are new; held until the next
    output logic       [ 15:0] length,    // counts: length of the vector
    output logic       [  1:0] axis,      // nearest axis, 0 to 3
    output logic       [  1:0] quadrant,  // quadrant, 0 to 3
    output logic       [  2:0] tilt       // smaller over larger channel, in quarters
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    localparam logic [4:0] LAST = 5'(W + 5);

    // 0: idle; 1: square cos; 2: square sin; from 4 to W + 4: one bit of the root each
    logic [4:0] step;
    wire        early = step[4:2] == '0;
    logic signed [W-1:0] sin_q, cos_q;
    wire signed [W-1:0] channel = step[0] ? cos_q : sin_q;

    // four times the sum of the squares; its bits leave to the left, two per cycle
    wire signed [W:0] factor = step[0] ? (W + 1)'(cos_q) : {sin_q, 1'b0};
    logic [2*W+1:0] square;  // of cos; four times that of sin; 0
    logic [2*W+3:0] radicand;
    wire [2*W+1:0] gathered = radicand[2*W+1:0] + square;

    // its root, twice the length
    logic [W:0] root;
    logic signed [W+3:0] remainder;
    wire restored = !remainder[W+3];  // not negative
    wire [W+3:0] divisor = {1'b0, root, !restored, 1'b1};
    wire [W+4:0] next =
        {remainder[W+1:0], radicand[2*W+3:2*W+2], restored} +
        {divisor ^ {(W + 4) {restored}}, restored};

    // direction
    wire [W-1:0] size = channel[W-1] ? -channel : channel;
    logic [W-1:0] major, minor;
    logic steep;  // sin is larger than cos
    wire steeper = size > major;
    logic [W+4:0] excess;  // multiples of major less eight times minor
    wire [W+5:0] increased =
        {excess, early} + {early ? ~{2'b0, minor, 3'b0} : {5'b0, major}, early};
    logic [2:0] quarters;

    always_ff @(posedge clk) begin
        if (valid && step == '0) {sin_q, cos_q} <= {sin, cos};
        if (valid || step != '0) step <= step == LAST ? '0 : step + 1'b1;

        square   <= (2 * W + 2)'(factor * factor);
        radicand <= {gathered, 2'b0};
        if (step != 5'd1 && step != 5'd2) square <= '0;

        remainder <= next[W+4:1];
        root      <= {root[W-1:0], !next[W+4]};
        if (early) {remainder, root} <= '0;

        if (step == 5'd1) major <= size;
        if (step == 5'd2) begin
            minor <= steeper ? major : size;
            steep <= steeper;
            if (steeper) major <= size;
        end
        excess <= increased[W+5:1];
        if (early && step != 5'd3) excess <= '0;
        if (!step[0] && increased[W+5]) quarters <= quarters + 1'b1;
        if (early) quarters <= '0;

        done <= step == LAST;
        if (step == LAST) begin
            length   <= 16'(root[W:1]) + 16'(root[0]);
            axis     <= steep ? {sin_q[W-1], 1'b1} : {cos_q[W-1], 1'b0};
            quadrant <= {sin_q[W-1], sin_q[W-1] ^ cos_q[W-1]};
            tilt     <= quarters;
        end
        if (rst) begin
            step     <= '0;
            square   <= '0;
            radicand <= '0;
            done     <= 1'b0;
        end
    end
endmodule

`default_nettype wire
