// SPDX-License-Identifier: Apache-2.0
// ps2_inject_queue -- queue scan codes to inject; they can be dropped, but a sequence that has
// begun is completed.
//
// latency  2 cycles from push to valid in an empty queue
// rate     one push and one code per cycle
// source   S4: an operator who presses STOP also means the keys that still wait to start a cut
// model    tb/peripheral/ps2_inject_queue.py, equal in every bit of every cycle
// proof    DEPTH = 4
// proved   a code that was in the queue at a drop is offered only as part of a sequence that had
//          begun; a code that is pushed later is never dropped
`default_nettype none

module ps2_inject_queue #(
    parameter int DEPTH = 32  // codes, a power of two from 4 up
) (
    input wire clk,
    input wire rst,  // empties the queue
    input wire push,  // strobe: take `in`
    input wire [7:0] in,  // scan code
    input wire in_last,  // level: it is the last of its sequence
    input wire drop,  // strobe: drop all codes but those of a sequence that has begun
    output logic valid,  // level: a code waits for ps2_arbiter
    input wire ready,  // with valid: sent in this cycle
    output logic [7:0] out,  // scan code
    output logic last,  // level: it is the last of its sequence
    input wire injecting,  // level: a sequence is being injected, until its last code
    output logic [$clog2(DEPTH):0] free  // codes that still fit
);
    localparam int C = $clog2(DEPTH) + 1;

    logic present, overrun;
    logic [C-1:0] doomed;  // of the oldest codes, so many before_drop at a drop

    wire          discard = doomed != '0 && !injecting;
    wire          pop = ready || discard;
    wire          popped = pop && present;
    wire  [C-1:0] stored = C'(DEPTH) - free;

    sync_fifo #(
        .W    (9),
        .DEPTH(DEPTH)
    ) u_codes (
        .clk,
        .rst,
        .push,
        .in ({in_last, in}),
        .pop,
        .present,
        .out({last, out}),
        .free,
        .overrun
    );

    assign valid = present && !discard;

    always_ff @(posedge clk) begin
        if (drop) doomed <= stored - C'(popped);
        else if (popped && doomed != '0) doomed <= doomed - 1'b1;
        if (rst) doomed <= '0;
    end

    wire unused = &{1'b0, overrun};

`ifdef FORMAL
    // Any one code, the `chosen`-th, is followed from its push to its end.
    (* anyconst *)logic [C-1:0] chosen;
    logic         past = 1'b0;
    logic [C-1:0] written, read;  // codes so far
    // the chosen code is in the queue; since before a drop
    logic waiting, before_drop;
    wire taken = push && free != '0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        // as sync_fifo is proved to do
        assume (stored <= C'(DEPTH) && (!present || stored != '0));
        assume (!ready || (valid && injecting));  // as ps2_arbiter does
        if (past && $past(!rst && injecting && !(ready && last))) assume (injecting || rst);
        if (past && !$past(injecting) && injecting) assume ($past(valid));
        written <= rst ? '0 : written + C'(taken);
        read    <= rst ? '0 : read + C'(popped);
        if (rst) {waiting, before_drop} <= '0;
        else begin
            if (drop && waiting) before_drop <= 1'b1;
            if (popped && read == chosen) {waiting, before_drop} <= '0;
            if (taken && written == chosen) {waiting, before_drop} <= 2'b10;
        end
        if (past && !$past(rst)) begin
            assert (stored == C'(written - read) && doomed <= stored);
            assert (waiting == (C'(chosen - read) < stored) && (!before_drop || waiting));
            if (waiting) assert (before_drop == (C'(chosen - read) < doomed));
            if (before_drop && valid && read == chosen) assert (injecting);
            if (waiting && !before_drop && popped && read == chosen) assert (ready);
            cover (before_drop && ready && read == chosen);
            cover (waiting && !before_drop && discard && present);
        end
    end
`endif
endmodule

`default_nettype wire
