// SPDX-License-Identifier: Apache-2.0
// node_registers -- the register block of node: identity, time, heartbeat of the soft core.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, not to be edited
`default_nettype none

module node_registers (
    input  wire                clk,
    input  wire                rst,                       // settings take their first values
    input  wire                select,                    // strobe: access to this block
    input  wire                write,                     // level: it writes wdata
    input  wire         [ 5:0] word,                      // index of the word
    input  wire         [31:0] wdata,                     // value to write
    output logic        [31:0] rdata,                     // live bits read; else 0
    input  wire         [31:0] clk_hz,                    // frequency of clk [Hz]
    input  wire         [ 3:0] build_axes,                // what is built: axes
    input  wire         [ 3:0] build_address,             // what is built: address
    input  wire         [ 7:0] build_memory,              // what is built: memory [1024 byte]
    // SCOPE_WORDS: words of the recorder of ticks; 0: there is none, and no excitation
    input  wire         [ 8:0] build_scope,
    // cycles since reset; every time stamp is a part of it [cycle]
    input  wire         [63:0] time_stamp,
    // period of the servo tick; it is the same for all axes [cycle]
    output logic        [23:0] tick_period,
    // period of the samples; it is the same for all ADCs [cycle]
    output logic        [15:0] sample_period,
    // strobe: heartbeat of the firmware; while a drive is on, the longest time between two is 20 ms
    // and 1 200 000 cycles: kick
    output logic               heartbeat_kick,
    // axes that start, bit n: axis n; they play their queued segments from the same tick on
    output logic        [ 7:0] start_axes,
    output logic               start_axes_written,        // strobe: new value
    // longest wait of the soft core; writing lets its next access to a register wait for this time,
    // or until a word of the bus is received [cycle]
    output logic        [23:0] wait_time,
    output logic               wait_time_written,         // strobe: new value
    input  wire         [31:0] tick_count,                // servo ticks since reset; wraps [tick]
    output logic        [ 2:0] excitation_axis,           // number of the axis
    // values of the waveform, one for each tick, 4096 at most; 0: nothing is added [tick]
    output logic        [12:0] excitation_period,
    // largest |command| with it, full scale 2^15
    output logic        [14:0] excitation_limit,
    output logic signed [15:0] excitation_value,          // full scale 2^15
    output logic        [11:0] excitation_value_at,       // its number
    output logic               excitation_value_written,  // strobe: new value
    input  wire         [ 1:0] scope_state_phase,         // scope_state
    input  wire         [16:0] scope_state_available,     // words that can be read
    // word of the recording; reading advances to the next one
    input  wire         [31:0] scope_word,
    output logic               scope_word_read,           // strobe: read in this cycle
    output logic        [ 2:0] scope_axis,                // number of the axis of the trigger
    output logic        [ 2:0] scope_last,                // number of the last channel
    output logic        [ 3:0] scope_trigger,             // tick_signal that triggers
    output logic        [ 2:0] scope_mode,                // tick_trigger
    // channels 0 to 3, a byte each: tick_signal in bits 3:0, number of its axis in bits 6:4
    output logic        [31:0] scope_channels_0,
    output logic        [31:0] scope_channels_4,          // channels 4 to 7 in the same way
    // samples; 0: no end, and they are read while it goes on
    output logic        [15:0] scope_samples_length,
    // from sample to sample; 0 acts as 1 [tick]
    output logic        [15:0] scope_samples_every,
    // samples from before the trigger, less than length
    output logic        [15:0] scope_place_earlier,
    // from the trigger to the first sample, which also waits for the first value of a waveform; 0:
    // the sample of the trigger [tick]
    output logic        [15:0] scope_place_delay,
    // level of the trigger; writing begins a recording
    output logic signed [31:0] scope_level,
    output logic               scope_level_written        // strobe: new value
);
    logic [31:0] time_stamp_high;
    logic        get_map_crc;
    logic        get_clk_hz;
    logic        get_build;
    logic        get_time_stamp;
    logic        get_time_stamp_high;
    logic        get_tick_count;
    logic        get_scope_state;
    logic        get_scope_word;

    wire         get = select && !write;
    wire         put = select && write;
    assign scope_word_read = get_scope_word;

    // words read in the cycle before
    assign rdata = ({32{get_map_crc}} & 32'hC9C30AB0) | ({32{get_clk_hz}} & clk_hz) |
        ({32{get_build}} & {7'd0, build_scope, build_memory, build_address, build_axes}) |
        ({32{get_time_stamp}} & time_stamp[31:0]) | ({32{get_time_stamp_high}} & time_stamp_high) |
        ({32{get_tick_count}} & tick_count) | ({32{get_scope_state}} & {13'd0,
        scope_state_available, scope_state_phase}) | ({32{get_scope_word}} & scope_word);

    always_ff @(posedge clk) begin
        get_map_crc <= get && word == 6'h00;
        get_clk_hz <= get && word == 6'h01;
        get_build <= get && word == 6'h02;
        get_time_stamp <= get && word == 6'h04;
        get_time_stamp_high <= get && word == 6'h05;
        get_tick_count <= get && word == 6'h12;
        get_scope_state <= get && word == 6'h1A;
        get_scope_word <= get && word == 6'h1B;
        if (get_time_stamp) time_stamp_high <= time_stamp[63:32];

        if (put && word == 6'h06) tick_period <= wdata[23:0];
        if (put && word == 6'h07) sample_period <= wdata[15:0];
        heartbeat_kick <= put && word == 6'h08 && wdata[0];
        start_axes_written <= put && word == 6'h09;
        if (put && word == 6'h09) start_axes <= wdata[7:0];
        wait_time_written <= put && word == 6'h0A;
        if (put && word == 6'h0A) wait_time <= wdata[23:0];
        if (put && word == 6'h18) excitation_axis <= wdata[2:0];
        if (put && word == 6'h18) excitation_period <= wdata[15:3];
        if (put && word == 6'h18) excitation_limit <= wdata[30:16];
        excitation_value_written <= put && word == 6'h19;
        if (put && word == 6'h19) excitation_value <= wdata[15:0];
        if (put && word == 6'h19) excitation_value_at <= wdata[27:16];
        if (put && word == 6'h1C) scope_axis <= wdata[2:0];
        if (put && word == 6'h1C) scope_last <= wdata[10:8];
        if (put && word == 6'h1C) scope_trigger <= wdata[19:16];
        if (put && word == 6'h1C) scope_mode <= wdata[26:24];
        if (put && word == 6'h1D) scope_channels_0 <= wdata[31:0];
        if (put && word == 6'h1E) scope_channels_4 <= wdata[31:0];
        if (put && word == 6'h1F) scope_samples_length <= wdata[15:0];
        if (put && word == 6'h1F) scope_samples_every <= wdata[31:16];
        if (put && word == 6'h20) scope_place_earlier <= wdata[15:0];
        if (put && word == 6'h20) scope_place_delay <= wdata[31:16];
        scope_level_written <= put && word == 6'h21;
        if (put && word == 6'h21) scope_level <= wdata[31:0];

        if (rst) begin
            get_map_crc <= 1'b0;
            get_clk_hz <= 1'b0;
            get_build <= 1'b0;
            get_time_stamp <= 1'b0;
            get_time_stamp_high <= 1'b0;
            get_tick_count <= 1'b0;
            get_scope_state <= 1'b0;
            get_scope_word <= 1'b0;
            time_stamp_high <= '0;
            tick_period <= 24'h000000;
            sample_period <= 16'h0000;
            heartbeat_kick <= 1'b0;
            start_axes_written <= 1'b0;
            start_axes <= 8'h00;
            wait_time_written <= 1'b0;
            wait_time <= 24'h000000;
            excitation_axis <= 3'h0;
            excitation_period <= 13'h0000;
            excitation_limit <= 15'h0000;
            excitation_value_written <= 1'b0;
            excitation_value <= 16'h0000;
            excitation_value_at <= 12'h000;
            scope_axis <= 3'h0;
            scope_last <= 3'h0;
            scope_trigger <= 4'h0;
            scope_mode <= 3'h0;
            scope_channels_0 <= 32'h00000000;
            scope_channels_4 <= 32'h00000000;
            scope_samples_length <= 16'h0001;
            scope_samples_every <= 16'h0001;
            scope_place_earlier <= 16'h0000;
            scope_place_delay <= 16'h0000;
            scope_level_written <= 1'b0;
            scope_level <= 32'h00000000;
        end
    end
endmodule

`default_nettype wire
