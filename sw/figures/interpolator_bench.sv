// SPDX-License-Identifier: Apache-2.0
// interpolator_bench -- test bench: ADC word to corrected position, through the interpolation chain
// of one axis, as in feedback_channel.sv.
//
// Every input is registered first, so that the chain begins at a register, as in the node.
`default_nettype none

module interpolator_bench #(
    parameter int W = 8  // bits of a sample
) (
    input  wire                 clk,
    input  wire                 rst,              // level: the chain starts again
    input  wire         [ 31:0] setting,          // value of a register, a cycle before its strobe
    input  wire         [  7:0] setting_written,  // strobes, as in interpolation_chain
    input  wire                 harmonic_enable,  // level: correct the harmonics
    input  wire signed  [ 31:0] shift_periods,    // periods
    input  wire                 valid,            // strobe: sin and cos are a new ADC word
    input  wire signed  [W-1:0] sin,              // counts, full scale = 2^(W-1)
    input  wire signed  [W-1:0] cos,              // counts, full scale = 2^(W-1)
    output logic                done,             // strobe: position belongs to a new sample
    output logic signed [ 47:0] position,         // Q32.16 periods
    output logic                overspeed         // strobe: the speed is too high
);
    localparam int INPUTS = 32 + 8 + 1 + 32 + 1 + 2 * W;

    logic [INPUTS-1:0] held;
    wire  [      31:0] setting_q;
    wire  [       7:0] setting_written_q;
    wire harmonic_enable_q, converted, sampled, rejected, phase_valid, stepped;
    wire disagreement, overrun, lost;
    wire signed [31:0] shift_periods_q;
    wire signed [W-1:0] raw_sin, raw_cos, sampled_sin, sampled_cos;
    wire [15:0] plain_phase, phase;
    wire signed [16:0] step;

    assign {
        setting_q, setting_written_q, harmonic_enable_q, shift_periods_q, converted, raw_sin,
        raw_cos
    } = held;
    always_ff @(posedge clk) begin
        held <= {setting, setting_written, harmonic_enable, shift_periods, valid, sin, cos};
        if (rst) held <= '0;
    end

    interpolation_chain #(
        .AXES(1),
        .W   (W)
    ) u_chain (
        .clk,
        .rst,
        .setting        (setting_q),
        .setting_written(setting_written_q),
        .harmonic_enable(harmonic_enable_q),
        .learn          (1'b1),
        .valid          (converted),
        .sin            (raw_sin),
        .cos            (raw_cos),
        .count          (32'd0),
        .sampled,
        .sampled_sin,
        .sampled_cos,
        .rejected,
        .phase_valid,
        .plain_phase,
        .done           (stepped),
        .step,
        .phase,
        .overspeed,
        .disagreement,
        .overrun,
        .lost
    );
    unwrap u_position (
        .clk,
        .rst,
        .valid        (stepped),
        .step,
        .phase,
        .shift_periods(shift_periods_q),
        .done,
        .position
    );

    wire unused_samples = &{1'b0, sampled, sampled_sin, sampled_cos, rejected};
    wire unused = &{1'b0, phase_valid, plain_phase, disagreement, overrun, lost};
endmodule

`default_nettype wire
