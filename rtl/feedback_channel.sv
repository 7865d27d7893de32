// SPDX-License-Identifier: Apache-2.0
// feedback_channel -- the measuring path of an axis: from the pins of a grating to position and
// velocity.
//
// latency  see the rooms; 22 clk from a converter word to position, 2 clk from a count of A/B/Z; 1
//          clk more with a segment table
// rate     one sample per `sample_tick`, one velocity per `tick`
// source   S0: interferometer with sine, cosine and comparator outputs; any A/B/Z scale
// model    the models of its blocks; proved in motion by tb/system
`default_nettype none

module feedback_channel #(
    parameter int W = 8,  // bits of a sample
    parameter int SEGMENTS = 0,  // most segments of its table; 0: there is none
    parameter int SINE = 1                      // 0: nothing of sine and cosine is built, the position is made of counts
) (
    input wire clk,
    input wire rst,
    input wire tick,  // strobe: servo tick
    input wire sample_tick,  // strobe: start a conversion
    input wire sync,  // strobe: captured as one of software is
    input wire [31:0] now,  // clk
    input wire select,  // register bus, this grating
    input wire write,
    input wire [5:0] word,  // 32-bit word of the block
    input wire [31:0] wdata,
    output logic [31:0] rdata,
    input wire [15:0] deglitch,  // settings held by axis_registers from here on
    input wire [7:0] outlier_step,
    input wire [7:0] outlier_hold,
    input wire [15:0] amplitude_low,
    input wire [15:0] amplitude_high,
    input wire [19:0] disagreement_limit,
    input wire shift,  // strobe: move the origin
    input wire signed [31:0] shift_periods,
    input wire a,  // pins, synchronous to clk, from here on
    input wire b,
    input wire z,
    input wire [1:0] probe,
    input  wire                  own_step,      // pins of the axis itself, which may be counted in place of a and b; not filtered
    input wire own_direction,
    input wire adc_sin,  // serial data, synchronous to adc_sclk
    input wire adc_cos,
    output logic adc_cs_n,  // pins
    output logic adc_sclk,
    output logic compare_pulse,
    output logic signed [W-1:0] sin,  // after limit filter 1
    output logic signed [W-1:0] cos,
    output logic sample_rejected,  // strobe: limit filter 1 held a sample back
    output logic [2:0] edge_rejected,  // strobes {z, b, a}: the edge filter held a pulse back
    output logic [15:0] phase,  // corrected
    output logic [15:0] amplitude,
    output logic signed [31:0] quadrature_count,
    output logic [5:0] events,  // in the order of axis_registers.encoder_events
    output logic signal_fault,  // level: a masked signal fault stands
    output logic position_valid,
    output logic signed [47:0] position,  // Q32.16 periods, less the error of the segment table
    output logic moved,  // strobe: position grows by moved_by in the next clk, besides its motion
    output logic signed [47:0] moved_by,  // 2^-16 period
    output logic signed [31:0] velocity  // 2^-16 period/tick, of the scale itself
);
    if (SEGMENTS != 0 && (SEGMENTS < 3 || SEGMENTS > 255)) begin : g_check_segments
        SEGMENTS_MUST_BE_0_OR_FROM_3_TO_255 u_error ();
    end

    // settings and strobes from the registers
    wire        [15:0] filter_skip, decimation, clip_level, tolerance, jump, no_noise_samples, span, offset_limit, balance_limit, quadrature_limit, sign_threshold, quantum;
    wire [3:0] filter_tolerated;
    wire [1:0] mode, gate_mask, gate;
    wire index_low, index_up, index_down, index_each, harmonic_enable, phases, harmonic_write;
    wire arm_index, load_correction, swap_harmonics, record, clear_signal_faults;
    wire capture_now, capture_next, capture_clear, compare_arm, compare_disarm, recorder_read;
    wire [31:0] counts_per_revolution, compare_count;
    wire signed [15:0] sin_offset, cos_offset;
    wire        [16:0] gain;
    wire signed [16:0] quadrature_error;
    wire signed [17:0] harmonic_value;
    wire [7:0] harmonic_at, band;
    wire [14:0] signal_fault_mask;
    wire [ 6:0] capture_sources;
    wire signed [47:0] compare_start, compare_step;
    wire [23:0] pulse_length, gap_length;
    wire counts_chosen, by_steps, align_written;
    wire              by_counts = counts_chosen || SINE == 0;
    wire signed [2:0] align;
    wire               segment_enable, segment_linear, segment_origin_written, segment_point_written, segment_read;
    wire [7:0] segments, segment_border, segment_read_point;
    wire signed [47:0] segment_origin;
    wire        [47:0] segment_length;
    wire signed [23:0] segment_point;

    // decode
    localparam [1:0] PULSES = 2'd3;  // decoder_mode: pulses and direction
    wire        [ 2:0] levels;  // {z, b, a}, filtered
    wire signed [31:0] index_count;
    wire        [31:0] edge_time;
    wire index_found, index_armed, illegal, revolution_wrong;
    wire signed [1:0] quadrature_step;
    wire direction, illegal_seen, illegal_fault, revolution_fault;
    // a step lost, where elsewhere it is a glitch
    wire too_short = mode == PULSES && !by_steps && edge_rejected[0];

    incremental_encoder #(
        .FILTER_W(16)
    ) u_encoder (
        .clk,
        .rst,
        .filter_skip,
        .filter_required(deglitch),
        .filter_tolerated,
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
        .now,
        .a,
        .b,
        .z,
        .own            (by_steps),
        .own_a          (own_step),
        .own_b          (!own_direction),
        .count          (quadrature_count),
        .step           (quadrature_step),
        .direction,
        .edge_time,
        .index_found,
        .index_armed,
        .index_count,
        .filtered       (levels),
        .rejected       (edge_rejected),
        .illegal,
        .illegal_seen,
        .illegal_fault,
        .revolution_wrong,
        .revolution_fault
    );

    // sine and cosine: sense, interpolate, learn
    wire [14:0] signal_faults, first_signal_faults;
    wire overspeed, disagreement, stepped, full, invalid;
    wire        [15:0] tracked_phase;
    wire signed [16:0] step;
    wire        [31:0] recorded;
    wire               placed;
    // of the scale, its fraction is the phase
    wire signed [47:0] place;

    if (SINE != 0) begin : g_sine
        wire converted, sampled, ready, corrected, phase_valid, harmonics_off;
        wire signed [W-1:0] raw_sin, raw_cos;
        wire signed [15:0] corrected_sin, corrected_cos;
        wire [15:0] plain_phase, corrected_amplitude;

        dual_adc_reader #(
            .W(W)
        ) u_converter (
            .clk,
            .rst,
            .start  (sample_tick && !by_counts),
            .sdata_a(adc_sin),
            .sdata_b(adc_cos),
            .cs_n   (adc_cs_n),
            .sclk   (adc_sclk),
            .valid  (converted),
            .sin    (raw_sin),
            .cos    (raw_cos)
        );
        outlier_filter #(
            .W(W)
        ) u_limiter (
            .clk,
            .rst,
            .step    (outlier_step),
            .hold    (outlier_hold),
            .valid   (converted),
            .sin     (raw_sin),
            .cos     (raw_cos),
            .done    (sampled),
            .sin_out (sin),
            .cos_out (cos),
            .rejected(sample_rejected)
        );
        signal_monitor #(
            .W(W)
        ) u_monitor (
            .clk,
            .rst,
            .clear     (clear_signal_faults),
            .low       (amplitude_low),
            .high      (amplitude_high),
            .clip_level,
            .tolerance,
            .jump,
            .band,
            .span,
            .no_noise_samples,
            .sign_threshold,
            .offset_limit,
            .balance_limit,
            .quadrature_limit,
            .valid     (sampled),
            .sin,
            .cos,
            .a         (levels[0]),
            .b         (levels[1]),
            .phase_jump(overspeed),
            .lost_count(disagreement),
            .amplitude,
            .ready,
            .faults    (signal_faults),
            .first     (first_signal_faults)
        );

        signal_correction #(
            .W(W)
        ) u_correction (
            .clk,
            .rst,
            .load   (load_correction),
            .sin_offset,
            .cos_offset,
            .gain,
            .quadrature_error,
            .valid  (sampled),
            .sin,
            .cos,
            .done   (corrected),
            .sin_out(corrected_sin),
            .cos_out(corrected_cos)
        );
        arctan_pipelined #(
            .W    (16),
            .STEPS(2)
        ) u_arctan (
            .clk,
            .rst,
            .valid    (corrected),
            .sin      (corrected_sin),
            .cos      (corrected_cos),
            .done     (phase_valid),
            .phase    (plain_phase),
            .amplitude(corrected_amplitude)
        );
        harmonic_correction u_harmonics (
            .clk,
            .rst,
            .enable   (harmonic_enable),
            .write    (harmonic_write),
            .point    (harmonic_at),
            .value    (harmonic_value),
            .swap     (swap_harmonics),
            .valid    (phase_valid),
            .phase    (plain_phase),
            .done     (harmonics_off),
            .phase_out(phase)
        );
        fringe_tracker u_tracker (
            .clk,
            .rst,
            .valid    (harmonics_off),
            .phase,
            .done     (stepped),
            .step,
            .phase_out(tracked_phase),
            .overspeed
        );

        count_phase_check u_count_phase_check (
            .clk,
            .rst,
            .limit   (disagreement_limit),
            .valid   (placed),
            .position(place),
            .count   (quadrature_count),
            .shift,
            .shift_periods,
            .disagreement
        );
        calibration_recorder #(
            .W(W)
        ) u_recorder (
            .clk,
            .rst,
            .start    (record),
            .phases,
            .decimation,
            .sampled  (converted),
            .sin      (raw_sin),
            .cos      (raw_cos),
            .phase_valid,
            .phase    (plain_phase),
            .disturbed(|signal_faults[1:0] || overspeed),
            .read     (recorder_read),
            .word     (recorded),
            .full,
            .invalid
        );
        wire unused_sine = &{1'b0, ready, corrected_amplitude};
    end else begin : g_no_sine
        assign {adc_cs_n, adc_sclk} = 2'b11;
        assign {sin, cos, sample_rejected, phase, amplitude, signal_faults, first_signal_faults, overspeed, disagreement, stepped, step,
                tracked_phase, recorded, full, invalid} = '0;
    end

    // position
    wire present, overrun, armed, late;
    wire [ 6:0] captured_sources;
    wire [15:0] captured_age;
    wire [31:0] captured_time, passed;
    wire signed [47:0] captured_position;
    wire        [ 4:0] capture_free;
    wire signed [39:0] fine;
    wire               counted;
    wire signed [16:0] count_step;
    wire        [15:0] counted_phase;
    // found, until the position of its count stands
    logic       [ 2:0] index_later;

    always_ff @(posedge clk) index_later <= rst ? '0 : {index_later[1:0], index_found};

    count_to_phase u_counts (
        .clk,
        .rst,
        .tick        (sample_tick),
        .count_step  (quadrature_step),
        .align       (align_written),
        .align_counts(align),
        .valid       (counted),
        .step        (count_step),
        .phase       (counted_phase)
    );
    unwrap u_position (
        .clk,
        .rst,
        .valid   (by_counts ? counted : stepped),
        .step    (by_counts ? count_step : step),
        .phase   (by_counts ? counted_phase : tracked_phase),
        .shift,
        .shift_periods,
        .done    (placed),
        .position(place)
    );
    velocity_estimator u_velocity (
        .clk,
        .rst,
        .quantum,
        .tick,
        .position(place),
        .shift,
        .shift_periods,
        .velocity,
        .fine
    );

    // compensate
    wire segment_in_force, segment_outside, segment_known;
    logic               shifted;  // shift, as late as position
    logic signed [31:0] shifted_periods;
    wire signed [23:0] segment_error, segment_stored;

    if (SEGMENTS != 0) begin : g_segments
        localparam int INDEX = $clog2(SEGMENTS + 1);

        segment_correction #(
            .INDEX(INDEX)
        ) u_segments (
            .clk,
            .rst,
            .enable        (segment_enable),
            .linear        (segment_linear),
            .origin_written(segment_origin_written),
            .origin        (segment_origin),
            .segment_length,
            .segments      (segments[INDEX-1:0]),
            .write         (segment_point_written),
            .point         (segment_border[INDEX-1:0]),
            .value         (segment_point),
            .read          (segment_read),
            .read_point    (segment_read_point[INDEX-1:0]),
            .valid         (placed),
            .position      (place),
            .shift,
            .shift_periods,
            .done          (position_valid),
            .corrected     (position),
            .moved,
            .moved_by,
            .in_force      (segment_in_force),
            .outside       (segment_outside),
            .error         (segment_error),
            .known         (segment_known),
            .stored        (segment_stored)
        );
        always_ff @(posedge clk) begin
            shifted <= shift && !rst;
            if (shift) shifted_periods <= shift_periods;
        end
    end else begin : g_no_segments
        assign {position_valid, position} = {placed, place};
        assign {moved, moved_by} = {shift, shift_periods, 16'd0};
        assign {shifted, shifted_periods} = {shift, shift_periods};
        assign {segment_in_force, segment_outside, segment_known, segment_error, segment_stored} = '0;
    end

    // capture, compare
    position_capture u_capture (
        .clk,
        .rst,
        .enabled (capture_sources),
        .index   (by_counts ? index_later[SEGMENTS==0?1 : 2] : index_found),
        .tick,
        .software(capture_now || sync),
        .probe,
        .now,
        .valid   (position_valid),
        .position,
        .pop     (capture_next),
        .clear   (capture_clear),
        .present,
        .captured_sources,
        .captured_age,
        .captured_time,
        .captured_position,
        .free    (capture_free),
        .overrun
    );
    position_compare u_compare (
        .clk,
        .rst,
        .start        (compare_start),
        .step         (compare_step),
        .count        (compare_count),
        .pulse_length,
        .gap_length,
        .arm          (compare_arm),
        .disarm       (compare_disarm),
        .valid        (position_valid),
        .position,
        .shift        (shifted),
        .shift_periods(shifted_periods),
        .armed,
        .pulse        (compare_pulse),
        .late,
        .passed
    );

    // registers
    assign events       = {too_short, disagreement, signal_faults[1], signal_faults[0], overspeed, illegal};
    assign signal_fault = |(signal_faults & signal_fault_mask);

    feedback_registers #(
        .SINE(SINE)
    ) u_registers (
        .clk,
        .rst,
        .select,
        .write,
        .word,
        .wdata,
        .rdata,
        .edge_filter_skip                  (filter_skip),
        .edge_filter_tolerated             (filter_tolerated),
        .decoder_mode                      (mode),
        .index_active_low                  (index_low),
        .index_gate_mask                   (gate_mask),
        .index_gate                        (gate),
        .index_up,
        .index_down,
        .index_each,
        .counts_per_revolution,
        .strobes_arm_index                 (arm_index),
        .strobes_load_correction           (load_correction),
        .strobes_swap_harmonics            (swap_harmonics),
        .strobes_record                    (record),
        .strobes_clear_signal_faults       (clear_signal_faults),
        .strobes_capture_now               (capture_now),
        .strobes_capture_next              (capture_next),
        .strobes_capture_clear             (capture_clear),
        .strobes_compare_arm               (compare_arm),
        .strobes_compare_disarm            (compare_disarm),
        .index_events_found                (index_found),
        .index_events_revolution_wrong     (revolution_wrong),
        .index_events_armed                (index_armed),
        .index_count,
        .edge_time,
        .correction_offset_sin             (sin_offset),
        .correction_offset_cos             (cos_offset),
        .correction_gain                   (gain),
        .correction_quadrature_error       (quadrature_error),
        .harmonic_enable,
        .harmonic_point                    (harmonic_value),
        .harmonic_point_point              (harmonic_at),
        .harmonic_point_written            (harmonic_write),
        .recorder_decimation               (decimation),
        .recorder_phases                   (phases),
        .recorder_state_full               (full),
        .recorder_state_invalid            (invalid),
        .recorder_word                     (recorded),
        .recorder_word_read                (recorder_read),
        .signal_faults,
        .first_signal_faults,
        .signal_fault_mask,
        .lissajous_limits_clip_level       (clip_level),
        .lissajous_limits_tolerance        (tolerance),
        .jump_limits_jump                  (jump),
        .jump_limits_no_noise_samples      (no_noise_samples),
        .channel_limits_span               (span),
        .channel_limits_band               (band),
        .drift_limits_offset               (offset_limit),
        .drift_limits_balance              (balance_limit),
        .quadrature_limits_quadrature_error(quadrature_limit),
        .quadrature_limits_sign_threshold  (sign_threshold),
        .capture_sources,
        .capture_state_present             (present),
        .capture_state_free                (capture_free),
        .capture_state_overrun             (overrun),
        .captured_sources,
        .captured_age,
        .captured_time,
        .captured_position,
        .compare_start,
        .compare_step,
        .compare_count,
        .compare_pulse                     (pulse_length),
        .compare_gap                       (gap_length),
        .compare_state_armed               (armed),
        .compare_state_late                (late),
        .compare_passed                    (passed),
        .velocity_quantum                  (quantum),
        .velocity_fine                     (fine),
        .position_source_counts            (counts_chosen),
        .position_source_steps             (by_steps),
        .position_source_sine              (SINE != 0),
        .align,
        .align_written,
        .segment_use_enable                (segment_enable),
        .segment_use_linear                (segment_linear),
        .segment_use_segments              (segments),
        .segment_state_built               (8'(SEGMENTS)),
        .segment_state_in_force            (segment_in_force),
        .segment_state_outside             (segment_outside),
        .segment_state_known               (segment_known),
        .segment_origin,
        .segment_origin_written,
        .segment_length,
        .segment_point,
        .segment_point_border              (segment_border),
        .segment_point_written,
        .segment_read_border               (segment_read_point),
        .segment_read_written              (segment_read),
        .segment_stored,
        .segment_error
    );

    wire unused = &{1'b0, direction, illegal_seen, illegal_fault, revolution_fault, levels, adc_sin, adc_cos, outlier_step, outlier_hold,
                    amplitude_low, amplitude_high, disagreement_limit, clip_level, tolerance, jump, band, span, no_noise_samples, sign_threshold, offset_limit,
                    balance_limit, quadrature_limit, clear_signal_faults, load_correction, sin_offset, cos_offset, gain, quadrature_error, harmonic_enable,
                    harmonic_write, harmonic_at, harmonic_value, swap_harmonics, record, phases, decimation, recorder_read, step, tracked_phase,
                    index_later, segment_enable, segment_linear, segments, segment_origin, segment_origin_written, segment_length,
                    segment_point, segment_border, segment_point_written, segment_read, segment_read_point};
endmodule

`default_nettype wire
