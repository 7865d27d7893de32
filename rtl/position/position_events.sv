// SPDX-License-Identifier: Apache-2.0
// position_events -- capture the position at events, and send compare pulses at positions.
//
// latency  see position_capture, index_capture and position_compare
// rate     see position_capture, index_capture and position_compare
// behaviour  A feature that is not built has no logic, and what it would report is 0. Without
//          HAS_CAPTURE only the index captures, one at a time, with its position alone: that is
//          what homing needs. The age of a captured position is the time since its sample; of a
//          position made of counts it is the time since the last count, so it shows how far the
//          event lies behind an edge of A or B.
// source   S0: position at the index; any scale that triggers a camera or a laser
// model    the models of its blocks; tested together by tb/system/test_feedback_counts.py
`default_nettype none

module position_events #(
    parameter int CAPTURE_DELAY = 2,  // cycles from an index to the position of its count
    parameter int ZEROS         = 0,  // lowest bits of the position that are always 0
    parameter int HAS_CAPTURE   = 1,  // 1: build the queue of captures
    parameter int HAS_COMPARE   = 1   // 1: build compare
) (
    input  wire                clk,
    input  wire                rst,
    // events
    input  wire                by_counts,          // level: the position is made of counts
    input  wire                index_found,        // strobe: the decoder found an index
    input  wire                capture_now,        // strobe: the software captures
    input  wire                sync,               // strobe: the sync pulse of the bus captures
    input  wire                tick,               // strobe: servo tick
    input  wire         [ 1:0] probe,              // levels of the probes, synchronous to clk
    // position
    input  wire         [31:0] now,                // cycles, time stamp
    input  wire                position_valid,     // strobe: position is new
    input  wire                step_made,          // strobe: position moves in the next cycle
    input  wire signed  [47:0] position,           // 2^-16 period
    input  wire                shifted,            // strobe: position jumps in the next cycle
    input  wire signed  [31:0] shifted_periods,    // periods by which it jumps
    // captures
    input  wire         [ 6:0] capture_sources,    // one bit per source, as in position_capture
    input  wire                capture_next,       // strobe: remove the oldest capture
    input  wire                capture_clear,      // strobe: remove all captures
    output logic               present,            // level: there is a capture
    output logic        [ 6:0] captured_sources,   // one bit per source
    output logic        [15:0] captured_age,       // cycles since the sample or the last count
    output logic        [31:0] captured_time,      // cycles, time stamp
    output logic signed [47:0] captured_position,  // 2^-16 period
    output logic        [ 4:0] capture_free,       // captures that still fit, 16 at most
    output logic               overrun,            // strobe: an event was dropped
    // compare pulses
    input  wire signed  [47:0] compare_start,      // 2^-16 period, the first point
    input  wire signed  [47:0] compare_step,       // 2^-16 period, from point to point
    input  wire         [31:0] compare_count,      // points; 0: no end
    input  wire         [23:0] pulse_length,       // cycles
    input  wire         [23:0] gap_length,         // cycles that compare_pulse is low, at least
    input  wire                compare_arm,        // strobe: begin with the first point
    input  wire                compare_disarm,     // strobe: no more points after this pulse
    output logic               armed,              // level: there are points to come
    output logic               compare_pulse,      // pin, high during a compare pulse
    output logic               late,               // strobe, with the start of a delayed pulse
    output logic        [31:0] passed              // points passed since compare_arm, wraps
);
    wire index, software;

    capture_events #(
        .DELAY(CAPTURE_DELAY)
    ) u_capture_events (
        .clk,
        .rst,
        .by_counts,
        .index_found,
        .capture_now,
        .sync,
        .index,
        .software
    );
    if (HAS_CAPTURE != 0) begin : g_capture
        logic step_made_q;

        always_ff @(posedge clk) step_made_q <= step_made;

        position_capture #(
            .ZEROS(ZEROS)
        ) u_capture (
            .clk,
            .rst,
            // sources
            .enabled(capture_sources),
            .index,
            .tick,
            .software,
            .probe,
            // position
            .now,
            .valid  (by_counts ? step_made_q : position_valid),
            .position,
            // queue
            .pop    (capture_next),
            .clear  (capture_clear),
            .present,
            .captured_sources,
            .captured_age,
            .captured_time,
            .captured_position,
            .free   (capture_free),
            .overrun
        );
    end else begin : g_no_capture
        index_capture u_capture (
            .clk,
            .rst,
            // source
            .enabled(capture_sources[0]),
            .index,
            .position,
            // capture
            .pop    (capture_next),
            .clear  (capture_clear),
            .present,
            .captured_position,
            .overrun
        );
        assign captured_sources = {6'd0, present};
        assign {captured_age, captured_time} = '0;
        assign capture_free = {4'd0, !present};

        wire unused = &{1'b0, capture_sources[6:1], tick, software, probe, now};
        wire unused_strobes = &{1'b0, position_valid, step_made};
    end
    if (HAS_COMPARE != 0) begin : g_compare
        position_compare u_compare (
            .clk,
            .rst,
            // settings
            .start        (compare_start),
            .step         (compare_step),
            .count        (compare_count),
            .pulse_length,
            .gap_length,
            .arm          (compare_arm),
            .disarm       (compare_disarm),
            // position
            .valid        (position_valid),
            .position,
            .shift        (shifted),
            .shift_periods(shifted_periods),
            // state
            .armed,
            .pulse        (compare_pulse),
            .late,
            .passed
        );
    end else begin : g_no_compare
        assign {armed, compare_pulse, late, passed} = '0;

        wire unused_settings = &{1'b0, compare_start, compare_step, compare_count};
        wire unused_pulses = &{
            1'b0, pulse_length, gap_length, compare_arm, compare_disarm, shifted, shifted_periods
        };
    end
endmodule

`default_nettype wire
