// SPDX-License-Identifier: Apache-2.0
// bus_registers -- the register block of RS-485 bus: 9-bit UART, address filter, frame check,
// watchdog.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
//           Its counters are those of event_counters, which is a few cycles late.
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
    logic get_receive;
    logic get_state;
    logic get_crc;
    logic get_count;
    wire [31:0] count;
    wire counter = word == 6'h04 || word == 6'h05 || word == 6'h06 || word == 6'h07 || word == 6'h08
        || word == 6'h0D || word == 6'h0E || word == 6'h0F;

    wire get = select && !write;
    wire put = select && write;

    // no register of this block has these bits
    wire unused = &{1'b0, wdata[31:20]};
    assign receive_read = get_receive;

    // the place of a count in the memory is the number of its word
    event_counters #(
        .COUNTERS(16)
    ) u_counters (
        .clk,
        .rst,
        .events({
            syncs,
            transmit_timeouts,
            breaks,
            1'b0,
            1'b0,
            1'b0,
            1'b0,
            overruns,
            start_glitches,
            framing_errors,
            frames_bad,
            frames_good,
            1'b0,
            1'b0,
            1'b0
        }),
        .read(get && counter),
        .clear(put && counter),
        .number(word[3:0]),
        .count
    );

    // words read in the cycle before
    assign rdata = ({32{get_receive}} & {21'd0, receive_present, receive_good, receive_command,
        receive_data}) | ({32{get_state}} & {23'd0, state_sending, state_transmit_free}) |
        ({32{get_crc}} & crc) | ({32{get_count}} & count);

    always_ff @(posedge clk) begin
        get_receive <= get && word == 6'h01;
        get_state <= get && word == 6'h03;
        get_crc <= get && word == 6'h0B;
        get_count <= get && counter;

        if (put && word == 6'h00) bit_time <= wdata[19:0];
        transmit_written <= put && word == 6'h02;
        if (put && word == 6'h02) transmit_data <= wdata[7:0];
        if (put && word == 6'h02) transmit_command <= wdata[8];
        crc_byte_written <= put && word == 6'h09;
        if (put && word == 6'h09) crc_byte_data <= wdata[7:0];
        crc_start_start <= put && word == 6'h0A && wdata[0];
        if (put && word == 6'h0C) watchdog_time <= wdata[15:0];
        if (put && word == 6'h10) sync_axes <= wdata[7:0];

        if (rst) begin
            get_receive <= 1'b0;
            get_state <= 1'b0;
            get_crc <= 1'b0;
            get_count <= 1'b0;
            bit_time <= 20'h0022B;
            transmit_written <= 1'b0;
            transmit_data <= 8'h00;
            transmit_command <= 1'b0;
            crc_byte_written <= 1'b0;
            crc_byte_data <= 8'h00;
            crc_start_start <= 1'b0;
            watchdog_time <= 16'h03E8;
            sync_axes <= 8'h00;
        end
    end
endmodule

`default_nettype wire
