// SPDX-License-Identifier: Apache-2.0
// engine_settings -- write the settings of motion_engine into its memory, in cycles in which the
// engine does not write, and not into the word that the engine is reading.
//
// latency   1 cycle from setting_write to write_out when the engine neither writes nor reads a word
//           whose number ends with the same three bits; a word of the engine is passed on at once
// rate      one setting, then the next one when waits is low
// method    The words of the two banks, which are also read by other numbers, keep their last three
//           bits, so these three decide whether a word may be the one that is read.
// model     tb/control/engine_settings.py, equal in every bit of every cycle
// proved    Every word of the engine is written in its cycle. A setting that was taken is written
//           once, unchanged, and never while its word is read.
// proof     depth 8, WORD_W = 8
`default_nettype none

module engine_settings #(
    parameter int WORD_W = 7  // bits of the address of a word of an axis: 7, or 8 with filters
) (
    input  wire                       clk,
    input  wire                       rst,
    // settings; words are numbered as the operands in tables/engine_microcode.py
    input  wire                       setting_write,   // strobe: write a setting
    input  wire        [         2:0] setting_axis,    // number of its axis
    input  wire        [         6:0] setting_word,    // number of its word
    input  wire        [         1:0] setting_filter,  // number of its filter
    input  wire signed [        63:0] setting,         // value
    output logic                      waits,           // level: it is not written yet
    // the engine
    input  wire        [         6:0] operand,         // word that the engine reads
    input  wire                       write,           // strobe: the engine writes a word
    input  wire        [WORD_W + 2:0] write_at,        // address of that word
    input  wire        [        71:0] word,            // value of that word
    // to the memory
    output logic                      write_out,       // strobe: write a word
    output logic       [WORD_W + 2:0] write_out_at,    // address of that word
    output logic       [        71:0] word_out         // value of that word
);
    logic [ 2:0] axis;
    logic [ 6:0] number;
    logic [ 1:0] filter;
    logic [63:0] value;

    wire         reads_memory = operand[6:4] != 3'b111;
    wire         may_be_read = reads_memory && operand[2:0] == number[2:0];
    wire         settles = waits && !write && !may_be_read;
    wire  [ 7:0] plain = {2'd0, number[5:0]};
    wire  [ 7:0] above = {2'b01, number[3:0], 2'b11};
    wire  [ 7:0] banked = {2'b10, filter, number[3:0]};
    wire  [ 7:0] address = !number[6] ? plain : number[4] ? banked : above;

    assign write_out    = write || settles;
    assign write_out_at = write ? write_at : {axis, address[WORD_W-1:0]};
    assign word_out     = write ? word : {{8{value[63]}}, value};

    always_ff @(posedge clk) begin
        waits <= setting_write || (waits && !settles);
        if (setting_write)
            {axis, number, filter, value} <= {setting_axis, setting_word, setting_filter, setting};
        if (rst) waits <= 1'b0;
    end

    wire unused = &{1'b0, address, operand[3]};

`ifdef FORMAL
    logic        past = 1'b0;
    logic        owed = 1'b0;  // a setting was taken and is not written
    logic [63:0] owed_value;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (waits) assume (!setting_write);
        owed <= !rst && (setting_write || (owed && !(write_out && !write)));
        if (setting_write) owed_value <= setting;
        if (past) begin
            assert (owed == waits);
            if (waits) assert (value == owed_value);
            if (write) assert (write_out && write_out_at == write_at && word_out == word);
            if (write_out && !write) begin
                assert (owed && !(reads_memory && operand == number));
                assert (word_out[63:0] == owed_value && word_out[71] == owed_value[63]);
            end
            cover (write_out && !write && $past(waits, 2));
        end
    end
`endif
endmodule

`default_nettype wire
