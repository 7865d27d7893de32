// SPDX-License-Identifier: Apache-2.0
// bit_timer -- divide the bit time of a UART into eight parts, or four.
//
// latency   Tick n comes n * bit_time / PARTS cycles after the last cycle of restart: rounded, and
//           1 cycle earlier at most.
// rate      PARTS ticks per bit time
// method    A counter of whole cycles; the odd parts are added up, and a carry makes the next part
//           of the bit one cycle longer, so that rounding errors never add up.
// limits    bit_time from PARTS cycles up; as many are added to less. If bit_time becomes shorter
//           in mid-count, the next tick may come 8192 cycles later.
// model     tb/serial/bit_timer.py, equal in every bit of every cycle
// proved    A tick comes bit_time / PARTS cycles after a restart or the tick before, rounded down
//           or up.
// proof     depth 12
`default_nettype none

module bit_timer #(
    parameter int PARTS = 8  // ticks of a bit: 8, or 4 for bits of less than 8 cycles
) (
    input  wire         clk,
    input  wire  [19:0] bit_time,  // 1/16 cycle
    input  wire         restart,   // level: the first part begins in the next cycle
    output logic        tick       // strobe: the last cycle of a part of a bit
);
    if (PARTS != 4 && PARTS != 8) begin : g_check
        PARTS_MUST_BE_4_OR_8 u_error ();
    end

    localparam int F = PARTS == 8 ? 7 : 6;  // fraction bits of a part
    localparam int C = 20 - F;  // bits of its whole cycles

    logic [C-1:0] count;  // cycles of this part, from 1 on, or from 0 if it is one cycle longer
    logic [F-1:0] odd;  // 2^-F cycle that the parts so far were too short, and a half

    wire  [C-1:0] whole = {bit_time[19:F+1], bit_time[F] || bit_time[19:F+1] == '0};
    wire  [  F:0] sum = {1'b0, odd} + {1'b0, bit_time[F-1:0]};
    wire          longer = sum[F] && !restart;

    assign tick = count == whole;

    always_ff @(posedge clk) begin
        count <= restart || tick ? C'(!longer) : count + 1'b1;
        if (restart) odd <= F'(1 << (F - 1));
        else if (tick) odd <= sum[F-1:0];
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [C:0] since;  // cycles since the last restart or tick
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (restart);
        if (past) assume (bit_time == $past(bit_time));
        since <= restart || tick ? (C + 1)'(1) : since + 1'b1;
        if (past) begin
            assert (count <= whole && since >= {1'b0, count} && since <= {1'b0, count} + 1'b1);
            if (tick) assert (since == {1'b0, whole} || since == {1'b0, whole} + 1'b1);
            cover (tick && since == 3 && whole == 2);
        end
    end
`endif
endmodule

`default_nettype wire
