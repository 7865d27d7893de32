// SPDX-License-Identifier: Apache-2.0
// feedback_channel -- measure the position of an axis: from the pins of its scale to position,
// captures and compare pulses.
//
// latency  22 cycles from an ADC word to position with a chain of its own, 23 with a shared one and
//          1 more for each axis that is served before, 30 at most for eight axes; 5 cycles from the
//          pins a and b to position in the mode of counts; 1 cycle more each with a segment table
// rate     one sample per `sample_tick`
// behaviour  A feature that is not built has no logic, and the registers of its settings and its
//          state read 0; see sine_channel and position_events for what remains without
//          HAS_OWN_CHAIN and HAS_CAPTURE. The check of the encoder consists of the check of counts
//          per revolution, the count at the last index and the time of the last edge.
// source   S0: interferometer with sine, cosine and comparator outputs; any A/B/Z scale
// model    the models of its blocks; tested together by tb/system
`default_nettype none

module feedback_channel #(
    parameter int W = 8,  // bits of a sample
    parameter int SEGMENTS = 0,  // most segments of the table, 3 to 255; 0: no table
    parameter int ADC_FRAME = 14,  // clocks of a conversion
    parameter int HAS_SINE = 1,  // 0: no sine and cosine, the position is made of counts
    parameter int HAS_OWN_CHAIN = HAS_SINE,  // 1: build a chain for this axis; 0: one of the node
    parameter int HAS_MONITOR = HAS_SINE,  // 1: build the signal monitor; needs the sine
    parameter int HAS_HARMONICS = HAS_SINE,  // 1: build the harmonic correction, likewise
    parameter int HAS_RECORDER = HAS_SINE,  // 1: build the recorder, likewise
    parameter int HAS_CAPTURE = 1,  // 1: build the queue of captures
    parameter int HAS_COMPARE = 1,  // 1: build compare
    parameter int HAS_ENCODER_CHECK = 1,  // 1: build the check of the encoder
    parameter int HAS_BACKLASH = 0  // 1: build the compensation of backlash
) (
    input wire clk,
    input wire rst,
    // register bus
    input wire select,  // strobe: an access to this channel
    input wire write,  // level: the access writes
    input wire [5:0] word,  // 32-bit word of the block
    input wire [31:0] wdata,  // value to write
    input wire [31:0] wdata_low,  // low word of a value of 64 bits
    output logic [31:0] rdata,  // live bits read, in the next cycle; else 0
    // time
    input wire tick,  // strobe: servo tick
    input wire sample_tick,  // strobe: take a sample
    input wire sync,  // strobe: the sync pulse of the bus captures
    input wire [31:0] now,  // cycles, time stamp
    // settings of axis_registers
    input wire [5:0] deglitch,  // samples that a, b and z must be stable
    input wire [15:0] amplitude_low,  // ADC counts, smallest amplitude
    input wire [15:0] amplitude_high,  // ADC counts, largest amplitude
    input wire [5:0] encoder_fault_mask,  // which events are a fault, bits as in events
    input wire sensing_written,  // strobe: settings of the outlier filter
    input wire limit_written,  // strobe: limit of the count check
    // shift of the origin
    input wire shift,  // strobe: move the origin
    input wire signed [31:0] shift_periods,  // period, distance of the shift; else 0
    // pins
    input wire a,  // level of pin a, synchronous to clk
    input wire b,  // level of pin b, synchronous to clk
    input wire z,  // level of the index, synchronous to clk
    input wire [1:0] probe,  // levels of the probes, synchronous to clk
    input wire adc_sin,  // serial data, synchronous to adc_sclk
    input wire adc_cos,  // serial data, synchronous to adc_sclk
    output logic adc_cs_n,  // pin, low during a conversion
    output logic adc_sclk,  // pin, idles high
    output logic compare_pulse,  // pin, high during a compare pulse
    // the axis' own steps
    input wire own_step,  // level: a step is made
    input wire own_downward,  // level: that step and the next go down
    // backlash
    input wire result_valid,  // strobe: a result of motion_engine is new, and of this axis
    input wire [2:0] result_kind,  // number of what it is
    input wire [47:0] result,  // value, signed
    output logic [23:0] take_up,  // 2^-16 period, by which the motor is before the table
    // to a shared chain, as its ports of this axis
    output logic [7:0] chain_setting_written,  // strobes of its settings
    output logic chain_harmonic_enable,  // level: correct the harmonics
    output logic chain_learn,  // level: learn the count again
    output logic sample_valid,  // strobe: a new sample
    output logic signed [W-1:0] sample_sin,  // ADC counts, held until the next one
    output logic signed [W-1:0] sample_cos,  // ADC counts, held until the next one
    // from a shared chain
    input wire chain_sampled,  // strobe: the filtered sample is new
    input wire signed [W-1:0] chain_sin,  // ADC counts
    input wire signed [W-1:0] chain_cos,  // ADC counts
    input wire chain_rejected,  // strobe: an outlier was held back
    input wire chain_phase_valid,  // strobe: the plain phase is new
    input wire [15:0] chain_plain_phase,  // 2^-16 period, before the harmonics
    input wire chain_done,  // strobe: step leads to phase
    input wire signed [16:0] chain_step,  // 2^-16 period
    input wire [15:0] chain_phase,  // 2^-16 period, corrected
    input wire chain_overspeed,  // strobe: the speed is too high
    input wire chain_disagreement,  // level: position and count differ
    input wire chain_lost,  // strobe: a sample of this axis was lost
    // signals
    output logic signed [W-1:0] sin,  // ADC counts, after the outlier filter
    output logic signed [W-1:0] cos,  // ADC counts, after the outlier filter
    output logic [15:0] phase,  // 2^-16 period, corrected
    output logic [15:0] amplitude,  // ADC counts
    output logic signed [31:0] quadrature_count,  // 1/4 period
    // events
    output logic sample_rejected,  // strobe: an outlier was held back
    output logic pulse_rejected,  // strobe: a short pulse was filtered out
    output logic [5:0] events,  // strobes, see axis_registers.encoder_events
    output logic encoder_fault,  // level: an enabled event or signal fault
    // position
    output logic position_valid,  // strobe: position is new
    output logic signed [47:0] position,  // 2^-16 period, of the table
    output logic moved,  // strobe: position will jump by moved_by
    output logic signed [47:0] moved_by,  // 2^-16 period, in the next cycle
    output logic moves,  // level: position will jump, with the table
    output logic step_made,  // strobe: position moves in the next cycle
    output logic step_down  // level: with step_made, it goes down
);
    // the position is a whole number of quarters of a period
    localparam bit QUARTERS = HAS_SINE == 0 && SEGMENTS == 0 && HAS_BACKLASH == 0;
    localparam int CAPTURE_DELAY = SEGMENTS == 0 ? 2 : 3;  // cycles from an index to its position

    if (SEGMENTS != 0 && (SEGMENTS < 3 || SEGMENTS > 255)) begin : g_check_segments
        SEGMENTS_MUST_BE_0_OR_FROM_3_TO_255 u_error ();
    end
    if (HAS_MONITOR != 0 && HAS_SINE == 0) begin : g_check_monitor
        SIGNAL_MONITOR_NEEDS_SINE u_error ();
    end
    if (HAS_HARMONICS != 0 && HAS_SINE == 0) begin : g_check_harmonics
        HARMONICS_NEED_SINE u_error ();
    end
    if (HAS_RECORDER != 0 && HAS_SINE == 0) begin : g_check_recorder
        RECORDER_NEEDS_SINE u_error ();
    end

    // settings of the decoder
    wire [15:0] filter_skip;
    wire [ 3:0] filter_tolerated;
    wire [1:0] mode, gate_mask, gate;
    wire index_low, index_up, index_down, index_each, arm_index;
    wire [31:0] counts_per_revolution;
    // settings of the signal monitor
    wire [15:0] clip_level, tolerance, jump, no_noise_samples, span, sign_threshold;
    wire [15:0] offset_limit, balance_limit, quadrature_limit;
    wire [ 7:0] band;
    wire [14:0] signal_fault_mask;
    wire        clear_signal_faults;
    // settings of the correction
    wire offset_written, gain_written, quadrature_error_written, load_correction;
    wire harmonic_enable, harmonic_point_written, swap_harmonics;
    wire [7:0] setting_written = {
        swap_harmonics,
        harmonic_point_written,
        load_correction,
        quadrature_error_written,
        gain_written,
        offset_written,
        limit_written,
        sensing_written
    };
    wire by_counts;
    wire learn = by_counts || (shift && shift_periods == '0);
    // settings of the recorder
    wire [15:0] decimation;
    wire phases, record, recorder_read;
    // settings of the position
    wire use_counts, own_steps, align_written;
    wire signed [2:0] align;
    // settings of the segment table
    wire segment_enable, segment_linear, segment_origin_written, segment_point_written;
    wire segment_read;
    wire [7:0] segments, segment_border, segment_read_point;
    wire signed [47:0] segment_origin;
    wire        [47:0] segment_length;
    wire signed [23:0] segment_point;
    // settings of capture and compare
    wire        [ 6:0] capture_sources;
    wire capture_now, capture_next, capture_clear, compare_arm, compare_disarm;
    wire signed [47:0] compare_start, compare_step;
    wire [31:0] compare_count;
    wire [23:0] pulse_length, gap_length;

    // decoder
    wire [2:0] levels, edge_rejected;  // {z, b, a}
    wire signed [ 1:0] quadrature_step;
    wire signed [31:0] index_count;
    wire        [31:0] edge_time;
    wire direction, index_found, index_armed;
    wire illegal, illegal_seen, illegal_fault, revolution_wrong, revolution_fault;
    // sine and cosine
    wire [14:0] signal_faults, first_signal_faults;
    wire overspeed, disagreement, disturbed, tracked, full, invalid;
    wire        [15:0] tracked_phase;
    wire signed [16:0] tracked_step;
    wire        [31:0] recorded;
    wire               convert;
    // segment table
    wire segment_in_force, segment_outside, segment_known, shifted;
    wire signed [31:0] shifted_periods;
    wire signed [23:0] segment_error, segment_stored;
    // backlash
    wire signed [47:0] sensor_position;
    wire [23:0] backlash, backlash_rate;
    wire [6:0] backlash_hysteresis;
    wire       backlash_motor_side;
    // capture and compare
    wire present, overrun, armed, late;
    wire [ 6:0] captured_sources;
    wire [15:0] captured_age;
    wire [31:0] captured_time, passed;
    wire signed [47:0] captured_position;
    wire        [ 4:0] capture_free;

    incremental_encoder #(
        .FILTER_W(6),
        .CHECK   (HAS_ENCODER_CHECK)
    ) u_encoder (
        .clk,
        .rst,
        // filter
        .filter_skip,
        .filter_required(deglitch),
        .filter_tolerated,
        // index
        .mode,
        .index_low,
        .index_gate_mask(gate_mask),
        .index_gate     (gate),
        .index_up,
        .index_down,
        .index_each,
        .index_clears   (1'b0),
        .counts_per_revolution,
        .illegal_enable (1'b0),
        .arm_index,
        .clear_flags    (1'b0),
        // pins and own steps
        .now,
        .a,
        .b,
        .z,
        .own            (own_steps),
        .own_a          (own_step),
        .own_b          (own_downward),
        // counts
        .count          (quadrature_count),
        .step           (quadrature_step),
        .direction,
        .edge_time,
        .index_found,
        .index_armed,
        .index_count,
        // events
        .filtered       (levels),
        .rejected       (edge_rejected),
        .illegal,
        .illegal_seen,
        .illegal_fault,
        .revolution_wrong,
        .revolution_fault
    );
    encoder_events u_events (
        // settings
        .event_mask  (encoder_fault_mask),
        .signal_fault_mask,
        .decoder_mode(mode),
        .own_steps,
        // what is reported
        .illegal_edge(illegal),
        .overspeed,
        .disagreement,
        .signal_faults,
        .edge_rejected,
        // what follows
        .events,
        .pulse_rejected,
        .disturbed,
        .fault       (encoder_fault)
    );

    sine_channel #(
        .W            (W),
        .ADC_FRAME    (ADC_FRAME),
        .HAS_SINE     (HAS_SINE),
        .HAS_OWN_CHAIN(HAS_OWN_CHAIN),
        .HAS_MONITOR  (HAS_MONITOR),
        .HAS_HARMONICS(HAS_HARMONICS),
        .HAS_RECORDER (HAS_RECORDER)
    ) u_sine (
        .clk,
        .rst,
        // ADC
        .convert,
        .adc_sin,
        .adc_cos,
        .adc_cs_n,
        .adc_sclk,
        // settings of the chain
        .wdata,
        .setting_written,
        .harmonic_enable,
        .learn,
        // settings of the signal monitor
        .by_counts,
        .amplitude_low,
        .amplitude_high,
        .clip_level,
        .tolerance,
        .jump,
        .no_noise_samples,
        .span,
        .band,
        .offset_limit,
        .balance_limit,
        .quadrature_limit,
        .sign_threshold,
        .clear_signal_faults,
        // recorder
        .decimation,
        .phases,
        .record,
        .recorder_read,
        .recorded,
        .full,
        .invalid,
        // encoder
        .levels(levels[1:0]),
        .quadrature_count,
        .disturbed,
        // shared chain
        .chain_setting_written,
        .chain_harmonic_enable,
        .chain_learn,
        .sample_valid,
        .sample_sin,
        .sample_cos,
        .chain_sampled,
        .chain_sin,
        .chain_cos,
        .chain_rejected,
        .chain_phase_valid,
        .chain_plain_phase,
        .chain_done,
        .chain_step,
        .chain_phase,
        .chain_overspeed,
        .chain_disagreement,
        .chain_lost,
        // signals
        .sin,
        .cos,
        .phase,
        .amplitude,
        // events
        .sample_rejected,
        .overspeed,
        .disagreement,
        .signal_faults,
        .first_signal_faults,
        // step of the position
        .tracked,
        .tracked_step,
        .tracked_phase
    );
    scale_position #(
        .HAS_SINE(HAS_SINE),
        .SEGMENTS(SEGMENTS)
    ) u_position (
        .clk,
        .rst,
        // source
        .use_counts,
        .sample_tick,
        .by_counts,
        .convert,
        // step by sine and cosine
        .tracked,
        .tracked_step,
        .tracked_phase,
        // counts
        .quadrature_step,
        .align_written,
        .align,
        // shift of the origin
        .shift,
        .shift_periods,
        // segment table
        .segment_enable,
        .segment_linear,
        .segments,
        .segment_origin,
        .segment_origin_written,
        .segment_length,
        .segment_point,
        .segment_border,
        .segment_point_written,
        .segment_read,
        .segment_read_point,
        .segment_in_force,
        .segment_outside,
        .segment_error,
        .segment_known,
        .segment_stored,
        // position
        .position_valid,
        .position(sensor_position),
        .moved,
        .moved_by,
        .moves,
        .shifted,
        .shifted_periods,
        .step_made,
        .step_down
    );
    if (HAS_BACKLASH != 0) begin : g_backlash
        backlash_compensation u_backlash (
            .clk,
            .rst,
            .tick,
            // settings
            .backlash,
            .take_up_rate  (backlash_rate),
            .hysteresis    (backlash_hysteresis),
            .motor_side    (backlash_motor_side),
            // motion_engine
            .valid         (result_valid),
            .kind          (result_kind),
            .result,
            // position
            .position      (sensor_position),
            .table_position(position),
            .take_up
        );
    end else begin : g_no_backlash
        assign position = sensor_position;
        assign take_up  = '0;

        wire unused_backlash = &{
            1'b0, backlash, backlash_rate, backlash_hysteresis, backlash_motor_side,
            result_valid, result_kind, result
        };
    end
    position_events #(
        .CAPTURE_DELAY(CAPTURE_DELAY),
        .ZEROS        (QUARTERS ? 14 : 0),
        .HAS_CAPTURE  (HAS_CAPTURE),
        .HAS_COMPARE  (HAS_COMPARE)
    ) u_position_events (
        .clk,
        .rst,
        // events
        .by_counts,
        .index_found,
        .capture_now,
        .sync,
        .tick,
        .probe,
        // position
        .now,
        .position_valid,
        .step_made,
        .position,
        .shifted,
        .shifted_periods,
        // captures
        .capture_sources,
        .capture_next,
        .capture_clear,
        .present,
        .captured_sources,
        .captured_age,
        .captured_time,
        .captured_position,
        .capture_free,
        .overrun,
        // compare pulses
        .compare_start,
        .compare_step,
        .compare_count,
        .pulse_length,
        .gap_length,
        .compare_arm,
        .compare_disarm,
        .armed,
        .compare_pulse,
        .late,
        .passed
    );

    feedback_registers #(
        .HAS_MONITOR      (HAS_MONITOR),
        .HAS_HARMONICS    (HAS_HARMONICS),
        .HAS_RECORDER     (HAS_RECORDER),
        .HAS_COMPARE      (HAS_COMPARE),
        .HAS_ENCODER_CHECK(HAS_ENCODER_CHECK),
        .HAS_BACKLASH     (HAS_BACKLASH)
    ) u_registers (
        .clk,
        .rst,
        // register bus
        .select,
        .write,
        .word,
        .wdata,
        .wdata_low,
        .rdata,
        // edges and index
        .edge_filter_skip                   (filter_skip),
        .edge_filter_tolerated              (filter_tolerated),
        .decoder_mode                       (mode),
        .index_active_low                   (index_low),
        .index_gate_mask                    (gate_mask),
        .index_gate                         (gate),
        .index_up,
        .index_down,
        .index_each,
        .counts_per_revolution,
        // strobes
        .strobes_arm_index                  (arm_index),
        .strobes_load_correction            (load_correction),
        .strobes_swap_harmonics             (swap_harmonics),
        .strobes_record                     (record),
        .strobes_clear_signal_faults        (clear_signal_faults),
        .strobes_capture_now                (capture_now),
        .strobes_capture_next               (capture_next),
        .strobes_capture_clear              (capture_clear),
        .strobes_compare_arm                (compare_arm),
        .strobes_compare_disarm             (compare_disarm),
        // index events
        .index_events_found                 (index_found),
        .index_events_revolution_wrong      (revolution_wrong),
        .index_events_armed                 (index_armed),
        .index_count                        (HAS_ENCODER_CHECK != 0 ? index_count : 32'sd0),
        .edge_time                          (HAS_ENCODER_CHECK != 0 ? edge_time : 32'd0),
        // correction
        .correction_offset_written          (offset_written),
        .correction_gain_written            (gain_written),
        .correction_quadrature_error_written(quadrature_error_written),
        .harmonic_enable,
        .harmonic_point_written,
        // recorder
        .recorder_decimation                (decimation),
        .recorder_phases                    (phases),
        .recorder_state_full                (full),
        .recorder_state_invalid             (invalid),
        .recorder_word                      (recorded),
        .recorder_word_read                 (recorder_read),
        // signal monitor
        .signal_faults,
        .first_signal_faults,
        .signal_fault_mask,
        .lissajous_limits_clip_level        (clip_level),
        .lissajous_limits_tolerance         (tolerance),
        .jump_limits_jump                   (jump),
        .jump_limits_no_noise_samples       (no_noise_samples),
        .channel_limits_span                (span),
        .channel_limits_band                (band),
        .drift_limits_offset                (offset_limit),
        .drift_limits_balance               (balance_limit),
        .quadrature_limits_quadrature_error (quadrature_limit),
        .quadrature_limits_sign_threshold   (sign_threshold),
        // capture
        .capture_sources,
        .capture_state_present              (present),
        .capture_state_free                 (capture_free),
        .capture_state_overrun              (overrun),
        .captured_sources,
        .captured_age,
        .captured_time,
        .captured_position,
        // compare
        .compare_start,
        .compare_step,
        .compare_count,
        .compare_pulse                      (pulse_length),
        .compare_gap                        (gap_length),
        .compare_state_armed                (armed),
        .compare_state_late                 (late),
        .compare_passed                     (passed),
        // source of the position
        .position_source_counts             (use_counts),
        .position_source_steps              (own_steps),
        .align,
        .align_written,
        // segment table
        .segment_use_enable                 (segment_enable),
        .segment_use_linear                 (segment_linear),
        .segment_use_segments               (segments),
        .segment_state_in_force             (segment_in_force),
        .segment_state_outside              (segment_outside),
        .segment_state_known                (segment_known),
        .segment_origin,
        .segment_origin_written,
        .segment_length,
        .segment_point,
        .segment_point_border               (segment_border),
        .segment_point_written,
        .segment_read_border                (segment_read_point),
        .segment_read_written               (segment_read),
        .segment_stored,
        .segment_error,
        // backlash
        .backlash,
        .backlash_rate,
        .backlash_rate_hysteresis           (backlash_hysteresis),
        .backlash_rate_motor_side           (backlash_motor_side)
    );

    wire unused = &{1'b0, direction, illegal_seen, illegal_fault, revolution_fault, levels[2]};
endmodule

`default_nettype wire
