// SPDX-License-Identifier: Apache-2.0
// sync_fifo -- queue words in one clock domain, first in, first out. The oldest word is at the
// output until it is popped.
//
// latency   2 cycles from push to present when the queue is empty, and from pop to the next word
// rate      one push per cycle, one pop in 2 cycles
// method    A ring in a memory with one write port and one clocked read port.
// model     tb/serial/sync_fifo.py, equal in every bit of every cycle
// proved    No word is lost, duplicated, invented or overtaken. A refused word is reported.
`default_nettype none

module sync_fifo #(
    parameter int W     = 11,     // bits of a word
    parameter int DEPTH = 64,     // words, a power of two from 4 up
    // an attribute uses it:
    // verilator lint_off UNUSEDPARAM
    parameter     STYLE = "auto"  // ram_style of the memory: "distributed" takes LUT RAM
    // verilator lint_on UNUSEDPARAM
) (
    input  wire                    clk,
    input  wire                    rst,
    input  wire                    push,     // strobe: take `in`
    input  wire  [          W-1:0] in,       // word to be stored
    input  wire                    pop,      // strobe: drop `out`; ignored without present
    output logic                   present,  // level: out is valid
    output logic [          W-1:0] out,      // oldest word
    output logic [$clog2(DEPTH):0] free,     // words that still fit
    output logic                   overrun   // strobe: a word met a full queue and was dropped
);
    localparam int A = $clog2(DEPTH);

    if (DEPTH < 4 || DEPTH != 1 << A) begin : g_check
        DEPTH_MUST_BE_A_POWER_OF_TWO_FROM_4_UP u_error ();
    end

    // a row that is read while it is written is not shown
    (* no_rw_check, ram_style = STYLE *) logic [W-1:0] memory[0:DEPTH-1];
    logic [A-1:0] to_write, to_read;  // places of the next word to be stored, of the oldest word

    wire full = free == '0;
    wire empty = free[A];
    wire take = push && !full;
    wire drop = pop && present;

    always_ff @(posedge clk) begin
        if (take) memory[to_write] <= in;
        out <= memory[to_read];
    end

    always_ff @(posedge clk) begin
        present <= !empty && !drop;
        overrun <= push && full;
        if (take) to_write <= to_write + 1'b1;
        if (drop) to_read <= to_read + 1'b1;
        if (take != drop) free <= free + {{A{take}}, 1'b1};  // one less, or one more
        if (rst) begin
            present  <= 1'b0;
            overrun  <= 1'b0;
            to_write <= '0;
            to_read  <= '0;
            free     <= (A + 1)'(DEPTH);
        end
    end

`ifdef FORMAL
    // Any one place is followed from a push to the pop: its word comes out in its turn and
    // unchanged.
    (* anyconst *)logic [A-1:0] chosen;
    logic         past = 1'b0;
    logic         waiting;  // a word is in the chosen place
    logic [W-1:0] value;
    wire  [  A:0] stored = (A + 1)'(DEPTH) - free;
    wire  [A-1:0] ahead = chosen - to_read;  // words before that of the chosen place
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst) waiting <= 1'b0;
        else begin
            if (take && to_write == chosen) begin
                waiting <= 1'b1;
                value   <= in;
            end
            if (drop && to_read == chosen) waiting <= 1'b0;
        end
        if (past && !$past(rst)) begin
            assert (stored <= (A + 1)'(DEPTH) && stored[A-1:0] == to_write - to_read);
            if (present) assert (stored != 0);
            if (stored != 0 && !present) assert ($past(drop) || (stored == 1 && $past(push)));
            assert (waiting == ({1'b0, ahead} < stored));
            if (waiting) assert (memory[chosen] == value);
            if (waiting && present && to_read == chosen) assert (out == value);
            assert (overrun == ($past(push) && $past(stored) == (A + 1)'(DEPTH)));
            cover (drop && push && to_read == chosen);
            cover (present && to_read == chosen && chosen == 3);
        end
    end
`endif
endmodule

`default_nettype wire
