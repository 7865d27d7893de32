// SPDX-License-Identifier: Apache-2.0
// interpolator_bench -- ADC word to corrected position, with the blocks in the order of
// feedback_channel.sv. Every input goes into a register first, so that the chain begins at one, as
// in the node.
`default_nettype none

module interpolator_bench #(
    parameter int W = 8  // bits of a sample
) (
    input wire clk,
    input wire rst,
    input wire [7:0] outlier_step,  // settings of the outlier filter
    input wire [7:0] outlier_hold,
    input wire load,  // strobe: take the four settings of the correction
    input wire signed [15:0] sin_offset,
    input wire signed [15:0] cos_offset,
    input wire [16:0] gain,
    input wire signed [16:0] quadrature_error,
    input wire enable,  // harmonics
    input wire write,  // strobe: a point of their table
    input wire [7:0] point,
    input wire signed [17:0] value,
    input wire swap,  // strobe: put their table in force
    input wire shift,  // strobe: move the origin
    input wire signed [31:0] shift_periods,
    input wire valid,  // strobe: sin and cos are a new ADC word
    input wire signed [W-1:0] sin,  // full scale = 2^(W-1)
    input wire signed [W-1:0] cos,
    output logic done,  // strobe: position of a new sample
    output logic signed [47:0] position,  // Q32.16 periods
    output logic overspeed  // strobe
);
    localparam int INPUTS = 8 + 8 + 1 + 16 + 16 + 17 + 17 + 1 + 1 + 8 + 18 + 1 + 1 + 32 + 1 + 2 * W;

    logic [INPUTS-1:0] held;
    wire [7:0] outlier_step_q, outlier_hold_q, point_q;
    wire load_q, enable_q, write_q, swap_q, shift_q;
    wire converted, sampled, corrected, phase_valid, harmonics_off, stepped;
    wire signed [15:0] sin_offset_q, cos_offset_q, corrected_sin, corrected_cos;
    wire [16:0] gain_q;
    wire signed [16:0] quadrature_error_q, step;
    wire signed [17:0] value_q;
    wire signed [31:0] shift_periods_q;
    wire signed [W-1:0] raw_sin, raw_cos, limited_sin, limited_cos;
    wire [15:0] plain_phase, phase, tracked_phase, amplitude;
    wire rejected;

    assign {outlier_step_q, outlier_hold_q, load_q, sin_offset_q, cos_offset_q, gain_q,
            quadrature_error_q, enable_q, write_q, point_q, value_q, swap_q, shift_q,
            shift_periods_q, converted, raw_sin, raw_cos} = held;
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
            shift,
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
        .sin_offset      (sin_offset_q),
        .cos_offset      (cos_offset_q),
        .gain            (gain_q),
        .quadrature_error(quadrature_error_q),
        .valid           (sampled),
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
        .enable   (enable_q),
        .write    (write_q),
        .point    (point_q),
        .value    (value_q),
        .swap     (swap_q),
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
    unwrap u_position (
        .clk,
        .rst,
        .valid        (stepped),
        .step,
        .phase        (tracked_phase),
        .shift        (shift_q),
        .shift_periods(shift_periods_q),
        .done,
        .position
    );

    wire unused = &{1'b0, rejected, amplitude};
endmodule

`default_nettype wire
