// SPDX-License-Identifier: Apache-2.0
// interpolator_bench -- test bench: ADC word to corrected position, with the blocks connected as in
// feedback_channel.sv.
//
// Every input is registered first, so that the chain begins at a register, as in the node.
`default_nettype none

module interpolator_bench #(
    parameter int W = 8  // bits of a sample
) (
    input  wire                 clk,
    input  wire                 rst,               // level: the chain starts again
    input  wire         [  7:0] outlier_step,      // counts: setting of limit filter 1
    input  wire         [  7:0] outlier_hold,      // samples: setting of limit filter 1
    input  wire                 load,              // strobe: load the settings of the correction
    input  wire signed  [ 15:0] sin_offset,        // full scale = 2^15
    input  wire signed  [ 15:0] cos_offset,        // full scale = 2^15
    input  wire         [ 16:0] gain,              // factor, 1.0 = 2^16
    input  wire signed  [ 16:0] quadrature_error,  // factor, 1.0 = 2^16
    input  wire                 enable,            // level: correct the harmonics
    input  wire                 write,             // strobe: write a point of the table
    input  wire         [  7:0] point,             // 2^-8 period
    input  wire signed  [ 17:0] value,             // 2^-20 period
    input  wire                 swap,              // strobe: use the written table
    input  wire signed  [ 31:0] shift_periods,     // periods
    input  wire                 valid,             // strobe: sin and cos are a new ADC word
    input  wire signed  [W-1:0] sin,               // counts, full scale = 2^(W-1)
    input  wire signed  [W-1:0] cos,               // counts, full scale = 2^(W-1)
    output logic                done,              // strobe: position belongs to a new sample
    output logic signed [ 47:0] position,          // Q32.16 periods
    output logic                overspeed          // strobe: the speed is too high
);
    localparam int INPUTS = 8 + 8 + 1 + 16 + 16 + 17 + 17 + 1 + 1 + 8 + 18 + 1 + 32 + 1 + 2 * W;

    logic [INPUTS-1:0] held;
    wire [7:0] outlier_step_q, outlier_hold_q, point_q;
    wire load_q, enable_q, write_q, swap_q, converted;
    wire sampled, corrected, phase_valid, harmonics_off, stepped;
    wire signed [15:0] sin_offset_q, cos_offset_q, corrected_sin, corrected_cos;
    wire [16:0] gain_q;
    wire signed [16:0] quadrature_error_q, step;
    wire signed [17:0] value_q;
    wire signed [31:0] shift_periods_q;
    wire signed [W-1:0] raw_sin, raw_cos, limited_sin, limited_cos;
    wire [15:0] plain_phase, phase, tracked_phase, amplitude;
    wire rejected;

    assign {
        outlier_step_q, outlier_hold_q, load_q, sin_offset_q, cos_offset_q, gain_q,
        quadrature_error_q, enable_q, write_q, point_q, value_q, swap_q,
        shift_periods_q, converted, raw_sin, raw_cos
    } = held;
    always_ff @(posedge clk) begin
        held <= {
            outlier_step,
            outlier_hold,
            load,
            sin_offset,
            cos_offset,
            gain,
            quadrature_error,
            enable,
            write,
            point,
            value,
            swap,
            shift_periods,
            valid,
            sin,
            cos
        };
        if (rst) held <= '0;
    end

    outlier_filter #(
        .W(W)
    ) u_limiter (
        .clk,
        .rst,
        .step   (outlier_step_q),
        .hold   (outlier_hold_q),
        .valid  (converted),
        .axis   (1'b0),
        .sin    (raw_sin),
        .cos    (raw_cos),
        .done   (sampled),
        .sin_out(limited_sin),
        .cos_out(limited_cos),
        .rejected
    );
    signal_correction #(
        .W(W)
    ) u_correction (
        .clk,
        .rst,
        .load            (load_q),
        .load_axis       (1'b0),
        .sin_offset      (sin_offset_q),
        .cos_offset      (cos_offset_q),
        .gain            (gain_q),
        .quadrature_error(quadrature_error_q),
        .valid           (sampled),
        .axis            (1'b0),
        .sin             (limited_sin),
        .cos             (limited_cos),
        .done            (corrected),
        .sin_out         (corrected_sin),
        .cos_out         (corrected_cos)
    );
    arctan_pipelined #(
        .W    (16),
        .STEPS(2)
    ) u_arctan (
        .clk,
        .rst,
        .valid(corrected),
        .sin  (corrected_sin),
        .cos  (corrected_cos),
        .done (phase_valid),
        .phase(plain_phase),
        .amplitude
    );
    harmonic_correction u_harmonics (
        .clk,
        .rst,
        .enable    (enable_q),
        .table_axis(1'b0),
        .write     (write_q),
        .point     (point_q),
        .value     (value_q),
        .swap      (swap_q),
        .valid     (phase_valid),
        .axis      (1'b0),
        .phase     (plain_phase),
        .done      (harmonics_off),
        .phase_out (phase)
    );
    fringe_tracker u_tracker (
        .clk,
        .rst,
        .valid    (harmonics_off),
        .axis     (1'b0),
        .phase,
        .done     (stepped),
        .step,
        .phase_out(tracked_phase),
        .overspeed
    );
    unwrap u_position (
        .clk,
        .rst,
        .valid        (stepped),
        .step,
        .phase        (tracked_phase),
        .shift_periods(shift_periods_q),
        .done,
        .position
    );

    wire unused = &{1'b0, rejected, amplitude};
endmodule

`default_nettype wire
