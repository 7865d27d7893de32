// SPDX-License-Identifier: Apache-2.0
// legacy_bench -- test bench: the same samples through the path of S0 as its paper describes it,
// and through the path of feedback_channel.sv.
//
`default_nettype none

module legacy_bench #(
    parameter int W           = 8,   // bits of a sample
    parameter int SUBDIVISION = 160  // counts of S0 per period
) (
    input  wire                 clk,
    input  wire                 rst,               // level: both paths start again
    input  wire                 valid,             // strobe: a sample, once in 30 cycles at most
    input  wire signed  [W-1:0] sin,               // counts, full scale = 2^(W-1)
    input  wire signed  [W-1:0] cos,               // counts, full scale = 2^(W-1)
    input  wire         [  7:0] largest_move,      // counts: limit filter 1; 0: off
    input  wire                 limit_counts,      // level: use limit filter 2
    input  wire                 load,              // strobe: load the settings of the correction
    input  wire signed  [ 15:0] sin_offset,        // full scale = 2^15
    input  wire signed  [ 15:0] cos_offset,        // full scale = 2^15
    input  wire         [ 16:0] gain,              // factor, 1.0 = 2^16
    input  wire signed  [ 16:0] quadrature_error,  // factor, 1.0 = 2^16
    input  wire                 write,             // strobe: write a point of the table
    input  wire         [  7:0] point,             // 2^-8 period
    input  wire signed  [ 17:0] value,             // 2^-20 period
    input  wire                 swap,              // strobe: use the written table
    output logic                legacy_done,       // strobe: legacy_count is new
    output logic signed [ 31:0] legacy_count,      // 1 / SUBDIVISION period
    output logic                done,              // strobe: position is new
    output logic signed [ 47:0] position           // Q32.16 periods
);
    wire held, rejected, centred, found, stepped, placed, overspeed;
    wire signed [W-1:0] sin_held, cos_held, sin_centred, cos_centred, sin_drift, cos_drift;
    wire [15:0] phase, tracked;
    wire signed [16:0] step;
    wire signed [47:0] place;
    wire signed [55:0] counts = 56'(place) * SUBDIVISION;

    outlier_filter #(
        .W(W)
    ) u_limiter (
        .clk,
        .rst,
        .step   (largest_move),
        .hold   (8'd255),
        .valid,
        .axis   (1'b0),
        .sin,
        .cos,
        .done   (held),
        .sin_out(sin_held),
        .cos_out(cos_held),
        .rejected
    );
    peak_offset_tracker #(
        .W(W)
    ) u_offset (
        .clk,
        .rst,
        .enable    (1'b1),
        .valid     (held),
        .sin       (sin_held),
        .cos       (cos_held),
        .done      (centred),
        .sin_out   (sin_centred),
        .cos_out   (cos_centred),
        .sin_offset(sin_drift),
        .cos_offset(cos_drift)
    );
    arctan_table #(
        .W(W)
    ) u_arctan (
        .clk,
        .rst,
        .valid(centred),
        .sin  (sin_centred),
        .cos  (cos_centred),
        .done (found),
        .phase
    );
    fringe_tracker u_tracker (
        .clk,
        .rst,
        .valid    (found),
        .axis     (1'b0),
        .phase,
        .done     (stepped),
        .step,
        .phase_out(tracked),
        .overspeed
    );
    unwrap u_place (
        .clk,
        .rst,
        .valid        (stepped),
        .step,
        .phase        (tracked),
        .shift_periods(32'sd0),
        .done         (placed),
        .position     (place)
    );
    count_outlier_filter #(
        .W(32)
    ) u_counts (
        .clk,
        .rst,
        .enable   (limit_counts),
        .valid    (placed),
        .count    (counts[47:16]),
        .done     (legacy_done),
        .count_out(legacy_count)
    );

    wire corrected, turned, straight, moved, too_fast;
    wire signed [15:0] sin_corrected, cos_corrected;
    wire [15:0] plain_phase, true_phase, followed, amplitude;
    wire signed [16:0] move;

    signal_correction #(
        .W(W)
    ) u_correction (
        .clk,
        .rst,
        .load,
        .load_axis(1'b0),
        .sin_offset,
        .cos_offset,
        .gain,
        .quadrature_error,
        .valid,
        .axis     (1'b0),
        .sin,
        .cos,
        .done     (corrected),
        .sin_out  (sin_corrected),
        .cos_out  (cos_corrected)
    );
    arctan_pipelined #(
        .W    (16),
        .STEPS(2)
    ) u_angle (
        .clk,
        .rst,
        .valid(corrected),
        .sin  (sin_corrected),
        .cos  (cos_corrected),
        .done (turned),
        .phase(plain_phase),
        .amplitude
    );
    harmonic_correction u_harmonics (
        .clk,
        .rst,
        .enable    (1'b1),
        .table_axis(1'b0),
        .write,
        .point,
        .value,
        .swap,
        .valid     (turned),
        .axis      (1'b0),
        .phase     (plain_phase),
        .done      (straight),
        .phase_out (true_phase)
    );
    fringe_tracker u_follower (
        .clk,
        .rst,
        .valid    (straight),
        .axis     (1'b0),
        .phase    (true_phase),
        .done     (moved),
        .step     (move),
        .phase_out(followed),
        .overspeed(too_fast)
    );
    unwrap u_position (
        .clk,
        .rst,
        .valid        (moved),
        .step         (move),
        .phase        (followed),
        .shift_periods(32'sd0),
        .done,
        .position
    );

    wire unused = &{
        1'b0, rejected, sin_drift, cos_drift, overspeed, counts[55:48], counts[15:0],
        amplitude, too_fast
    };
endmodule

`default_nettype wire
