// SPDX-License-Identifier: Apache-2.0
// engine_memory -- store the words of all axes of motion_engine: state, settings, queues, filters
// and constants.
//
// latency   1 cycle from read_at to stored, and from write to the new word
// rate      one word read and one written per cycle, which must not be the same
// limits    A word that is read in the cycle in which it is written has no certain value.
// model     tb/control/engine_memory.py, equal in every bit of every cycle
// made      by tables/engine_microcode.py, not to be edited
`default_nettype none

module engine_memory #(
    parameter int AXES = 1,  // axes of the engine, 1 to 8
    parameter int WORD_W = 7,  // bits of the address of a word of an axis: 7, or 8 with filters
    localparam int A = WORD_W + $clog2(AXES)  // bits of an address
) (
    input  wire          clk,
    input  wire  [A-1:0] read_at,   // address of the word to be read
    output logic [ 71:0] stored,    // word that was read
    input  wire          write,     // strobe: write a word
    input  wire  [A-1:0] write_at,  // address of that word
    input  wire  [ 71:0] word       // value of that word
);
    localparam int WORDS = 1 << WORD_W;

    (* no_rw_check *) logic [71:0] words[0:AXES*WORDS-1];

    initial begin
        for (int n = 0; n < AXES * WORDS; n++) words[n] = '0;
        for (int n = 0; n < AXES; n++) begin
            words[n*WORDS+56] = 72'h1;  // one
            words[n*WORDS+58] = 72'h100;  // byte
            words[n*WORDS+59] = 72'h80;  // half_byte
            words[n*WORDS+60] = 72'h10000;  // two16
            words[n*WORDS+62] = 72'h100000;  // two20
            words[n*WORDS+67] = 72'h800000;  // half_step
            words[n*WORDS+71] = 72'h1000000;  // two24
            words[n*WORDS+75] = 72'hffffff;  // longest
            words[n*WORDS+79] = 72'h7fffffff;  // top
            words[n*WORDS+83] = 72'h80000000;  // two31
            words[n*WORDS+87] = 72'hffffffff;  // range
            words[n*WORDS+91] = 72'h100000000;  // full
            words[n*WORDS+95] = 72'h200000000;  // two33
            words[n*WORDS+99] = 72'h1ffffffff;  // top34
            words[n*WORDS+103] = 72'h3ffffffff;  // range34
            words[n*WORDS+107] = 72'h1000000000;  // two36
            words[n*WORDS+111] = 72'h40000000000000000;  // two66
        end
    end

    always_ff @(posedge clk) begin
        if (write) words[write_at] <= word;
        stored <= words[read_at];
    end
endmodule

`default_nettype wire
