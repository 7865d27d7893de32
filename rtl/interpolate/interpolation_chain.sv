// SPDX-License-Identifier: Apache-2.0
// interpolation_chain -- from samples of sine and cosine to steps of the position: outlier filter,
// correction, arctan, harmonic correction, tracking and count check, for several axes.
//
// latency  21 cycles from valid to done for one axis. With several axes 22 cycles for the axis that
//          is served first, 1 cycle more for each axis with a lower number whose sample waits, too;
//          4 cycles less without harmonics
// rate     one sample per cycle, of all axes together
// behaviour  All axes share the arithmetic. State and settings of each axis are in LUT RAM, its
//          harmonic tables in block RAM. The samples of each axis must be AXES cycles apart, or one
//          may be lost, which overrun reports; see sample_arbiter. A setting is one word with the
//          bits of its register, and acts on the samples that are served after it.
// source   the chain of S0, once for a node
// model    tb/interpolate/interpolation_chain.py, equal in every bit of every cycle
`default_nettype none

module interpolation_chain #(
    parameter  int AXES          = 4,                            // axes that are served, 1 to 16
    parameter  int W             = 8,                            // bits of a sample, 8 to 16
    parameter  int HAS_HARMONICS = 1,                            // 1: build harmonic correction
    // bits of the number of an axis
    localparam int A             = AXES == 1 ? 1 : $clog2(AXES)
) (
    input wire clk,
    input wire rst,
    // settings, as in the registers
    input wire [A-1:0] setting_axis,  // number of the axis that is set
    input wire [31:0] setting,  // value
    input wire outlier_written,  // strobe: {hold, step}, 8 bits each
    input wire limit_written,  // strobe: limit of the count check
    input wire offset_written,  // strobe: {cos, sin}, 16 bits each
    input wire gain_written,  // strobe: gain of the sine
    input wire quadrature_error_written,  // strobe: quadrature error
    input wire load_correction,  // strobe: use the last three
    input wire harmonic_point_written,  // strobe: {point, value}
    input wire swap_harmonics,  // strobe: use the new points
    // bit n: axis n
    input wire [AXES-1:0] harmonic_enable,  // levels: correct the harmonics
    input wire [AXES-1:0] learn,  // levels: learn the count again
    // samples and counts, bit n or the bits from W n or 32 n on: axis n
    input wire [AXES-1:0] valid,  // strobes: a new sample
    input wire [W*AXES-1:0] sin,  // counts; held until the next one
    input wire [W*AXES-1:0] cos,  // counts; held until the next one
    input wire [32*AXES-1:0] count,  // 1/4 period, wraps
    // sample that is served
    output logic served,  // strobe: a sample is served
    output logic [A-1:0] served_axis,  // number of its axis
    output logic signed [W-1:0] served_sin,  // counts
    output logic signed [W-1:0] served_cos,  // counts
    // filtered sample
    output logic sampled,  // strobe: it is new
    output logic [A-1:0] sampled_axis,  // number of its axis
    output logic signed [W-1:0] sampled_sin,  // counts
    output logic signed [W-1:0] sampled_cos,  // counts
    output logic rejected,  // strobe: an outlier was held back
    // phase before the harmonic correction
    output logic phase_valid,  // strobe: it is new
    output logic [A-1:0] phase_axis,  // number of its axis
    output logic [15:0] plain_phase,  // 2^-16 period
    // step of the position
    output logic done,  // strobe: step leads to phase
    output logic [A-1:0] done_axis,  // number of its axis
    output logic signed [16:0] step,  // 2^-16 period
    output logic [15:0] phase,  // 2^-16 period, corrected
    output logic overspeed,  // strobe, with done: too fast
    // faults, bit n: axis n
    output logic [AXES-1:0] disagreement,  // levels: position against count
    output logic [AXES-1:0] overrun  // strobes: a sample was lost
);
    localparam int CORRECTED = 3;  // cycles from sampled to corrected
    localparam int FOUND = 12;  // from there to phase_valid
    localparam int STRAIGHT = HAS_HARMONICS != 0 ? 4 : 0;  // from there to straight
    localparam int CYCLES = CORRECTED + FOUND + STRAIGHT + 1;  // from sampled to done

    logic [A*CYCLES-1:0] axes;  // of the samples in progress, the youngest at the right
    logic [AXES-1:0] outlier_known, limit_known;  // written since reset
    wire [7:0] outlier_step, outlier_hold;
    wire load_values, corrected, straight;
    wire [A-1:0] load_axis;
    wire signed [15:0] sin_offset, cos_offset, corrected_sin, corrected_cos;
    wire        [16:0] gain;
    wire signed [16:0] quadrature_error;
    wire [15:0] amplitude, straight_phase;
    wire        [A-1:0] straight_axis;
    wire        [ 19:0] limit;
    wire signed [ 17:0] harmonic_value = $signed(setting[17:0]);
    wire signed [ 31:0] done_count = $signed(count[32*done_axis+:32]);

    if (AXES == 1) begin : g_one
        assign {served, served_axis, overrun} = {valid, 1'b0, 1'b0};
        assign {served_sin, served_cos} = {sin, cos};
    end else begin : g_many
        sample_arbiter #(
            .AXES(AXES),
            .W   (W)
        ) u_arbiter (
            .clk,
            .rst,
            // samples
            .valid,
            .sin,
            .cos,
            // sample that is served
            .done   (served),
            .axis   (served_axis),
            .sin_out(served_sin),
            .cos_out(served_cos),
            .overrun
        );
    end

    // settings
    axis_memory #(
        .AXES (AXES),
        .WIDTH(16)
    ) u_outlier_settings (
        .clk,
        .write     (outlier_written),
        .write_axis(setting_axis),
        .value     (setting[15:0]),
        .axis      (served_axis),
        .stored    ({outlier_hold, outlier_step})
    );
    axis_memory #(
        .AXES (AXES),
        .WIDTH(20)
    ) u_limit (
        .clk,
        .write     (limit_written),
        .write_axis(setting_axis),
        .value     (setting[19:0]),
        .axis      (done_axis),
        .stored    (limit)
    );
    correction_settings #(
        .AXES(AXES)
    ) u_correction_settings (
        .clk,
        .rst,
        // settings
        .setting_axis,
        .setting,
        .offset_written,
        .gain_written,
        .quadrature_error_written,
        .load    (load_correction),
        // values that are loaded
        .load_out(load_values),
        .axis    (load_axis),
        .sin_offset,
        .cos_offset,
        .gain,
        .quadrature_error
    );

    outlier_filter #(
        .W   (W),
        .AXES(AXES)
    ) u_outliers (
        .clk,
        .rst,
        // settings
        .step   (outlier_known[served_axis] ? outlier_step : 8'd0),
        .hold   (outlier_hold),
        // sample
        .valid  (served),
        .axis   (served_axis),
        .sin    (served_sin),
        .cos    (served_cos),
        // filtered sample
        .done   (sampled),
        .sin_out(sampled_sin),
        .cos_out(sampled_cos),
        .rejected
    );
    signal_correction #(
        .W   (W),
        .AXES(AXES)
    ) u_correction (
        .clk,
        .rst,
        // settings
        .load   (load_values),
        .load_axis,
        .sin_offset,
        .cos_offset,
        .gain,
        .quadrature_error,
        // sample
        .valid  (sampled),
        .axis   (sampled_axis),
        .sin    (sampled_sin),
        .cos    (sampled_cos),
        // corrected sample
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
        // corrected sample
        .valid(corrected),
        .sin  (corrected_sin),
        .cos  (corrected_cos),
        // phase
        .done (phase_valid),
        .phase(plain_phase),
        .amplitude
    );
    if (HAS_HARMONICS != 0) begin : g_harmonics
        harmonic_correction #(
            .AXES(AXES)
        ) u_harmonics (
            .clk,
            .rst,
            // tables
            .enable    (harmonic_enable),
            .table_axis(setting_axis),
            .write     (harmonic_point_written),
            .point     (setting[25:18]),
            .value     (harmonic_value),
            .swap      (swap_harmonics),
            // phase
            .valid     (phase_valid),
            .axis      (phase_axis),
            .phase     (plain_phase),
            // corrected phase
            .done      (straight),
            .phase_out (straight_phase)
        );
    end else begin : g_no_harmonics
        assign {straight, straight_phase} = {phase_valid, plain_phase};
        wire unused = &{1'b0, harmonic_enable, harmonic_point_written, swap_harmonics};
    end
    fringe_tracker #(
        .AXES(AXES)
    ) u_tracker (
        .clk,
        .rst,
        // phase
        .valid    (straight),
        .axis     (straight_axis),
        .phase    (straight_phase),
        // step
        .done,
        .step,
        .phase_out(phase),
        .overspeed
    );
    count_phase_check #(
        .AXES(AXES)
    ) u_count_phase_check (
        .clk,
        .rst,
        .learn,
        // both positions
        .valid(done),
        .axis (done_axis),
        .step,
        .count(done_count),
        .limit(limit_known[done_axis] ? limit : 20'd0),
        .disagreement
    );

    assign phase_axis    = axes[A*(CORRECTED+FOUND-1)+:A];
    assign straight_axis = axes[A*(CYCLES-2)+:A];
    assign done_axis     = axes[A*(CYCLES-1)+:A];

    always_ff @(posedge clk) begin
        sampled_axis <= served_axis;
        axes         <= {axes[A*(CYCLES-1)-1:0], sampled_axis};
        if (outlier_written) outlier_known[setting_axis] <= 1'b1;
        if (limit_written) limit_known[setting_axis] <= 1'b1;
        if (rst) begin
            outlier_known <= '0;
            limit_known   <= '0;
        end
    end

    wire unused = &{1'b0, amplitude};
endmodule

`default_nettype wire
