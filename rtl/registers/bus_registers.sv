// SPDX-License-Identifier: Apache-2.0
// bus_registers -- the register block of RS-485 bus: 9-bit UART, address filter, frame check,
// watchdog.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, not to be edited
`default_nettype none

module bus_registers (
    input  wire         clk,
    input  wire         rst,                  // settings take their first values
    input  wire         select,               // strobe: access to this block
    input  wire         write,                // level: it writes wdata
    input  wire  [ 5:0] word,                 // index of the word
    input  wire  [31:0] wdata,                // value to write
    output logic [31:0] rdata,                // live bits read; else 0
    output logic [19:0] bit_time,             // duration of one bit [1/16 cycle]
    // oldest received word; reading removes it from the queue: data
    input  wire  [ 7:0] receive_data,
    input  wire         receive_command,      // 9th bit: the byte is a command for this node
    // last byte of a good frame, whose length and CRC-32 are right
    input  wire         receive_good,
    input  wire         receive_present,      // 1: a word was read; 0: the queue was empty
    output logic        receive_read,         // strobe: read in this cycle
    output logic [ 7:0] transmit_data,        // word to send; writing puts it into the queue: data
    // word to send; writing puts it into the queue: command
    output logic        transmit_command,
    output logic        transmit_written,     // strobe: new value
    input  wire  [ 7:0] state_transmit_free,  // state of the queues: transmit free
    input  wire         state_sending,        // state of the queues: sending
    input  wire         frames_good,          // strobe: good frames; writing clears the count
    // strobe: bad frames, for this node with a wrong CRC-32 or length; writing clears the count
    input  wire         frames_bad,
    // strobe: characters without a stop bit; writing clears the count
    input  wire         framing_errors,
    // strobe: start bits that were only glitches; writing clears the count
    input  wire         start_glitches,
    // strobe: words lost because the receive queue was full; writing clears the count
    input  wire         overruns,
    // byte for the CRC-32 of a frame to send; writing adds it to the CRC-32: data
    output logic [ 7:0] crc_byte_data,
    output logic        crc_byte_written,     // strobe: new value
    output logic        crc_start_start,      // strobe: starts the CRC-32 again: start
    // CRC-32 of the bytes so far, after the final inversion
    input  wire  [31:0] crc,
    // longest silence of the master while a drive is enabled; 0: no limit [0.001 s]
    output logic [15:0] watchdog_time,
    // strobe: breaks: the bus was low for 2 ms; writing clears the count
    input  wire         breaks,
    // strobe: transmit time-outs: the bus driver was on for 1024 bits and has been cut off; writing
    // clears the count
    input  wire         transmit_timeouts,
    // strobe: sync pulses: good frames for all nodes; writing clears the count
    input  wire         syncs,
    // axes that start with sync, bit n: axis n; they play their queued segments from the next sync
    // pulse on
    output logic [ 7:0] sync_axes
);
    logic [31:0] frames_good_count;
    wire  [32:0] frames_good_next = {1'b0, frames_good_count} + 33'(frames_good);
    logic [31:0] frames_bad_count;
    wire  [32:0] frames_bad_next = {1'b0, frames_bad_count} + 33'(frames_bad);
    logic [31:0] framing_errors_count;
    wire  [32:0] framing_errors_next = {1'b0, framing_errors_count} + 33'(framing_errors);
    logic [31:0] start_glitches_count;
    wire  [32:0] start_glitches_next = {1'b0, start_glitches_count} + 33'(start_glitches);
    logic [31:0] overruns_count;
    wire  [32:0] overruns_next = {1'b0, overruns_count} + 33'(overruns);
    logic [31:0] breaks_count;
    wire  [32:0] breaks_next = {1'b0, breaks_count} + 33'(breaks);
    logic [31:0] transmit_timeouts_count;
    wire  [32:0] transmit_timeouts_next = {1'b0, transmit_timeouts_count} + 33'(transmit_timeouts);
    logic [31:0] syncs_count;
    wire  [32:0] syncs_next = {1'b0, syncs_count} + 33'(syncs);
    logic        get_receive;
    logic        get_state;
    logic        get_frames_good;
    logic        get_frames_bad;
    logic        get_framing_errors;
    logic        get_start_glitches;
    logic        get_overruns;
    logic        get_crc;
    logic        get_breaks;
    logic        get_transmit_timeouts;
    logic        get_syncs;

    wire         get = select && !write;
    wire         put = select && write;

    // no register of this block has these bits
    wire         unused = &{1'b0, wdata[31:20]};
    assign receive_read = get_receive;

    // words read in the cycle before
    assign rdata = ({32{get_receive}} & {21'd0, receive_present, receive_good, receive_command,
        receive_data}) | ({32{get_state}} & {23'd0, state_sending, state_transmit_free}) |
        ({32{get_frames_good}} & frames_good_count) | ({32{get_frames_bad}} & frames_bad_count) |
        ({32{get_framing_errors}} & framing_errors_count) | ({32{get_start_glitches}} &
        start_glitches_count) | ({32{get_overruns}} & overruns_count) | ({32{get_crc}} & crc) |
        ({32{get_breaks}} & breaks_count) | ({32{get_transmit_timeouts}} & transmit_timeouts_count)
        | ({32{get_syncs}} & syncs_count);

    always_ff @(posedge clk) begin
        get_receive <= get && word == 6'h01;
        get_state <= get && word == 6'h03;
        get_frames_good <= get && word == 6'h04;
        get_frames_bad <= get && word == 6'h05;
        get_framing_errors <= get && word == 6'h06;
        get_start_glitches <= get && word == 6'h07;
        get_overruns <= get && word == 6'h08;
        get_crc <= get && word == 6'h0B;
        get_breaks <= get && word == 6'h0D;
        get_transmit_timeouts <= get && word == 6'h0E;
        get_syncs <= get && word == 6'h0F;

        if (put && word == 6'h00) bit_time <= wdata[19:0];
        transmit_written <= put && word == 6'h02;
        if (put && word == 6'h02) transmit_data <= wdata[7:0];
        if (put && word == 6'h02) transmit_command <= wdata[8];
        if (put && word == 6'h04) frames_good_count <= 32'(frames_good);
        else if (!frames_good_next[32]) frames_good_count <= frames_good_next[31:0];
        if (put && word == 6'h05) frames_bad_count <= 32'(frames_bad);
        else if (!frames_bad_next[32]) frames_bad_count <= frames_bad_next[31:0];
        if (put && word == 6'h06) framing_errors_count <= 32'(framing_errors);
        else if (!framing_errors_next[32]) framing_errors_count <= framing_errors_next[31:0];
        if (put && word == 6'h07) start_glitches_count <= 32'(start_glitches);
        else if (!start_glitches_next[32]) start_glitches_count <= start_glitches_next[31:0];
        if (put && word == 6'h08) overruns_count <= 32'(overruns);
        else if (!overruns_next[32]) overruns_count <= overruns_next[31:0];
        crc_byte_written <= put && word == 6'h09;
        if (put && word == 6'h09) crc_byte_data <= wdata[7:0];
        crc_start_start <= put && word == 6'h0A && wdata[0];
        if (put && word == 6'h0C) watchdog_time <= wdata[15:0];
        if (put && word == 6'h0D) breaks_count <= 32'(breaks);
        else if (!breaks_next[32]) breaks_count <= breaks_next[31:0];
        if (put && word == 6'h0E) transmit_timeouts_count <= 32'(transmit_timeouts);
        else if (!transmit_timeouts_next[32])
            transmit_timeouts_count <= transmit_timeouts_next[31:0];
        if (put && word == 6'h0F) syncs_count <= 32'(syncs);
        else if (!syncs_next[32]) syncs_count <= syncs_next[31:0];
        if (put && word == 6'h10) sync_axes <= wdata[7:0];

        if (rst) begin
            get_receive <= 1'b0;
            get_state <= 1'b0;
            get_frames_good <= 1'b0;
            get_frames_bad <= 1'b0;
            get_framing_errors <= 1'b0;
            get_start_glitches <= 1'b0;
            get_overruns <= 1'b0;
            get_crc <= 1'b0;
            get_breaks <= 1'b0;
            get_transmit_timeouts <= 1'b0;
            get_syncs <= 1'b0;
            bit_time <= 20'h0022B;
            transmit_written <= 1'b0;
            transmit_data <= 8'h00;
            transmit_command <= 1'b0;
            frames_good_count <= '0;
            frames_bad_count <= '0;
            framing_errors_count <= '0;
            start_glitches_count <= '0;
            overruns_count <= '0;
            crc_byte_written <= 1'b0;
            crc_byte_data <= 8'h00;
            crc_start_start <= 1'b0;
            watchdog_time <= 16'h03E8;
            breaks_count <= '0;
            transmit_timeouts_count <= '0;
            syncs_count <= '0;
            sync_axes <= 8'h00;
        end
    end
endmodule

`default_nettype wire
