// SPDX-License-Identifier: Apache-2.0
// peripherals_registers -- the register block of peripherals: I2C, PS/2 pass-through, peer port,
// angle sensor, numeric display, status inputs.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, not to be edited
`default_nettype none

module peripherals_registers (
    input  wire         clk,
    input  wire         rst,                           // settings take their first values
    input  wire         select,                        // strobe: access to this block
    input  wire         write,                         // level: it writes wdata
    input  wire  [ 5:0] word,                          // index of the word
    input  wire  [31:0] wdata,                         // value to write
    output logic [31:0] rdata,                         // live bits read; else 0
    // which peripherals are built; 0: its pins are idle and its registers do nothing: i2c
    input  wire         built_i2c,
    // which peripherals are built; 0: its pins are idle and its registers do nothing: ps2
    input  wire         built_ps2,
    // which peripherals are built; 0: its pins are idle and its registers do nothing: peer
    input  wire         built_peer,
    // which peripherals are built; 0: its pins are idle and its registers do nothing: sensor
    input  wire         built_sensor,
    // which peripherals are built; 0: its pins are idle and its registers do nothing: display
    input  wire         built_display,
    // which peripherals are built; 0: its pins are idle and its registers do nothing: edm
    input  wire         built_edm,
    output logic [ 7:0] i2c_data,                      // byte of a write
    // 0 start, 1 stop, 2 write, 3 read, 4 recover; a start may be repeated, recover clocks a stuck
    // device free
    output logic [ 2:0] i2c_command,
    output logic        i2c_acknowledge,               // of a read: more bytes follow
    output logic        i2c_written,                   // strobe: new value
    input  wire  [ 7:0] i2c_answer_data,               // byte of a read
    // 0 ok, 1 not acknowledged, 2 bus lost or not owned, 3 no bus; without a bus a line stays low
    input  wire  [ 1:0] i2c_answer_result,
    input  wire         i2c_answer_present,            // 1: a word was read; 0: the queue was empty
    output logic        i2c_answer_read,               // strobe: read in this cycle
    // commands that can be queued, 128 at most; the queue of results holds as many, more are lost
    input  wire  [ 7:0] i2c_state_free,
    input  wire         i2c_state_busy,                // a command is in work or waits
    // the master owns the bus, from start to stop
    input  wire         i2c_state_owned,
    input  wire         i2c_state_scl,                 // level of the line
    input  wire         i2c_state_sda,                 // level of the line
    // silence of keyboard and machine before an injection; less than 20 acts as 20 [0.001 s]
    output logic [15:0] ps2_idle,
    output logic [ 7:0] ps2_inject_data,               // scan code
    output logic        ps2_inject_last,               // 1: last one of its sequence
    output logic        ps2_inject_written,            // strobe: new value
    input  wire  [ 5:0] ps2_state_free,                // scan codes that can be queued, 32 at most
    input  wire         ps2_state_injecting,           // a sequence is being injected
    input  wire         ps2_state_busy,                // a frame is on its way on either side
    // strobe: removes what is queued; a sequence that has begun is completed
    output logic        ps2_state_drop,
    // strobe: typed bytes: they answer no command; writing clears the count
    input  wire         ps2_typed,
    input  wire         ps2_errors_keyboard_damaged,   // strobe: damaged bytes of the keyboard
    input  wire         ps2_errors_command_damaged,    // strobe: damaged commands of the machine
    // strobe: commands that the keyboard did not take
    input  wire         ps2_errors_unsent,
    input  wire         ps2_errors_aborted,            // strobe: frames that the machine cut short
    // strobe: pulses of less than 1 us on the lines; writing clears the count
    input  wire         ps2_glitches,
    // duration of one bit of the peer port [1/16 cycle]
    output logic [19:0] peer_bit_time,
    // oldest received byte; reading removes it from the queue of 64: data
    input  wire  [ 7:0] peer_receive_data,
    input  wire         peer_receive_present,          // 1: a word was read; 0: the queue was empty
    output logic        peer_receive_read,             // strobe: read in this cycle
    // byte to send; writing puts it into the queue
    output logic [ 7:0] peer_transmit,
    output logic        peer_transmit_written,         // strobe: new value
    input  wire  [ 6:0] peer_state_transmit_free,      // bytes that can be queued, 64 at most
    input  wire         peer_state_sending,            // state of the peer port: sending
    input  wire         peer_errors_framing,           // strobe: characters without a stop bit
    // strobe: bytes lost because the receive queue was full
    input  wire         peer_errors_overruns,
    // duration of one bit of the sensor [1/16 cycle]
    output logic [19:0] sensor_bit_time,
    // longest pause between the ends of two bytes of a frame [cycle]
    output logic [23:0] sensor_gap,
    // time without a good frame after which the sensor is stale; 0: never [cycle]
    output logic [31:0] sensor_stale_after,
    // last good frame; low word: angle, 2^32 per turn; high word: its age at the read in cycles,
    // which stops at its largest value
    input  wire  [63:0] sensor_reading,
    // its sequence number; read it before sensor_reading
    input  wire  [ 7:0] sensor_state_sequence_number,
    // stale: no frame yet, or older than sensor_stale_after
    input  wire         sensor_state_stale,
    input  wire  [ 7:0] sensor_errors_crc,             // frames with a wrong CRC-16
    // broken frames, with a pause or a framing error inside
    input  wire  [ 7:0] sensor_errors_broken,
    // missed frames, by the gaps in the sequence numbers; damaged frames are included
    input  wire  [ 7:0] sensor_errors_missed,
    output logic        sensor_errors_clear,           // strobe: clears the three counts
    // strobe: good frames; writing clears the count
    input  wire         sensor_frames,
    // word to the display: register in the high byte, value in the low one
    output logic [15:0] display,
    output logic        display_written,               // strobe: new value
    input  wire  [ 4:0] display_state_free,            // words that can be queued, 16 at most
    input  wire         display_state_sending,         // state of the display: sending
    // time that a status input must be stable; the change passes at most 1 ms later [0.001 s]
    output logic [15:0] edm_filter,
    input  wire  [ 1:0] edm_status_inputs,             // bit n: level of input n
    input  wire         edm_status_rose_0,             // strobe: input 0 went high
    input  wire         edm_status_rose_1,             // strobe: input 1 went high
    input  wire         edm_status_fell_0,             // strobe: input 0 went low
    input  wire         edm_status_fell_1              // strobe: input 1 went low
);
    logic [15:0] ps2_typed_count;
    wire [16:0] ps2_typed_next = {1'b0, ps2_typed_count} + 17'(ps2_typed);
    logic [7:0] ps2_errors_keyboard_damaged_count;
    wire [8:0] ps2_errors_keyboard_damaged_next = {1'b0, ps2_errors_keyboard_damaged_count} +
        9'(ps2_errors_keyboard_damaged);
    logic [7:0] ps2_errors_command_damaged_count;
    wire [8:0] ps2_errors_command_damaged_next = {1'b0, ps2_errors_command_damaged_count} +
        9'(ps2_errors_command_damaged);
    logic [7:0] ps2_errors_unsent_count;
    wire [8:0] ps2_errors_unsent_next = {1'b0, ps2_errors_unsent_count} + 9'(ps2_errors_unsent);
    logic [7:0] ps2_errors_aborted_count;
    wire [8:0] ps2_errors_aborted_next = {1'b0, ps2_errors_aborted_count} + 9'(ps2_errors_aborted);
    logic [7:0] ps2_glitches_count;
    wire [8:0] ps2_glitches_next = {1'b0, ps2_glitches_count} + 9'(ps2_glitches);
    logic [7:0] peer_errors_framing_count;
    wire [8:0] peer_errors_framing_next = {1'b0, peer_errors_framing_count} +
        9'(peer_errors_framing);
    logic [7:0] peer_errors_overruns_count;
    wire [8:0] peer_errors_overruns_next = {1'b0, peer_errors_overruns_count} +
        9'(peer_errors_overruns);
    logic [31:0] sensor_reading_high;
    logic [15:0] sensor_frames_count;
    wire [16:0] sensor_frames_next = {1'b0, sensor_frames_count} + 17'(sensor_frames);
    logic edm_status_rose_0_held;
    logic edm_status_rose_1_held;
    logic edm_status_fell_0_held;
    logic edm_status_fell_1_held;
    logic get_built;
    logic get_i2c_answer;
    logic get_i2c_state;
    logic get_ps2_state;
    logic get_ps2_typed;
    logic get_ps2_errors;
    logic get_ps2_glitches;
    logic get_peer_receive;
    logic get_peer_state;
    logic get_peer_errors;
    logic get_sensor_reading;
    logic get_sensor_reading_high;
    logic get_sensor_state;
    logic get_sensor_errors;
    logic get_sensor_frames;
    logic get_display_state;
    logic get_edm_status;

    wire get = select && !write;
    wire put = select && write;
    assign i2c_answer_read = get_i2c_answer;
    assign peer_receive_read = get_peer_receive;

    // words read in the cycle before
    assign rdata = ({32{get_built}} & {26'd0, built_edm, built_display, built_sensor, built_peer,
        built_ps2, built_i2c}) | ({32{get_i2c_answer}} & {21'd0, i2c_answer_present,
        i2c_answer_result, i2c_answer_data}) | ({32{get_i2c_state}} & {20'd0, i2c_state_sda,
        i2c_state_scl, i2c_state_owned, i2c_state_busy, i2c_state_free}) | ({32{get_ps2_state}} &
        {24'd0, ps2_state_busy, ps2_state_injecting, ps2_state_free}) | ({32{get_ps2_typed}} &
        {16'd0, ps2_typed_count}) | ({32{get_ps2_errors}} & {ps2_errors_aborted_count,
        ps2_errors_unsent_count, ps2_errors_command_damaged_count,
        ps2_errors_keyboard_damaged_count}) | ({32{get_ps2_glitches}} & {24'd0, ps2_glitches_count})
        | ({32{get_peer_receive}} & {23'd0, peer_receive_present, peer_receive_data}) |
        ({32{get_peer_state}} & {24'd0, peer_state_sending, peer_state_transmit_free}) |
        ({32{get_peer_errors}} & {16'd0, peer_errors_overruns_count, peer_errors_framing_count}) |
        ({32{get_sensor_reading}} & sensor_reading[31:0]) | ({32{get_sensor_reading_high}} &
        sensor_reading_high) | ({32{get_sensor_state}} & {23'd0, sensor_state_stale,
        sensor_state_sequence_number}) | ({32{get_sensor_errors}} & {8'd0, sensor_errors_missed,
        sensor_errors_broken, sensor_errors_crc}) | ({32{get_sensor_frames}} & {16'd0,
        sensor_frames_count}) | ({32{get_display_state}} & {26'd0, display_state_sending,
        display_state_free}) | ({32{get_edm_status}} & {26'd0, edm_status_fell_1_held,
        edm_status_fell_0_held, edm_status_rose_1_held, edm_status_rose_0_held, edm_status_inputs});

    always_ff @(posedge clk) begin
        get_built <= get && word == 6'h00;
        get_i2c_answer <= get && word == 6'h02;
        get_i2c_state <= get && word == 6'h03;
        get_ps2_state <= get && word == 6'h06;
        get_ps2_typed <= get && word == 6'h07;
        get_ps2_errors <= get && word == 6'h08;
        get_ps2_glitches <= get && word == 6'h09;
        get_peer_receive <= get && word == 6'h0B;
        get_peer_state <= get && word == 6'h0D;
        get_peer_errors <= get && word == 6'h0E;
        get_sensor_reading <= get && word == 6'h12;
        get_sensor_reading_high <= get && word == 6'h13;
        get_sensor_state <= get && word == 6'h14;
        get_sensor_errors <= get && word == 6'h15;
        get_sensor_frames <= get && word == 6'h16;
        get_display_state <= get && word == 6'h18;
        get_edm_status <= get && word == 6'h1A;
        if (get_sensor_reading) sensor_reading_high <= sensor_reading[63:32];

        i2c_written <= put && word == 6'h01;
        if (put && word == 6'h01) i2c_data <= wdata[7:0];
        if (put && word == 6'h01) i2c_command <= wdata[10:8];
        if (put && word == 6'h01) i2c_acknowledge <= wdata[11];
        if (put && word == 6'h04) ps2_idle <= wdata[15:0];
        ps2_inject_written <= put && word == 6'h05;
        if (put && word == 6'h05) ps2_inject_data <= wdata[7:0];
        if (put && word == 6'h05) ps2_inject_last <= wdata[8];
        ps2_state_drop <= put && word == 6'h06 && wdata[8];
        if (put && word == 6'h07) ps2_typed_count <= 16'(ps2_typed);
        else if (!ps2_typed_next[16]) ps2_typed_count <= ps2_typed_next[15:0];
        if (put && word == 6'h08)
            ps2_errors_keyboard_damaged_count <= 8'(ps2_errors_keyboard_damaged);
        else if (!ps2_errors_keyboard_damaged_next[8])
            ps2_errors_keyboard_damaged_count <= ps2_errors_keyboard_damaged_next[7:0];
        if (put && word == 6'h08)
            ps2_errors_command_damaged_count <= 8'(ps2_errors_command_damaged);
        else if (!ps2_errors_command_damaged_next[8])
            ps2_errors_command_damaged_count <= ps2_errors_command_damaged_next[7:0];
        if (put && word == 6'h08) ps2_errors_unsent_count <= 8'(ps2_errors_unsent);
        else if (!ps2_errors_unsent_next[8]) ps2_errors_unsent_count <= ps2_errors_unsent_next[7:0];
        if (put && word == 6'h08) ps2_errors_aborted_count <= 8'(ps2_errors_aborted);
        else if (!ps2_errors_aborted_next[8])
            ps2_errors_aborted_count <= ps2_errors_aborted_next[7:0];
        if (put && word == 6'h09) ps2_glitches_count <= 8'(ps2_glitches);
        else if (!ps2_glitches_next[8]) ps2_glitches_count <= ps2_glitches_next[7:0];
        if (put && word == 6'h0A) peer_bit_time <= wdata[19:0];
        peer_transmit_written <= put && word == 6'h0C;
        if (put && word == 6'h0C) peer_transmit <= wdata[7:0];
        if (put && word == 6'h0E) peer_errors_framing_count <= 8'(peer_errors_framing);
        else if (!peer_errors_framing_next[8])
            peer_errors_framing_count <= peer_errors_framing_next[7:0];
        if (put && word == 6'h0E) peer_errors_overruns_count <= 8'(peer_errors_overruns);
        else if (!peer_errors_overruns_next[8])
            peer_errors_overruns_count <= peer_errors_overruns_next[7:0];
        if (put && word == 6'h0F) sensor_bit_time <= wdata[19:0];
        if (put && word == 6'h10) sensor_gap <= wdata[23:0];
        if (put && word == 6'h11) sensor_stale_after <= wdata[31:0];
        sensor_errors_clear <= put && word == 6'h15 && wdata[24];
        if (put && word == 6'h16) sensor_frames_count <= 16'(sensor_frames);
        else if (!sensor_frames_next[16]) sensor_frames_count <= sensor_frames_next[15:0];
        display_written <= put && word == 6'h17;
        if (put && word == 6'h17) display <= wdata[15:0];
        if (put && word == 6'h19) edm_filter <= wdata[15:0];
        edm_status_rose_0_held <= edm_status_rose_0 || (edm_status_rose_0_held && !(put && word ==
            6'h1A && wdata[2]));
        edm_status_rose_1_held <= edm_status_rose_1 || (edm_status_rose_1_held && !(put && word ==
            6'h1A && wdata[3]));
        edm_status_fell_0_held <= edm_status_fell_0 || (edm_status_fell_0_held && !(put && word ==
            6'h1A && wdata[4]));
        edm_status_fell_1_held <= edm_status_fell_1 || (edm_status_fell_1_held && !(put && word ==
            6'h1A && wdata[5]));

        if (rst) begin
            get_built <= 1'b0;
            get_i2c_answer <= 1'b0;
            get_i2c_state <= 1'b0;
            get_ps2_state <= 1'b0;
            get_ps2_typed <= 1'b0;
            get_ps2_errors <= 1'b0;
            get_ps2_glitches <= 1'b0;
            get_peer_receive <= 1'b0;
            get_peer_state <= 1'b0;
            get_peer_errors <= 1'b0;
            get_sensor_reading <= 1'b0;
            get_sensor_reading_high <= 1'b0;
            get_sensor_state <= 1'b0;
            get_sensor_errors <= 1'b0;
            get_sensor_frames <= 1'b0;
            get_display_state <= 1'b0;
            get_edm_status <= 1'b0;
            i2c_written <= 1'b0;
            i2c_data <= 8'h00;
            i2c_command <= 3'h0;
            i2c_acknowledge <= 1'b0;
            ps2_idle <= 16'h012C;
            ps2_inject_written <= 1'b0;
            ps2_inject_data <= 8'h00;
            ps2_inject_last <= 1'b0;
            ps2_state_drop <= 1'b0;
            ps2_typed_count <= '0;
            ps2_errors_keyboard_damaged_count <= '0;
            ps2_errors_command_damaged_count <= '0;
            ps2_errors_unsent_count <= '0;
            ps2_errors_aborted_count <= '0;
            ps2_glitches_count <= '0;
            peer_bit_time <= 20'h0022B;
            peer_transmit_written <= 1'b0;
            peer_transmit <= 8'h00;
            peer_errors_framing_count <= '0;
            peer_errors_overruns_count <= '0;
            sensor_bit_time <= 20'h0022B;
            sensor_gap <= 24'hFFFFFF;
            sensor_stale_after <= 32'h00000000;
            sensor_reading_high <= '0;
            sensor_errors_clear <= 1'b0;
            sensor_frames_count <= '0;
            display_written <= 1'b0;
            display <= 16'h0000;
            edm_filter <= 16'h000A;
            edm_status_rose_0_held <= '0;
            edm_status_rose_1_held <= '0;
            edm_status_fell_0_held <= '0;
            edm_status_fell_1_held <= '0;
        end
    end
endmodule

`default_nettype wire
