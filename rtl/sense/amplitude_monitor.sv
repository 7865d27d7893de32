// SPDX-License-Identifier: Apache-2.0
// amplitude_monitor -- the length of the vector (cos, sin), and whether it leaves its window.
//
// latency  8 clk from valid to amplitude, 9 clk to the flags       rate  one sample per 9 clk; sooner ones are not heard
// source   Volder, IRE Trans. EC-8 (1959) 330: four rotations by atan 2^-k, k = 1..4, after folding into 45 degrees, leave
//          at most 3.58 degrees; 55/64 takes off their gain of 1.16372. No multiplier
// bound    amplitude is true within 0.2 % + 0.7 counts; with W = 8 within 0.7 counts for every pair
// model    tb/sense/amplitude_monitor.py, equal in every bit of every cycle
`default_nettype none

module amplitude_monitor #(
    parameter int W = 8                     // bits of a sample
) (
    input  wire                  clk,
    input  wire                  rst,       // amplitude and flags become zero, a sample in flight is dropped
    input  wire        [15:0]    low,       // smallest good amplitude; 0: never too low
    input  wire        [15:0]    high,      // largest good amplitude; 65535: never too high
    input  wire                  valid,     // strobe: sin and cos are new
    input  wire signed [W-1:0]   sin,       // full scale = 2^(W-1)
    input  wire signed [W-1:0]   cos,
    output logic       [15:0]    amplitude, // in units of sin
    output logic                 too_low,   // level: the last three samples, or more, were below low
    output logic                 too_high   // level: the last three samples, or more, were above high
);
    if (W < 8 || W > 16) begin : g_check W_MUST_BE_FROM_8_TO_16 u_error (); end

    localparam int F = 4;                   // fraction bits of x and y
    localparam int N = W + 1 + F;           // bits of x and y, which stay between -2^W and 2^W
    localparam logic [1:0] IN_A_ROW = 3;

    logic [3:0]          stage;             // 0 rests, 1 folds, 2..5 rotate, 6 scales, 7 rounds, 8 judges
    logic signed [N-1:0] x, y;
    logic [1:0]          lows, highs;       // samples in a row outside, stops at IN_A_ROW

    wire [W-1:0] sin_size = sin[W-1] ? -sin : sin;
    wire [W-1:0] cos_size = cos[W-1] ? -cos : cos;
    wire [1:0]   k        = stage[1:0] - 2'd2;                      // stages 2..5: k + 1 is 1..4
    wire signed [N-1:0] x_part = x >>> k >>> 1;
    wire signed [N-1:0] y_part = y >>> k >>> 1;
    wire        [N-1:0] whole  = x + N'(1 << (F - 1));              // x plus a half
    wire is_low  = amplitude < low;
    wire is_high = amplitude > high;

    always_ff @(posedge clk) begin
        case (stage)
            4'd0:
                if (valid) begin
                    x     <= $signed({1'b0, cos_size, {F{1'b0}}});
                    y     <= $signed({1'b0, sin_size, {F{1'b0}}});
                    stage <= 4'd1;
                end
            4'd1: begin
                if (y > x) begin
                    x <= y;
                    y <= x;
                end
                stage <= 4'd2;
            end
            4'd6: begin
                x     <= x - (x >>> 3) - (x >>> 6);
                stage <= 4'd7;
            end
            4'd7: begin
                amplitude <= 16'(whole >> F);
                stage     <= 4'd8;
            end
            4'd8: begin
                lows     <= !is_low  ? '0 : lows  == IN_A_ROW ? lows  : lows  + 1'b1;
                highs    <= !is_high ? '0 : highs == IN_A_ROW ? highs : highs + 1'b1;
                too_low  <= is_low  && lows  >= IN_A_ROW - 1'b1;
                too_high <= is_high && highs >= IN_A_ROW - 1'b1;
                stage    <= '0;
            end
            default: begin
                x     <= y[N-1] ? x - y_part : x + y_part;
                y     <= y[N-1] ? y + x_part : y - x_part;
                stage <= stage + 1'b1;
            end
        endcase
        if (rst) begin
            stage     <= '0;
            amplitude <= '0;
            lows      <= '0;
            highs     <= '0;
            too_low   <= 1'b0;
            too_high  <= 1'b0;
        end
    end
endmodule

`default_nettype wire
