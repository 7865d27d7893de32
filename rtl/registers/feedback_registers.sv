// SPDX-License-Identifier: Apache-2.0
// feedback_registers -- the register block of feedback channel: edge filter, index, signal
// correction, calibration, signal faults, capture, compare.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, never by hand
`default_nettype none

module feedback_registers #(
    parameter int HAS_COMPARE       = 1,  // 0: settings that need it read 0
    parameter int HAS_ENCODER_CHECK = 1,  // 0: settings that need it read 0
    parameter int HAS_HARMONICS     = 1,  // 0: settings that need it read 0
    parameter int HAS_MONITOR       = 1,  // 0: settings that need it read 0
    parameter int HAS_RECORDER      = 1   // 0: settings that need it read 0
) (
    input wire clk,
    input wire rst,  // settings take their first values
    input wire select,  // strobe: access to this block
    input wire write,  // level: it writes wdata
    input wire [5:0] word,  // index of the word
    input wire [31:0] wdata,  // value to write
    input wire [31:0] wdata_low,  // low word, held by register_memory
    output logic [31:0] rdata,  // live bits read; else 0
    output logic [15:0] edge_filter_skip,  // cycle
    output logic [3:0] edge_filter_tolerated,  // tolerated samples
    output logic [1:0] decoder_mode,  // 0 x4
    output logic index_active_low,  // 1: the index is active low
    output logic [1:0] index_gate_mask,  // {b
    output logic [1:0] index_gate,  // {b, a}, levels at the index
    output logic index_up,  // 1: use an index going up
    output logic index_down,  // 1: use an index going down
    output logic index_each,  // 1
    output logic [31:0] counts_per_revolution,  // edges between two indexes
    output logic strobes_arm_index,  // strobe: arms the index
    output logic strobes_load_correction,  // strobe: loads the correction
    output logic strobes_swap_harmonics,  // strobe
    output logic strobes_record,  // strobe: records a new burst
    output logic strobes_clear_signal_faults,  // strobe
    output logic strobes_capture_now,  // strobe: captures now
    output logic strobes_capture_next,  // strobe
    output logic strobes_capture_clear,  // strobe: drops all captures
    output logic strobes_compare_arm,  // strobe
    output logic strobes_compare_disarm,  // strobe: disarms compare
    input wire index_events_found,  // strobe: index events
    input wire index_events_revolution_wrong,  // strobe
    input wire index_events_armed,  // index events
    input wire signed [31:0] index_count,  // 1/4 period
    input wire [31:0] edge_time,  // cycle
    output logic correction_offset_written,  // strobe: new value
    output logic correction_gain_written,  // strobe: new value
    output logic correction_quadrature_error_written,  // strobe: new value
    output logic harmonic_enable,  // 1
    output logic harmonic_point_written,  // strobe: new value
    output logic [15:0] recorder_decimation,  // one sample out of so many
    output logic recorder_phases,  // 1: phases, 0: samples
    input wire recorder_state_full,  // the burst is complete
    input wire recorder_state_invalid,  // the signal was disturbed
    input wire [31:0] recorder_word,  // word of the burst
    output logic recorder_word_read,  // strobe: read in this cycle
    input wire [14:0] signal_faults,  // signal faults present now
    input wire [14:0] first_signal_faults,  // first signal faults
    output logic [14:0] signal_fault_mask,  // faults that stop the drive
    output logic [15:0] lissajous_limits_clip_level,  // ADC counts
    output logic [15:0] lissajous_limits_tolerance,  // ADC counts
    output logic [15:0] jump_limits_jump,  // ADC counts
    output logic [15:0] jump_limits_no_noise_samples,  // samples with one code
    output logic [15:0] channel_limits_span,  // ADC counts
    output logic [7:0] channel_limits_band,  // ADC counts
    output logic [15:0] drift_limits_offset,  // ADC counts
    output logic [15:0] drift_limits_balance,  // ADC counts
    output logic [15:0] quadrature_limits_quadrature_error,  // ADC counts
    output logic [15:0] quadrature_limits_sign_threshold,  // ADC counts
    output logic [6:0] capture_sources,  // sources that capture
    input wire capture_state_present,  // capture waits in captured_*
    input wire [4:0] capture_state_free,  // captures that still fit
    input wire capture_state_overrun,  // strobe: an event was dropped
    input wire [6:0] captured_sources,  // oldest capture: sources
    input wire [15:0] captured_age,  // cycle
    input wire [31:0] captured_time,  // cycle
    input wire signed [47:0] captured_position,  // 1/65536 period
    output logic signed [47:0] compare_start,  // 1/65536 period
    output logic signed [47:0] compare_step,  // 1/65536 period
    output logic [31:0] compare_count,  // number of points; 0: no end
    output logic [23:0] compare_pulse,  // length of a pulse [cycle]
    output logic [23:0] compare_gap,  // cycle
    input wire compare_state_armed,  // state of compare: armed
    input wire compare_state_late,  // strobe
    input wire [31:0] compare_passed,  // points passed
    output logic position_source_counts,  // 1
    output logic position_source_steps,  // 1
    output logic signed [2:0] align,  // 1/4 period
    output logic align_written,  // strobe: new value
    output logic segment_use_enable,  // 1: positions are corrected
    output logic segment_use_linear,  // 1
    output logic [7:0] segment_use_segments,  // use of the segment table
    input wire segment_state_in_force,  // positions are corrected
    input wire segment_state_outside,  // beyond the table
    input wire segment_state_known,  // 1
    output logic signed [47:0] segment_origin,  // 1/65536 period
    output logic segment_origin_written,  // strobe: new value
    output logic [47:0] segment_length,  // 1/65536 period
    output logic signed [23:0] segment_point,  // 1/65536 period
    output logic [7:0] segment_point_border,  // border of the point
    output logic segment_point_written,  // strobe: new value
    output logic [7:0] segment_read_border,  // border to read back: border
    output logic segment_read_written,  // strobe: new value
    input wire signed [23:0] segment_stored,  // 1/65536 period
    input wire signed [23:0] segment_error  // 1/65536 period
);
    logic        index_events_found_held;
    logic        index_events_revolution_wrong_held;
    logic        capture_state_overrun_held;
    logic [15:0] captured_position_high;
    logic        compare_state_late_held;
    logic        get_index_events;
    logic        get_index_count;
    logic        get_edge_time;
    logic        get_recorder_state;
    logic        get_recorder_word;
    logic        get_signal_faults;
    logic        get_first_signal_faults;
    logic        get_capture_state;
    logic        get_captured;
    logic        get_captured_time;
    logic        get_captured_position;
    logic        get_captured_position_high;
    logic        get_compare_state;
    logic        get_compare_passed;
    logic        get_segment_state;
    logic        get_segment_stored;
    logic        get_segment_error;

    wire         get = select && !write;
    wire         put = select && write;
    assign recorder_word_read = get_recorder_word;

    // words read in the cycle before
    assign rdata = ({32{get_index_events}} & {29'd0, index_events_armed,
        index_events_revolution_wrong_held, index_events_found_held}) | ({32{get_index_count}} &
        index_count) | ({32{get_edge_time}} & edge_time) | ({32{get_recorder_state}} & {30'd0,
        recorder_state_invalid, recorder_state_full}) | ({32{get_recorder_word}} & recorder_word) |
        ({32{get_signal_faults}} & {17'd0, signal_faults}) | ({32{get_first_signal_faults}} &
        {17'd0, first_signal_faults}) | ({32{get_capture_state}} & {25'd0,
        capture_state_overrun_held, capture_state_free, capture_state_present}) |
        ({32{get_captured}} & {9'd0, captured_age, captured_sources}) | ({32{get_captured_time}} &
        captured_time) | ({32{get_captured_position}} & captured_position[31:0]) |
        ({32{get_captured_position_high}} & {16'd0, captured_position_high}) |
        ({32{get_compare_state}} & {30'd0, compare_state_late_held, compare_state_armed}) |
        ({32{get_compare_passed}} & compare_passed) | ({32{get_segment_state}} & {29'd0,
        segment_state_known, segment_state_outside, segment_state_in_force}) |
        ({32{get_segment_stored}} & {8'd0, segment_stored}) | ({32{get_segment_error}} & {8'd0,
        segment_error}) | {{8{(get_segment_stored && segment_stored[23]) || (get_segment_error &&
        segment_error[23])}}, 24'd0} | {{16{(get_captured_position_high &&
        captured_position_high[15])}}, 16'd0};

    always_ff @(posedge clk) begin
        get_index_events <= get && word == 6'h05;
        get_index_count <= get && word == 6'h06;
        get_edge_time <= get && word == 6'h07;
        get_recorder_state <= get && word == 6'h0E;
        get_recorder_word <= get && word == 6'h0F;
        get_signal_faults <= get && word == 6'h10;
        get_first_signal_faults <= get && word == 6'h11;
        get_capture_state <= get && word == 6'h19;
        get_captured <= get && word == 6'h1A;
        get_captured_time <= get && word == 6'h1B;
        get_captured_position <= get && word == 6'h1C;
        get_captured_position_high <= get && word == 6'h1D;
        get_compare_state <= get && word == 6'h25;
        get_compare_passed <= get && word == 6'h26;
        get_segment_state <= get && word == 6'h2D;
        get_segment_stored <= get && word == 6'h34;
        get_segment_error <= get && word == 6'h35;
        if (get_captured_position) captured_position_high <= captured_position[47:32];

        if (put && word == 6'h00) edge_filter_skip <= wdata[15:0];
        if (put && word == 6'h00) edge_filter_tolerated <= wdata[19:16];
        if (put && word == 6'h01) decoder_mode <= wdata[1:0];
        if (put && word == 6'h02) index_active_low <= wdata[0];
        if (put && word == 6'h02) index_gate_mask <= wdata[2:1];
        if (put && word == 6'h02) index_gate <= wdata[4:3];
        if (put && word == 6'h02) index_up <= wdata[5];
        if (put && word == 6'h02) index_down <= wdata[6];
        if (put && word == 6'h02) index_each <= wdata[7];
        if (HAS_ENCODER_CHECK != 0 && put && word == 6'h03) counts_per_revolution <= wdata[31:0];
        strobes_arm_index <= put && word == 6'h04 && wdata[0];
        strobes_load_correction <= put && word == 6'h04 && wdata[1];
        strobes_swap_harmonics <= put && word == 6'h04 && wdata[2];
        strobes_record <= put && word == 6'h04 && wdata[3];
        strobes_clear_signal_faults <= put && word == 6'h04 && wdata[4];
        strobes_capture_now <= put && word == 6'h04 && wdata[5];
        strobes_capture_next <= put && word == 6'h04 && wdata[6];
        strobes_capture_clear <= put && word == 6'h04 && wdata[7];
        strobes_compare_arm <= put && word == 6'h04 && wdata[8];
        strobes_compare_disarm <= put && word == 6'h04 && wdata[9];
        index_events_found_held <= index_events_found || (index_events_found_held && !(put && word
            == 6'h05 && wdata[0]));
        index_events_revolution_wrong_held <= index_events_revolution_wrong ||
            (index_events_revolution_wrong_held && !(put && word == 6'h05 && wdata[1]));
        correction_offset_written <= put && word == 6'h08;
        correction_gain_written <= put && word == 6'h09;
        correction_quadrature_error_written <= put && word == 6'h0A;
        if (HAS_HARMONICS != 0 && put && word == 6'h0B) harmonic_enable <= wdata[0];
        harmonic_point_written <= put && word == 6'h0C;
        if (HAS_RECORDER != 0 && put && word == 6'h0D) recorder_decimation <= wdata[15:0];
        if (HAS_RECORDER != 0 && put && word == 6'h0D) recorder_phases <= wdata[16];
        if (HAS_MONITOR != 0 && put && word == 6'h12) signal_fault_mask <= wdata[14:0];
        if (HAS_MONITOR != 0 && put && word == 6'h13) lissajous_limits_clip_level <= wdata[15:0];
        if (HAS_MONITOR != 0 && put && word == 6'h13) lissajous_limits_tolerance <= wdata[31:16];
        if (HAS_MONITOR != 0 && put && word == 6'h14) jump_limits_jump <= wdata[15:0];
        if (HAS_MONITOR != 0 && put && word == 6'h14) jump_limits_no_noise_samples <= wdata[31:16];
        if (HAS_MONITOR != 0 && put && word == 6'h15) channel_limits_span <= wdata[15:0];
        if (HAS_MONITOR != 0 && put && word == 6'h15) channel_limits_band <= wdata[23:16];
        if (HAS_MONITOR != 0 && put && word == 6'h16) drift_limits_offset <= wdata[15:0];
        if (HAS_MONITOR != 0 && put && word == 6'h16) drift_limits_balance <= wdata[31:16];
        if (HAS_MONITOR != 0 && put && word == 6'h17)
            quadrature_limits_quadrature_error <= wdata[15:0];
        if (HAS_MONITOR != 0 && put && word == 6'h17)
            quadrature_limits_sign_threshold <= wdata[31:16];
        if (put && word == 6'h18) capture_sources <= wdata[6:0];
        capture_state_overrun_held <= capture_state_overrun || (capture_state_overrun_held && !(put
            && word == 6'h19 && wdata[6]));
        if (HAS_COMPARE != 0 && put && word == 6'h1F) compare_start <= {wdata[15:0], wdata_low};
        if (HAS_COMPARE != 0 && put && word == 6'h21) compare_step <= {wdata[15:0], wdata_low};
        if (HAS_COMPARE != 0 && put && word == 6'h22) compare_count <= wdata[31:0];
        if (HAS_COMPARE != 0 && put && word == 6'h23) compare_pulse <= wdata[23:0];
        if (HAS_COMPARE != 0 && put && word == 6'h24) compare_gap <= wdata[23:0];
        compare_state_late_held <= compare_state_late || (compare_state_late_held && !(put && word
            == 6'h25 && wdata[1]));
        if (put && word == 6'h2A) position_source_counts <= wdata[0];
        if (put && word == 6'h2A) position_source_steps <= wdata[1];
        align_written <= put && word == 6'h2B;
        align <= put && word == 6'h2B ? wdata[2:0] : '0;
        if (put && word == 6'h2C) segment_use_enable <= wdata[0];
        if (put && word == 6'h2C) segment_use_linear <= wdata[1];
        if (put && word == 6'h2C) segment_use_segments <= wdata[9:2];
        segment_origin_written <= put && word == 6'h2F;
        if (put && word == 6'h2F) segment_origin <= {wdata[15:0], wdata_low};
        if (put && word == 6'h31) segment_length <= {wdata[15:0], wdata_low};
        segment_point_written <= put && word == 6'h32;
        if (put && word == 6'h32) segment_point <= wdata[23:0];
        if (put && word == 6'h32) segment_point_border <= wdata[31:24];
        segment_read_written <= put && word == 6'h33;
        if (put && word == 6'h33) segment_read_border <= wdata[7:0];

        if (rst) begin
            get_index_events <= 1'b0;
            get_index_count <= 1'b0;
            get_edge_time <= 1'b0;
            get_recorder_state <= 1'b0;
            get_recorder_word <= 1'b0;
            get_signal_faults <= 1'b0;
            get_first_signal_faults <= 1'b0;
            get_capture_state <= 1'b0;
            get_captured <= 1'b0;
            get_captured_time <= 1'b0;
            get_captured_position <= 1'b0;
            get_captured_position_high <= 1'b0;
            get_compare_state <= 1'b0;
            get_compare_passed <= 1'b0;
            get_segment_state <= 1'b0;
            get_segment_stored <= 1'b0;
            get_segment_error <= 1'b0;
            edge_filter_skip <= 16'h0000;
            edge_filter_tolerated <= 4'h0;
            decoder_mode <= 2'h0;
            index_active_low <= 1'b0;
            index_gate_mask <= 2'h0;
            index_gate <= 2'h0;
            index_up <= 1'b1;
            index_down <= 1'b1;
            index_each <= 1'b0;
            counts_per_revolution <= 32'h00000000;
            strobes_arm_index <= 1'b0;
            strobes_load_correction <= 1'b0;
            strobes_swap_harmonics <= 1'b0;
            strobes_record <= 1'b0;
            strobes_clear_signal_faults <= 1'b0;
            strobes_capture_now <= 1'b0;
            strobes_capture_next <= 1'b0;
            strobes_capture_clear <= 1'b0;
            strobes_compare_arm <= 1'b0;
            strobes_compare_disarm <= 1'b0;
            index_events_found_held <= '0;
            index_events_revolution_wrong_held <= '0;
            correction_offset_written <= 1'b0;
            correction_gain_written <= 1'b0;
            correction_quadrature_error_written <= 1'b0;
            harmonic_enable <= HAS_HARMONICS == 0 ? '0 : 1'b1;
            harmonic_point_written <= 1'b0;
            recorder_decimation <= HAS_RECORDER == 0 ? '0 : 16'h0001;
            recorder_phases <= 1'b0;
            signal_fault_mask <= 15'h0000;
            lissajous_limits_clip_level <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            lissajous_limits_tolerance <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            jump_limits_jump <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            jump_limits_no_noise_samples <= 16'h0000;
            channel_limits_span <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            channel_limits_band <= 8'h00;
            drift_limits_offset <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            drift_limits_balance <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            quadrature_limits_quadrature_error <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            quadrature_limits_sign_threshold <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            capture_sources <= 7'h00;
            capture_state_overrun_held <= '0;
            captured_position_high <= '0;
            compare_start <= 48'h000000000000;
            compare_step <= 48'h000000000000;
            compare_count <= 32'h00000000;
            compare_pulse <= HAS_COMPARE == 0 ? '0 : 24'h000001;
            compare_gap <= HAS_COMPARE == 0 ? '0 : 24'h000001;
            compare_state_late_held <= '0;
            position_source_counts <= 1'b0;
            position_source_steps <= 1'b0;
            align_written <= 1'b0;
            align <= 3'h0;
            segment_use_enable <= 1'b0;
            segment_use_linear <= 1'b0;
            segment_use_segments <= 8'h01;
            segment_origin_written <= 1'b0;
            segment_origin <= 48'h000000000000;
            segment_length <= 48'h000000000000;
            segment_point_written <= 1'b0;
            segment_point <= 24'h000000;
            segment_point_border <= 8'h00;
            segment_read_written <= 1'b0;
            segment_read_border <= 8'h00;
        end
    end
endmodule

`default_nettype wire
