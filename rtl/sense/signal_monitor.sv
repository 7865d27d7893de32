// SPDX-License-Identifier: Apache-2.0
// signal_monitor -- watch the sine and cosine samples and their comparators, and name what is wrong
// with them.
//
// latency  from valid to bits 2, 5..9 2 clk, bit 4 5 clk, bits 0, 1 10 clk, bits 3, 10..12 14 clk,
//          amplitude 9 clk; 1 clk from phase_jump, lost_count
// rate     one sample per clk
// faults   0 too_low, 1 too_high, 2 clipped, 3 off_circle, 4 jump, 5 channel_stuck, 6 no_noise, 7
//          comparator_mismatch, 8 comparator_stuck, 9 channel_missing, 10 offset_drift, 11
//          unbalanced, 12 not_in_quadrature, 13 phase_jump, 14 lost_count: docs/signal_faults.md
// spikes   bits 0, 1, 2, 3 and 7 rise at the second bad sample within 16, and fall after 16 good
//          ones: a single spike is none
// jump     a channel moves by more than twice the way of the sample before (the larger of both
//          channels) and `jump`: nothing that has mass does that. It stands until the next sample
// model    tb/sense/signal_monitor.py, equal in every bit of every cycle
`default_nettype none

module signal_monitor #(
    parameter int W = 8  // bits of a sample
) (
    input wire clk,
    input wire rst,  // faults fall, the circle is forgotten
    input wire clear,  // strobe: forget the first fault
    input wire [15:0] low,  // smallest good amplitude; 0: never too low
    input  wire        [15:0]  high,            // largest good amplitude; here and below: 65535 switches off, unit is that of sin
    input wire [15:0] clip_level,  // largest good size of a code
    input wire [15:0] tolerance,  // largest good distance from the circle that was ready
    input wire [15:0] jump,  // smallest sudden step that is bad
    input wire [7:0] band,  // noise of a channel that stands, its largest deviation
    input wire [15:0] span,  // way of the other channel in which a channel must leave its band
    input  wire        [15:0]  no_noise_samples,           // samples with the same code that are bad; 0: any number is good
    input  wire        [15:0]  sign_threshold,            // larger samples have a sure sign, to be held against the comparators
    input wire [15:0] offset_limit,  // largest good offset
    input wire [15:0] balance_limit,  // largest good difference of the channels' amplitudes
    input wire [15:0] quadrature_limit,  // largest good amplitude · sine of the phase error
    input wire valid,  // strobe: sin and cos are new
    input wire signed [W-1:0] sin,  // full scale = 2^(W-1)
    input wire signed [W-1:0] cos,
    input wire a,  // filtered comparators at most a sample early or late: cos > 0
    input wire b,  // sin > 0
    input wire phase_jump,  // strobe: overspeed of fringe_tracker
    input wire lost_count,  // level: disagreement of count_phase_check
    output logic [15:0] amplitude,  // of the last sample
    output logic ready,  // level: the circle is known, bits 3, 10, 11, 12 are judged
    output logic [14:0] faults,  // levels
    output logic       [14:0]  first            // the faults that came first, all of the same clk; stands until clear
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    // a sudden step
    logic signed [W-1:0] last_sin, last_cos;
    logic signed [W:0] sin_step, cos_step;
    logic [W:0] sin_way, cos_way, way;
    logic [18:0] lawful;  // way from which a step is bad
    logic [ 3:0] stepped;  // the sample on its way
    logic [ 1:0] seen;  // ways, up to 2; the first one is from nowhere
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
            sin_way <= sin_step < 0 ? -sin_step : sin_step;
            cos_way <= cos_step < 0 ? -cos_step : cos_step;
        end
        if (stepped[1]) way <= sin_way > cos_way ? sin_way : cos_way;
        if (stepped[2]) begin
            lawful <= 19'({way, 1'b0}) + 19'(jump);
            jumped <= seen[1] && jump != '1 && 19'(way) > lawful;
            if (!seen[1]) seen <= seen + 1'b1;
        end
        if (rst) begin
            stepped <= '0;
            seen    <= 2'd0;
            jumped  <= 1'b0;
        end
    end

    // channel by channel
    wire [1:0] clipped, channel_stuck, no_noise, comparator_mismatch, comparator_stuck, channel_missing;

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

    // both together
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

    // the flags of the length are new, those of the channels
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

    // twice within 16
    wire [4:0] bad = {|comparator_mismatch, off_circle, |clipped, too_high, too_low};
    wire [4:0] fresh = {sampled, judged, sampled, sized, sized};
    wire [4:0] standing;
    for (genvar n = 0; n < 5; n++) begin : g_twice
        // samples for which the last bad one counts; 16 right after it
        logic [4:0] left;
        logic       fault;
        assign standing[n] = fault;
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
    logic [1:0] foreign;
    always_ff @(posedge clk) begin
        if (stepped[3]) direct[0] <= jumped;
        if (sampled)
            direct[4:1] <= {|channel_missing, |comparator_stuck, |no_noise, |channel_stuck};
        if (judged) direct[7:5] <= {not_in_quadrature, unbalanced, offset_drift};
        foreign <= {lost_count, phase_jump};
        if (first == '0 || clear) first <= faults;
        if (rst) begin
            direct  <= '0;
            foreign <= '0;
            first   <= '0;
        end
    end

    assign faults = {foreign, direct[7:5], direct[4:3], standing[4], direct[2:0], standing[3:0]};
    // standing[2] is bit 2, standing[3] bit 3; direct[2:0] bits 4, 5, 6; standing[4] bit 7;
    // direct[4:3] bits 8, 9
endmodule

`default_nettype wire
