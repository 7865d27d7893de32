// SPDX-License-Identifier: Apache-2.0
// bit_timer -- divide the bit time of a UART into eight parts.
//
// latency   Tick n comes n * bit_time / 8 cycles after the last cycle of restart: rounded, and 1
//           cycle earlier at most.
// rate      eight ticks per bit time
// method    A counter of whole cycles; the odd parts are added up, and a carry makes the next part
//           of the bit one cycle longer, so that rounding errors never add up.
// limits    bit_time from 8 cycles up; 8 cycles are added to less. If bit_time becomes shorter in
//           mid-count, the next tick may come 8192 cycles later.
// model     tb/serial/bit_timer.py, equal in every bit of every cycle
// proved    A tick comes bit_time / 8 cycles after a restart or the tick before, rounded down or
//           up.
// proof     depth 12
`default_nettype none

module bit_timer (
    input  wire         clk,
    input  wire  [19:0] bit_time,  // 1/16 cycle
    input  wire         restart,   // level: the first part begins in the next cycle
    output logic        tick       // strobe: the last cycle of an eighth of a bit
);
    logic [12:0] count;  // cycles of this part, from 1 on, or from 0 if it is one cycle longer
    logic [ 6:0] odd;  // 1/128 cycle that the parts so far were too short, and a half

    wire  [12:0] whole = {bit_time[19:8], bit_time[7] || bit_time[19:8] == 12'd0};
    wire  [ 7:0] sum = {1'b0, odd} + {1'b0, bit_time[6:0]};
    wire         longer = sum[7] && !restart;

    assign tick = count == whole;

    always_ff @(posedge clk) begin
        count <= restart || tick ? {12'd0, !longer} : count + 13'd1;
        if (restart) odd <= 7'd64;
        else if (tick) odd <= sum[6:0];
    end

`ifdef FORMAL
    logic        past = 1'b0;
    logic [13:0] since;  // cycles since the last restart or tick
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (restart);
        if (past) assume (bit_time == $past(bit_time));
        since <= restart || tick ? 14'd1 : since + 14'd1;
        if (past) begin
            assert (count <= whole && since >= {1'b0, count} && since <= {1'b0, count} + 14'd1);
            if (tick) assert (since == {1'b0, whole} || since == {1'b0, whole} + 14'd1);
            cover (tick && since == 14'd3 && whole == 13'd2);
        end
    end
`endif
endmodule

`default_nettype wire
