// SPDX-License-Identifier: Apache-2.0
// axis_memory -- store one word for each axis of a node in LUT RAM: the state or a setting of a
// block that serves several axes.
//
// latency  0 cycles from axis to stored, combinational; 1 cycle from write to the new word
// rate     one read and one write per cycle
// behaviour  A word is read, changed and written back in the same cycle, so samples of one axis may
//          follow each other at once. Reset does not clear the words: the block that uses them must
//          know which have been written. For one axis the word is a register.
// model    tb/common/axis_memory.py, equal in every bit of every cycle
// proved   a word changes by a write to its axis only, and then holds what was written
// proof    depth 4, AXES = 5, WIDTH = 3
`default_nettype none

module axis_memory #(
    parameter  int AXES  = 8,                            // words, 1 to 16
    parameter  int WIDTH = 8,                            // bits of a word
    // bits of the number of an axis
    localparam int A     = AXES == 1 ? 1 : $clog2(AXES)
) (
    input  wire              clk,
    input  wire              write,       // strobe: store value
    input  wire  [    A-1:0] write_axis,  // number of the axis whose word is written
    input  wire  [WIDTH-1:0] value,       // word to write
    input  wire  [    A-1:0] axis,        // number of the axis whose word is read
    output logic [WIDTH-1:0] stored       // its word
);
    if (AXES < 1 || AXES > 16) begin : g_check
        AXES_MUST_BE_FROM_1_TO_16 u_error ();
    end

    if (AXES == 1) begin : g_one
        logic [WIDTH-1:0] word;

        always_ff @(posedge clk) if (write) word <= value;
        assign stored = word;

        wire unused = &{1'b0, write_axis, axis};
    end else begin : g_many
        (* ram_style = "distributed" *) logic [WIDTH-1:0] words[0:AXES-1];

        always_ff @(posedge clk) if (write) words[write_axis] <= value;
        assign stored = words[axis];
    end

`ifdef FORMAL
    logic             past = 1'b0;
    logic             known = 1'b0;  // the word was written
    logic [WIDTH-1:0] word;  // what was written last
    wire  [WIDTH-1:0] held;  // what is stored
    (* anyconst *)logic [    A-1:0] watched;
    if (AXES == 1) begin : g_held_one
        assign held = g_one.word;
    end else begin : g_held_many
        assign held = g_many.words[watched];
    end
    always @(posedge clk) begin
        past <= 1'b1;
        assume (32'(watched) < AXES && 32'(axis) < AXES && 32'(write_axis) < AXES);
        if (write && write_axis == watched) begin
            known <= 1'b1;
            word  <= value;
        end
        if (known) assert (held == word);
        if (axis == watched) assert (stored == held);
        if (past && !$past(write && write_axis == watched)) assert (held == $past(held));
        cover (known && axis == watched && $past(write) && stored == '1);
    end
`endif
endmodule

`default_nettype wire
