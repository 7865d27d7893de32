// SPDX-License-Identifier: Apache-2.0
// signal_monitor -- watch the sine and cosine samples and their comparators, and report each fault
// by name.
//
// latency  W + 24 cycles from valid to amplitude, ready and bits 0 to 12, which change together; 1
//          cycle from phase_jump and lost_count to bits 13 and 14
// rate     one sample per 2 W + 5 cycles, as the shortest frame of dual_adc_reader gives them
// behaviour The fault bits are 0 too_low, 1 too_high, 2 clipped, 3 off_circle, 4 jump, 5
//          channel_stuck, 6 no_noise, 7 comparator_mismatch, 8 comparator_stuck, 9
//          channel_missing, 10 offset_drift, 11 unbalanced, 12 not_in_quadrature, 13 phase_jump,
//          14 lost_count: see docs/signal_faults.md. Bits 0, 1, 2, 3 and 7 rise at the second bad
//          sample within 16 and fall after 16 good ones, so a single spike is not reported. jump:
//          a channel moves by more than twice the distance of the preceding sample (the larger of
//          both channels) plus `jump`, which no machine can do; the bit stays until the next
//          sample. A limit of 65535 switches its check off. first holds all faults of the cycle in
//          which the first one rose. A sample that comes too soon is not seen by every check.
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

    // each channel
    wire sampled, clipped, jumped, channel_stuck, no_noise;
    wire comparator_mismatch, comparator_stuck, channel_missing;

    channel_monitor #(
        .W(W)
    ) u_channels (
        .clk,
        .rst,
        .clip_level,
        .jump,
        .band,
        .span,
        .no_noise_samples,
        .sign_threshold,
        .valid,
        .sin,
        .cos,
        .a,
        .b,
        .done(sampled),
        .clipped,
        .jumped,
        .channel_stuck,
        .no_noise,
        .comparator_mismatch,
        .comparator_stuck,
        .channel_missing
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

    // report a fault at the second bad sample within 16: five faults one after the other
    wire             too_low = (low >> W) != '0 || low[W-1:0] > length[W-1:0];
    wire             too_high = (high >> W) == '0 && high[W-1:0] < length[W-1:0];
    wire  [4:0]      bad = {off_circle, too_high, too_low, comparator_mismatch, clipped};
    logic [2:0]      turn;  // 0: idle; from 2 on fault turn - 2 of bad
    // of each fault, the one whose turn it is at the right: it is reported; samples for which its
    // last bad one still counts
    logic [4:0][5:0] reports;
    wire             reported = reports[0][5];
    wire  [4:0]      left = reports[0][4:0];
    wire             now_bad = bad[turn-3'd2];
    wire  [4:0]      left_now = now_bad ? 5'd16 : left == '0 ? '0 : left - 1'b1;
    wire             report = now_bad ? left != '0 : reported && left > 5'd1;

    always_ff @(posedge clk) begin
        if (measured) turn <= 3'd1;
        else if (turn != '0) turn <= turn == 3'd6 ? '0 : turn + 1'b1;
        if (turn > 3'd1) reports <= {report, left_now, reports[4:1]};
        if (rst) begin
            turn    <= '0;
            reports <= '0;
        end
    end

    // all results of a sample
    logic [4:0] of_channels;  // bits 4, 5, 6, 8, 9
    wire [4:0] twice = {  // bits 7, 3, 1, 0, 2
        reports[1][5], reports[4][5], reports[3][5], reports[2][5], reports[0][5]
    };
    always_ff @(posedge clk) begin
        if (sampled)
            of_channels <= {channel_missing, comparator_stuck, no_noise, channel_stuck, jumped};
        if (judged) begin
            amplitude <= length;
            faults[3:0] <= {twice[3], twice[0], twice[2:1]};
            faults[7:4] <= {twice[4], of_channels[2:0]};
            faults[9:8] <= of_channels[4:3];
            faults[12:10] <= {not_in_quadrature, unbalanced, offset_drift};
        end
        faults[14:13] <= {lost_count, phase_jump};
        if (first == '0 || clear) first <= faults;
        if (rst) begin
            of_channels <= '0;
            amplitude   <= '0;
            faults      <= '0;
            first       <= '0;
        end
    end
endmodule

`default_nettype wire
