// SPDX-License-Identifier: Apache-2.0
// velocity_estimator -- the way covered from servo tick to servo tick.
//
// latency  1 clk from tick to velocity: that of the tick just ended        rate  one tick per clk
// source   the difference quotient; what it lags behind the true velocity is half a tick
// model    tb/position/velocity_estimator.py, equal in every bit of every cycle
// proved   what stands still has no velocity, however often its origin moves
`default_nettype none

module velocity_estimator (
    input  wire                  clk,
    input  wire                  rst,           // velocity becomes 0; the next tick only learns the position
    input  wire                  tick,          // strobe: a servo tick ends
    input  wire signed [47:0]    position,      // Q32.16 periods, wraps
    input  wire                  shift,         // strobe: position grows by shift_periods in the next clk
    input  wire signed [31:0]    shift_periods, // periods
    output logic signed [31:0]   velocity       // 2^-16 period/tick, stops at either end of the range
);
    logic               known;                  // last is a position
    logic signed [47:0] last;                   // position at the last tick, seen from the origin of now

    wire signed [47:0] moved = position - last;
    wire               fits  = moved[47:31] == {17{moved[31]}};
    wire signed [47:0] base  = tick ? position : last;

    always_ff @(posedge clk) begin
        last <= {base[47:16] + (shift ? shift_periods : 32'sd0), base[15:0]};
        if (tick) begin
            known    <= 1'b1;
            velocity <= !known ? 32'sd0 : fits ? moved[31:0] : {moved[47], {31{~moved[47]}}};
        end
        if (rst) begin
            known    <= 1'b0;
            velocity <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        // a position that only its origin moves
        if (past) assume (position == $past(position) + ($past(shift) ? $signed({$past(shift_periods), 16'b0}) : 48'sd0));
        if (past) begin
            if (known) assert (last == position);
            assert (velocity == 0);
            cover (known && tick && position > 48'sd65536 && $past(position) < 0);
        end
    end
`endif
endmodule

`default_nettype wire
