// SPDX-License-Identifier: Apache-2.0
// signal_monitor -- watch the sine and cosine samples and their comparators, and report each fault
// by name.
//
// latency  2 cycles from valid to bits 2 and 5 to 9, 5 to bit 4, 10 to bits 0 and 1, 14 to bits 3
//          and 10 to 12, 9 to amplitude; 1 cycle from phase_jump and lost_count to bits 13 and 14
// rate     one sample per cycle
// behaviour The fault bits are 0 too_low, 1 too_high, 2 clipped, 3 off_circle, 4 jump, 5
//          channel_stuck, 6 no_noise, 7 comparator_mismatch, 8 comparator_stuck, 9
//          channel_missing, 10 offset_drift, 11 unbalanced, 12 not_in_quadrature, 13 phase_jump,
//          14 lost_count: see docs/signal_faults.md. Bits 0, 1, 2, 3 and 7 rise at the second bad
//          sample within 16 and fall after 16 good ones, so a single spike is not reported. jump:
//          a channel moves by more than twice the distance of the preceding sample (the larger of
//          both channels) plus `jump`, which no machine can do; the bit stays until the next
//          sample. A limit of 65535 switches its check off. first holds all faults of the
//          cycle in which the first one rose.
// model    tb/sense/signal_monitor.py, equal in every bit of every cycle
`default_nettype none

module signal_monitor #(
    parameter int W = 8  // bits of a sample, 8 to 16
) (
    input  wire                clk,
    input  wire                rst,               // level: clears the faults and the circle
    input  wire                clear,             // strobe: forget the first fault
    input  wire        [ 15:0] low,               // counts: smallest good amplitude; 0: off
    input  wire        [ 15:0] high,              // counts: largest good amplitude
    input  wire        [ 15:0] clip_level,        // counts: largest good magnitude of a sample
    input  wire        [ 15:0] tolerance,         // counts: largest good distance from the circle
    input  wire        [ 15:0] jump,              // counts: smallest sudden step that is a fault
    input  wire        [  7:0] band,              // counts: largest noise of a channel at rest
    input  wire        [ 15:0] span,              // counts: motion of the other channel
    input  wire        [ 15:0] no_noise_samples,  // samples with the same code; 0: off
    input  wire        [ 15:0] sign_threshold,    // counts: beyond it a sign is sure
    input  wire        [ 15:0] offset_limit,      // counts: largest good offset
    input  wire        [ 15:0] balance_limit,     // counts: largest good difference of amplitudes
    input  wire        [ 15:0] quadrature_limit,  // counts: largest amplitude · sin phase error
    input  wire                valid,             // strobe: sin and cos are new
    input  wire signed [W-1:0] sin,               // counts, full scale = 2^(W-1)
    input  wire signed [W-1:0] cos,               // counts, full scale = 2^(W-1)
    input  wire                a,                 // level: cos > 0, up to a sample early or late
    input  wire                b,                 // level: sin > 0, up to a sample early or late
    input  wire                phase_jump,        // strobe: overspeed of fringe_tracker
    input  wire                lost_count,        // level: disagreement of count_phase_check
    output logic       [ 15:0] amplitude,         // counts: amplitude of the last sample
    output logic               ready,             // level: bits 3, 10 to 12 are judged
    output logic       [ 14:0] faults,            // levels: one bit per fault
    output logic       [ 14:0] first              // levels: the first faults; held until clear
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    // jump detection
    logic signed [W-1:0] last_sin, last_cos;
    logic signed [W:0] sin_step, cos_step;
    logic [W:0] sin_distance, cos_distance, distance;
    logic [18:0] allowed;  // largest distance that is no jump
    logic [ 3:0] stepped;  // pipeline of valid
    logic [ 1:0] seen;  // distances so far, up to 2; the first one has no start
    logic        jumped;

    always_ff @(posedge clk) begin
        stepped <= {stepped[2:0], valid};
        if (valid) begin
            last_sin <= sin;
            last_cos <= cos;
            sin_step <= sin - last_sin;
            cos_step <= cos - last_cos;
        end
        if (stepped[0]) begin
            sin_distance <= sin_step < 0 ? -sin_step : sin_step;
            cos_distance <= cos_step < 0 ? -cos_step : cos_step;
        end
        if (stepped[1]) distance <= sin_distance > cos_distance ? sin_distance : cos_distance;
        if (stepped[2]) begin
            allowed <= 19'({distance, 1'b0}) + 19'(jump);
            jumped <= seen[1] && jump != '1 && 19'(distance) > allowed;
            if (!seen[1]) seen <= seen + 1'b1;
        end
        if (rst) begin
            stepped <= '0;
            seen    <= 2'd0;
            jumped  <= 1'b0;
        end
    end

    // one monitor per channel
    wire [1:0] clipped, channel_stuck, no_noise;
    wire [1:0] comparator_mismatch, comparator_stuck, channel_missing;

    channel_monitor #(
        .W(W)
    ) u_cos (
        .clk,
        .rst,
        .clip_level,
        .band,
        .span,
        .no_noise_samples,
        .sign_threshold,
        .valid,
        .channel            (cos),
        .other              (sin),
        .level              (a),
        .other_level        (b),
        .clipped            (clipped[0]),
        .channel_stuck      (channel_stuck[0]),
        .no_noise           (no_noise[0]),
        .comparator_mismatch(comparator_mismatch[0]),
        .comparator_stuck   (comparator_stuck[0]),
        .channel_missing    (channel_missing[0])
    );
    channel_monitor #(
        .W(W)
    ) u_sin (
        .clk,
        .rst,
        .clip_level,
        .band,
        .span,
        .no_noise_samples,
        .sign_threshold,
        .valid,
        .channel            (sin),
        .other              (cos),
        .level              (b),
        .other_level        (a),
        .clipped            (clipped[1]),
        .channel_stuck      (channel_stuck[1]),
        .no_noise           (no_noise[1]),
        .comparator_mismatch(comparator_mismatch[1]),
        .comparator_stuck   (comparator_stuck[1]),
        .channel_missing    (channel_missing[1])
    );

    // both channels together
    wire measured, judged, off_circle, offset_drift, unbalanced, not_in_quadrature;
    wire [15:0] length;
    wire [1:0] axis, quadrant;
    wire [2:0] tilt;

    vector_length #(
        .W(W)
    ) u_length (
        .clk,
        .rst,
        .valid,
        .sin,
        .cos,
        .done(measured),
        .length,
        .axis,
        .quadrant,
        .tilt
    );
    lissajous_monitor #(
        .R(W)
    ) u_lissajous (
        .clk,
        .rst,
        .tolerance,
        .offset_limit,
        .balance_limit,
        .quadrature_limit,
        .valid (measured),
        .length(length[W-1:0]),
        .axis,
        .quadrant,
        .tilt,
        .ready,
        .done  (judged),
        .off_circle,
        .offset_drift,
        .unbalanced,
        .not_in_quadrature
    );

    // sized: the flags of the length are new; sampled: those of the channels are new
    logic too_low, too_high, sized, sampled;
    always_ff @(posedge clk) begin
        sized   <= measured;
        sampled <= valid;
        if (measured) begin
            amplitude <= length;
            too_low   <= length < low;
            too_high  <= high != '1 && length > high;
        end
        if (rst) begin
            sized     <= 1'b0;
            sampled   <= 1'b0;
            amplitude <= '0;
            too_low   <= 1'b0;
            too_high  <= 1'b0;
        end
    end

    // report a fault at the second bad sample within 16
    wire [4:0] bad = {|comparator_mismatch, off_circle, |clipped, too_high, too_low};
    wire [4:0] fresh = {sampled, judged, sampled, sized, sized};
    wire [4:0] repeated;
    for (genvar n = 0; n < 5; n++) begin : g_twice
        // samples for which the last bad one still counts
        logic [4:0] left;
        logic       fault;
        assign repeated[n] = fault;
        always_ff @(posedge clk) begin
            if (fresh[n]) begin
                if (bad[n]) left <= 5'd16;
                else if (left != '0) left <= left - 1'b1;
                fault <= bad[n] ? left != '0 : fault && left > 5'd1;
            end
            if (rst) begin
                left  <= '0;
                fault <= 1'b0;
            end
        end
    end

    logic [7:0] direct;  // bits 4, 5, 6, 8, 9; 10, 11, 12
    logic [1:0] external;
    always_ff @(posedge clk) begin
        if (stepped[3]) direct[0] <= jumped;
        if (sampled)
            direct[4:1] <= {|channel_missing, |comparator_stuck, |no_noise, |channel_stuck};
        if (judged) direct[7:5] <= {not_in_quadrature, unbalanced, offset_drift};
        external <= {lost_count, phase_jump};
        if (first == '0 || clear) first <= faults;
        if (rst) begin
            direct  <= '0;
            external <= '0;
            first   <= '0;
        end
    end

    assign faults = {external, direct[7:5], direct[4:3], repeated[4], direct[2:0], repeated[3:0]};
    // standing[2] is bit 2, standing[3] bit 3; direct[2:0] bits 4, 5, 6; standing[4] bit 7;
    // direct[4:3] bits 8, 9
endmodule

`default_nettype wire
