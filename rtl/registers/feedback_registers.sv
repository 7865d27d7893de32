// SPDX-License-Identifier: Apache-2.0
// feedback_registers -- the register block of feedback channel: edge filter, index, signal
// correction, calibration, signal faults, capture, compare.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, not to be edited
`default_nettype none

module feedback_registers #(
    parameter int HAS_BACKLASH      = 1,  // 0: settings that need it read 0
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
    // cycles left out between two samples [cycle]
    output logic [15:0] edge_filter_skip,
    // tolerated samples, of the old level: N of N + tolerated must agree
    output logic [3:0] edge_filter_tolerated,
    // 0 x4, 1 x2, 2 x1, 3 step and direction; all but x4 need disagreement_limit = 0
    output logic [1:0] decoder_mode,
    output logic index_active_low,  // 1: the index is active low
    // {b, a}, 1: it must equal gate
    output logic [1:0] index_gate_mask,
    output logic [1:0] index_gate,  // {b, a}, levels at the index
    output logic index_up,  // 1: use an index going up
    output logic index_down,  // 1: use an index going down
    // 1: every index; 0: one for each arm_index
    output logic index_each,
    // edges between two indexes; 0: not checked
    output logic [31:0] counts_per_revolution,
    // strobe: arms the index, so that the next one is used
    output logic strobes_arm_index,
    // strobe: loads the correction, that is the four values, for all samples from here on
    output logic strobes_load_correction,
    // strobe: uses the new harmonic table, which was written before
    output logic strobes_swap_harmonics,
    output logic strobes_record,  // strobe: records a new burst
    // strobe: clears the first signal fault
    output logic strobes_clear_signal_faults,
    output logic strobes_capture_now,  // strobe: captures now
    // strobe: drops the oldest capture
    output logic strobes_capture_next,
    output logic strobes_capture_clear,  // strobe: drops all captures
    // strobe: arms compare at its first point
    output logic strobes_compare_arm,
    output logic strobes_compare_disarm,  // strobe: disarms compare
    // strobe: index events; write 1 to clear: found
    input wire index_events_found,
    // strobe: wrong count since the index before, neither 0 nor counts_per_revolution
    input wire index_events_revolution_wrong,
    // index events; write 1 to clear: armed
    input wire index_events_armed,
    // quadrature count at the last index [1/4 period]
    input wire signed [31:0] index_count,
    // time of the last counted edge [cycle]
    input wire [31:0] edge_time,
    output logic correction_offset_written,  // strobe: new value
    output logic correction_gain_written,  // strobe: new value
    output logic correction_quadrature_error_written,  // strobe: new value
    // 1: the harmonic table is subtracted
    output logic harmonic_enable,
    output logic harmonic_point_written,  // strobe: new value
    output logic [15:0] recorder_decimation,  // one sample out of so many
    output logic recorder_phases,  // 1: phases, 0: samples
    input wire recorder_state_full,  // the burst is complete
    // the signal was disturbed, out of its amplitude window or too fast
    input wire recorder_state_invalid,
    // word of the burst; reading advances to the next one
    input wire [31:0] recorder_word,
    output logic recorder_word_read,  // strobe: read in this cycle
    input wire [14:0] signal_faults,  // signal faults present now
    input wire [14:0] first_signal_faults,  // first signal faults
    // faults that stop the drive; bits as in signal_faults
    output logic [14:0] signal_fault_mask,
    // ADC counts; clipping and the circle of the signals: clip level
    output logic [15:0] lissajous_limits_clip_level,
    // ADC counts; clipping and the circle of the signals: tolerance
    output logic [15:0] lissajous_limits_tolerance,
    // ADC counts; jumps and missing noise: jump
    output logic [15:0] jump_limits_jump,
    // samples with one code; 0: any number
    output logic [15:0] jump_limits_no_noise_samples,
    // ADC counts; a channel that does not change: span
    output logic [15:0] channel_limits_span,
    // ADC counts; a channel that does not change: band
    output logic [7:0] channel_limits_band,
    // ADC counts; drift of offset and balance: offset
    output logic [15:0] drift_limits_offset,
    // ADC counts; drift of offset and balance: balance
    output logic [15:0] drift_limits_balance,
    // ADC counts; phase error and comparators: quadrature error
    output logic [15:0] quadrature_limits_quadrature_error,
    // ADC counts; phase error and comparators: sign threshold
    output logic [15:0] quadrature_limits_sign_threshold,
    // sources that capture; bit 0 index, 1 tick, 2 software or sync pulse, 3 and 4 rising probe 0
    // and 1, 5 and 6 falling probe 0 and 1
    output logic [6:0] capture_sources,
    input wire capture_state_present,  // capture waits in captured_*
    input wire [4:0] capture_state_free,  // captures that still fit
    // strobe: an event was dropped; write 1 to clear
    input wire capture_state_overrun,
    input wire [6:0] captured_sources,  // oldest capture: sources
    // time since its sample; for a position made of counts: since the last count [cycle]
    input wire [15:0] captured_age,
    // time of the oldest capture [cycle]
    input wire [31:0] captured_time,
    // position of the oldest capture [1/65536 period]
    input wire signed [47:0] captured_position,
    // first compare point [1/65536 period]
    output logic signed [47:0] compare_start,
    // distance between two points; its sign is the direction [1/65536 period]
    output logic signed [47:0] compare_step,
    output logic [31:0] compare_count,  // number of points; 0: no end
    output logic [23:0] compare_pulse,  // length of a pulse [cycle]
    // shortest gap between two pulses [cycle]
    output logic [23:0] compare_gap,
    input wire compare_state_armed,  // state of compare: armed
    // strobe: a pulse had to wait for the one before it; write 1 to clear
    input wire compare_state_late,
    // points passed, since compare_arm
    input wire [31:0] compare_passed,
    // 1: counts of a and b, 0: phases, if sine and cosine are built; a count is a quarter period
    output logic position_source_counts,
    // 1: own steps of the axis replace the pins a and b
    output logic position_source_steps,
    // shift of position and phase, -2 to 2 counts, in the mode of counts; the target does not
    // follow [1/4 period]
    output logic signed [2:0] align,
    output logic align_written,  // strobe: new value
    output logic segment_use_enable,  // 1: positions are corrected
    // 1: straight lines between borders; 0: a segment has the mean of its borders
    output logic segment_use_linear,
    // use of the segment table; a change moves position and target together: segments
    output logic [7:0] segment_use_segments,
    input wire segment_state_in_force,  // positions are corrected
    // beyond the table, where the error of its border is used
    input wire segment_state_outside,
    // 1: segment_stored is valid, for the border in segment_read
    input wire segment_state_known,
    // position of the first border; it moves with the origin after it is written [1/65536 period]
    output logic signed [47:0] segment_origin,
    output logic segment_origin_written,  // strobe: new value
    // length of a segment [1/65536 period]
    output logic [47:0] segment_length,
    // position at a border less the true position, that is its error; writing stores it [1/65536
    // period]
    output logic signed [23:0] segment_point,
    output logic [7:0] segment_point_border,  // border of the point
    output logic segment_point_written,  // strobe: new value
    output logic [7:0] segment_read_border,  // border to read back: border
    output logic segment_read_written,  // strobe: new value
    // error at that border, valid while segment_state.known is 1 [1/65536 period]
    input wire signed [23:0] segment_stored,
    // error subtracted from the position now [1/65536 period]
    input wire signed [23:0] segment_error,
    // backlash between motor and table: how far the motor turns after a reversal until the table
    // moves [1/65536 period]
    output logic [23:0] backlash,
    // velocity of the motor beyond that of the target; 0: at once [1/65536 period/tick]
    output logic [23:0] backlash_rate,
    // how far the target must move back until that is a reversal [1/256 period]
    output logic [6:0] backlash_rate_hysteresis,
    // 1: the sensor is on the motor's side, and the position of the axis is that of the table; 0:
    // it is on the table
    output logic backlash_rate_motor_side
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
        if (HAS_BACKLASH != 0 && put && word == 6'h36) backlash <= wdata[23:0];
        if (HAS_BACKLASH != 0 && put && word == 6'h37) backlash_rate <= wdata[23:0];
        if (HAS_BACKLASH != 0 && put && word == 6'h37) backlash_rate_hysteresis <= wdata[30:24];
        if (HAS_BACKLASH != 0 && put && word == 6'h37) backlash_rate_motor_side <= wdata[31];

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
            backlash <= 24'h000000;
            backlash_rate <= 24'h000000;
            backlash_rate_hysteresis <= 7'h00;
            backlash_rate_motor_side <= 1'b0;
        end
    end
endmodule

`default_nettype wire
