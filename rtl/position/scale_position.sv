// SPDX-License-Identifier: Apache-2.0
// scale_position -- compute the position of a scale from steps of its sine and cosine or from
// counts of its edges, and correct it by a segment table.
//
// latency  see unwrap, count_to_phase and segment_correction
// rate     one step per cycle
// behaviour  A shift moves the origin of the scale by whole periods. position is that of the scale
//          less its segment error; without a table the two are equal, moved repeats shift, and the
//          state of the table is 0.
// source   S0: interferometer, segment table; any A/B/Z scale
// model    the models of its blocks; tested together by tb/system/test_feedback_counts.py
`default_nettype none

module scale_position #(
    parameter int HAS_SINE = 1,  // 0: sine and cosine are not built
    parameter int SEGMENTS = 0   // most segments of the table, 3 to 255; 0: no table
) (
    input wire clk,
    input wire rst,
    // source
    input wire use_counts,  // setting: the position is made of counts
    input wire sample_tick,  // strobe: take a sample
    output logic by_counts,  // level: the position is made of counts
    output logic convert,  // strobe: start the ADC
    // step by sine and cosine
    input wire tracked,  // strobe: tracked_step leads to tracked_phase
    input wire signed [16:0] tracked_step,  // 2^-16 period
    input wire [15:0] tracked_phase,  // 2^-16 period
    // counts
    input wire signed [1:0] quadrature_step,  // counts: -1, 0, 1
    input wire align_written,  // strobe: move by align
    input wire signed [2:0] align,  // counts, -2 to 2
    // shift of the origin
    input wire shift,  // strobe: move the origin
    input wire signed [31:0] shift_periods,  // periods, distance of the shift; else 0
    // settings of the segment table
    input wire segment_enable,  // level: correct
    input wire segment_linear,  // level: straight lines; 0: rectangles
    input wire [7:0] segments,  // number of segments
    input wire signed [47:0] segment_origin,  // 2^-16 period, the first border
    input wire segment_origin_written,  // strobe: take segment_origin
    input wire [47:0] segment_length,  // 2^-16 period
    // points of the segment table
    input wire signed [23:0] segment_point,  // 2^-16 period: measured less true position
    input wire [7:0] segment_border,  // number of its border
    input wire segment_point_written,  // strobe: write segment_point
    input wire segment_read,  // strobe: read the point of segment_read_point back
    input wire [7:0] segment_read_point,  // number of a border
    // state of the segment table
    output logic segment_in_force,  // level: positions are corrected
    output logic segment_outside,  // level: the last position is off the table
    output logic signed [23:0] segment_error,  // 2^-16 period, 0 while not in force
    output logic segment_known,  // level: segment_stored is valid
    output logic signed [23:0] segment_stored,  // 2^-16 period, the point read back
    // position
    output logic position_valid,  // strobe: position is new
    output logic signed [47:0] position,  // 2^-16 period, less the segment error
    output logic moved,  // strobe: position will jump by moved_by
    output logic signed [47:0] moved_by,  // 2^-16 period, in the next cycle
    output logic moves,  // level: position will jump, with the table
    output logic shifted,  // strobe: shift, as late as position
    output logic signed [31:0] shifted_periods,  // periods, distance of that shift
    output logic step_made,  // strobe: position moves in the next cycle
    output logic step_down  // level: with step_made, it goes down
);
    wire counted, stepped, plain_valid;
    wire signed [16:0] counted_step, step;
    wire [15:0] counted_phase, step_phase;
    wire signed [47:0] plain_position;  // of the scale; its fraction is the phase

    count_to_phase u_counts (
        .clk,
        .rst,
        // counts
        .tick        (sample_tick),
        .count_step  (quadrature_step),
        .align       (align_written),
        .align_counts(align),
        // step
        .valid       (counted),
        .step        (counted_step),
        .phase       (counted_phase)
    );
    position_source #(
        .HAS_SINE(HAS_SINE)
    ) u_source (
        .use_counts,
        .sample_tick,
        // from sine and cosine
        .tracked,
        .tracked_step,
        .tracked_phase,
        // from counts
        .counted,
        .counted_step,
        .counted_phase,
        // selected
        .by_counts,
        .convert,
        .valid(stepped),
        .step,
        .phase(step_phase)
    );
    unwrap u_position (
        .clk,
        .rst,
        // step
        .valid   (stepped),
        .step,
        .phase   (step_phase),
        .shift_periods,
        // position of the scale
        .done    (plain_valid),
        .position(plain_position)
    );
    step_events #(
        .DELAY(SEGMENTS == 0 ? 0 : 1)
    ) u_steps (
        .clk,
        .rst,
        .valid   (stepped),
        .step,
        .stepped (step_made),
        .downward(step_down)
    );
    if (SEGMENTS != 0) begin : g_segments
        localparam int INDEX = $clog2(SEGMENTS + 1);

        assign moves = segment_enable != segment_in_force;
        segment_correction #(
            .INDEX(INDEX)
        ) u_segments (
            .clk,
            .rst,
            // settings
            .enable        (segment_enable),
            .linear        (segment_linear),
            .origin_written(segment_origin_written),
            .origin        (segment_origin),
            .segment_length,
            .segments      (segments[INDEX-1:0]),
            // table
            .write         (segment_point_written),
            .point         (segment_border[INDEX-1:0]),
            .value         (segment_point),
            .read          (segment_read),
            .read_point    (segment_read_point[INDEX-1:0]),
            // position of the scale
            .valid         (plain_valid),
            .position      (plain_position),
            .shift,
            .shift_periods,
            // corrected position
            .done          (position_valid),
            .corrected     (position),
            .moved,
            .moved_by,
            // state
            .in_force      (segment_in_force),
            .outside       (segment_outside),
            .error         (segment_error),
            .known         (segment_known),
            .stored        (segment_stored)
        );
        shift_delay u_shift (
            .clk,
            .rst,
            .shift,
            .shift_periods,
            .shifted,
            .shifted_periods
        );
    end else begin : g_no_segments
        assign {position_valid, position} = {plain_valid, plain_position};
        assign {moved, moved_by} = {shift, shift_periods, 16'd0};
        assign moves = 1'b0;
        assign {shifted, shifted_periods} = {shift, shift_periods};
        assign {segment_in_force, segment_outside, segment_known} = '0;
        assign {segment_error, segment_stored} = '0;

        wire unused_settings = &{
            1'b0, segment_enable, segment_linear, segments, segment_origin,
            segment_origin_written, segment_length
        };
        wire unused_table = &{
            1'b0, segment_point, segment_border, segment_point_written, segment_read,
            segment_read_point
        };
    end
endmodule

`default_nettype wire
