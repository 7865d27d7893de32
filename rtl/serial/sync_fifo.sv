// SPDX-License-Identifier: Apache-2.0
// sync_fifo -- queue words in one clock domain, first in, first out. The oldest word is at the
// output until it is popped.
//
// latency   2 cycles from push to present when the queue is empty
// rate      one push and one pop per cycle
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
    // counts of words; one bit more than an address distinguishes full from empty
    logic [A:0] written, read;

    wire       full = free == '0;
    wire       take = push && !full;
    wire [A:0] read_next = read + (A + 1)'(pop && present);

    always_ff @(posedge clk) begin
        if (take) memory[written[A-1:0]] <= in;
        out <= memory[read_next[A-1:0]];
    end

    always_ff @(posedge clk) begin
        present <= written != read_next;
        overrun <= push && full;
        read    <= read_next;
        written <= written + (A + 1)'(take);
        free    <= free + (A + 1)'(pop && present) - (A + 1)'(take);
        if (rst) begin
            present <= 1'b0;
            overrun <= 1'b0;
            read    <= '0;
            written <= '0;
            free    <= (A + 1)'(DEPTH);
        end
    end

`ifdef FORMAL
    // Any one word, the `chosen`-th, is followed from its push to its pop: it comes out in its turn
    // and unchanged.
    (* anyconst *)logic [  A:0] chosen;
    logic         past = 1'b0;
    logic         waiting;  // the chosen word is in the queue
    logic [W-1:0] value;
    wire  [  A:0] stored = written - read;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst) waiting <= 1'b0;
        else begin
            if (take && written == chosen) begin
                waiting <= 1'b1;
                value   <= in;
            end
            if (pop && present && read == chosen) waiting <= 1'b0;
        end
        if (past && !$past(rst)) begin
            assert (stored <= (A + 1)'(DEPTH) && free == (A + 1)'(DEPTH) - stored);
            if (present) assert (stored != 0);
            if (stored != 0 && !present) assert (stored == 1 && $past(push));
            assert (waiting == ((A + 1)'(chosen - read) < stored));
            if (waiting) assert (memory[chosen[A-1:0]] == value);
            if (waiting && present && read == chosen) assert (out == value);
            assert (overrun == ($past(push) && $past(stored) == (A + 1)'(DEPTH)));
            cover (pop && present && push && read == chosen);
            cover (present && read == chosen && chosen == 3);
        end
    end
`endif
endmodule

`default_nettype wire
