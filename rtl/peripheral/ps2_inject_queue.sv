// SPDX-License-Identifier: Apache-2.0
// ps2_inject_queue -- scan codes that wait to be injected, and can be taken back: a sequence that
// is under way is finished whole.
//
// latency  2 clk from push to valid in an empty queue
// rate     one push and one code per clk
// source   S4: who presses STOP means the keys too that still wait to start a cut
// model    tb/peripheral/ps2_inject_queue.py, equal in every bit of every cycle
// proof    DEPTH = 4
// proved   what stood at a drop is offered only as the rest of a sequence that was under way; what
//          was pushed later is never dropped
`default_nettype none

module ps2_inject_queue #(
    parameter int DEPTH = 32  // codes, a power of two from 4 up
) (
    input wire clk,
    input wire rst,  // empties the queue
    input wire push,  // strobe: take `in`
    input wire [7:0] in,
    input wire in_last,  // of its sequence
    input  wire                  drop,          // strobe: what stands now is taken back, but for the rest of a sequence under way
    output logic valid,  // level: a code stands (ps2_arbiter)
    input wire ready,  // with valid: sent in this clk
    output logic [7:0] out,
    output logic last,
    input wire injecting,  // level: a sequence is under way, until its last code
    output logic [$clog2(DEPTH):0] free  // codes that still fit
);
    localparam int C = $clog2(DEPTH) + 1;

    logic present, overrun;
    logic [C-1:0] doomed;  // of the oldest codes, so many stood at a drop

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
    logic waiting, stood;
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
        if (rst) {waiting, stood} <= '0;
        else begin
            if (drop && waiting) stood <= 1'b1;
            if (popped && read == chosen) {waiting, stood} <= '0;
            if (taken && written == chosen) {waiting, stood} <= 2'b10;
        end
        if (past && !$past(rst)) begin
            assert (stored == C'(written - read) && doomed <= stored);
            assert (waiting == (C'(chosen - read) < stored) && (!stood || waiting));
            if (waiting) assert (stood == (C'(chosen - read) < doomed));
            if (stood && valid && read == chosen) assert (injecting);
            if (waiting && !stood && popped && read == chosen) assert (ready);
            cover (stood && ready && read == chosen);
            cover (waiting && !stood && discard && present);
        end
    end
`endif
endmodule

`default_nettype wire
