// SPDX-License-Identifier: Apache-2.0
// interpolation_chain -- turn samples of sine and cosine into steps of the position: outlier
// filter, correction, arctan, harmonic correction, tracking and count check, for several axes.
//
// latency  21 cycles from valid to done for one axis. With several axes 22 cycles for the axis that
//          is served first, 1 cycle more for each axis with a lower number whose sample waits, too:
//          21 + AXES at most; 4 cycles less without harmonics
// rate     one sample per cycle, of all axes together; with one axis, one per SAMPLE_CYCLES
// behaviour  All axes share the arithmetic. State and settings of each axis are in LUT RAM, its
//          harmonic tables in block RAM. The samples of each axis must be SAMPLE_CYCLES apart, or
//          one may be lost; see sample_arbiter and, for one axis, arctan_quotient, which is built
//          small if they are 12 or more. SAMPLE_CYCLES of the converter below AXES stop the build.
//          overrun reports a loss at once, so that the fault of the interlock comes before
//          any event of the axis, and lost says in the next cycle whose sample it was. A setting
//          is the word of its register, and acts on the samples that are served after it.
// source   the chain of S0, once for a node
// model    tb/interpolate/interpolation_chain.py, equal in every bit of every cycle
`default_nettype none

module interpolation_chain #(
    parameter  int AXES          = 4,                            // axes that are served, 1 to 16
    parameter  int W             = 8,                            // bits of a sample, 8 to 16
    parameter  int HAS_HARMONICS = 1,                            // 1: build harmonic correction
    // fewest cycles from a sample of an axis to its next one, as the converter gives them
    parameter  int SAMPLE_CYCLES = AXES,
    // bits of the number of an axis
    localparam int A             = AXES == 1 ? 1 : $clog2(AXES)
) (
    input  wire                       clk,
    input  wire                       rst,
    // settings
    input  wire         [       31:0] setting,          // value of a register, before its strobe
    // strobes in the cycle after setting, of one axis at a time; bits from 8 n on: axis n
    // 0 outlier filter, 1 limit of the count check, 2 offsets, 3 gain, 4 quadrature error, 5 use
    // these three, 6 point of the harmonic table that is not in use, 7 use it
    input  wire         [ 8*AXES-1:0] setting_written,
    // bit n: axis n
    input  wire         [   AXES-1:0] harmonic_enable,  // levels: correct the harmonics
    input  wire         [   AXES-1:0] learn,            // levels: learn the count again
    // samples and counts, bit n or the bits from W n or 32 n on: axis n
    input  wire         [   AXES-1:0] valid,            // strobes: a new sample
    input  wire         [ W*AXES-1:0] sin,              // counts; held until the next sample
    input  wire         [ W*AXES-1:0] cos,              // counts; held until the next sample
    input  wire         [32*AXES-1:0] count,            // 1/4 period, wraps
    // filtered sample, bit n: of axis n
    output logic        [   AXES-1:0] sampled,          // strobes: it is new
    output logic signed [      W-1:0] sampled_sin,      // counts
    output logic signed [      W-1:0] sampled_cos,      // counts
    output logic        [   AXES-1:0] rejected,         // strobes: an outlier was held back
    // phase before the harmonic correction
    output logic        [   AXES-1:0] phase_valid,      // strobes: it is new
    output logic        [       15:0] plain_phase,      // 2^-16 period
    // step of the position
    output logic        [   AXES-1:0] done,             // strobes: step leads to phase
    output logic signed [       16:0] step,             // 2^-16 period
    output logic        [       15:0] phase,            // 2^-16 period, corrected
    output logic        [   AXES-1:0] overspeed,        // strobes, with done: too fast
    // faults
    output logic        [   AXES-1:0] disagreement,     // levels: position against count
    output logic                      overrun,          // strobe: a sample was lost
    output logic        [   AXES-1:0] lost              // strobes in the next cycle: whose it was
);
    if (SAMPLE_CYCLES < AXES) begin : g_check_samples
        SAMPLES_COME_TOO_FAST_FOR_THE_AXES u_error ();
    end

    localparam int CORRECTED = 3;  // cycles from sampled to corrected
    localparam int FOUND = 12;  // from there to phase_valid
    localparam int STRAIGHT = HAS_HARMONICS != 0 ? 4 : 0;  // from there to straight
    localparam int CYCLES = CORRECTED + FOUND + STRAIGHT + 1;  // from sampled to done

    // settings
    logic [ 31:0] value;
    logic [A-1:0] setting_axis;
    logic [  7:0] written;  // strobes of setting_axis
    wire [7:0] outlier_step, outlier_hold;
    wire [ 19:0] limit;
    wire         load_values;
    wire [A-1:0] load_axis;
    wire signed [15:0] sin_offset, cos_offset;
    wire [16:0] gain;
    wire signed [16:0] quadrature_error;
    wire signed [17:0] harmonic_value = $signed(value[17:0]);
    // samples in progress
    logic [A*CYCLES-1:0] axes;  // numbers of their axes from sampled on, the youngest at the right
    wire served, filtered, held_back, corrected, found, straight, tracked, too_fast;
    wire [AXES-1:0] overruns;  // of each axis
    wire [A-1:0] served_axis, found_axis, straight_axis, tracked_axis;
    logic [A-1:0] filtered_axis;
    wire signed [W-1:0] served_sin, served_cos;
    wire signed [15:0] corrected_sin, corrected_cos;
    wire        [15:0] straight_phase;
    wire signed [31:0] tracked_count = $signed(count[32*tracked_axis+:32]);

    if (AXES == 1) begin : g_one
        assign {served, served_axis, overruns} = {valid, 1'b0, 1'b0};
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
            .overrun(overruns)
        );
    end

    // settings
    axis_setting #(
        .AXES (AXES),
        .WIDTH(16)
    ) u_outlier_settings (
        .clk,
        .rst,
        .write     (written[0]),
        .write_axis(setting_axis),
        .value     (value[31:16]),
        .axis      (served_axis),
        .stored    ({outlier_hold, outlier_step})
    );
    axis_setting #(
        .AXES (AXES),
        .WIDTH(20)
    ) u_limit (
        .clk,
        .rst,
        .write     (written[1]),
        .write_axis(setting_axis),
        .value     (value[19:0]),
        .axis      (tracked_axis),
        .stored    (limit)
    );
    correction_settings #(
        .AXES(AXES)
    ) u_correction_settings (
        .clk,
        .rst,
        // settings
        .setting_axis,
        .setting                 (value),
        .offset_written          (written[2]),
        .gain_written            (written[3]),
        .quadrature_error_written(written[4]),
        .load                    (written[5]),
        // values that are loaded
        .load_out                (load_values),
        .axis                    (load_axis),
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
        .step    (outlier_step),
        .hold    (outlier_hold),
        // sample
        .valid   (served),
        .axis    (served_axis),
        .sin     (served_sin),
        .cos     (served_cos),
        // filtered sample
        .done    (filtered),
        .sin_out (sampled_sin),
        .cos_out (sampled_cos),
        .rejected(held_back)
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
        .valid  (filtered),
        .axis   (filtered_axis),
        .sin    (sampled_sin),
        .cos    (sampled_cos),
        // corrected sample
        .done   (corrected),
        .sin_out(corrected_sin),
        .cos_out(corrected_cos)
    );
    arctan_quotient #(
        .SAMPLE_CYCLES(AXES == 1 ? SAMPLE_CYCLES : 1)
    ) u_arctan (
        .clk,
        .rst,
        // corrected sample
        .valid(corrected),
        .sin  (corrected_sin),
        .cos  (corrected_cos),
        // phase
        .done (found),
        .phase(plain_phase)
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
            .write     (written[6]),
            .point     (value[25:18]),
            .value     (harmonic_value),
            .swap      (written[7]),
            // phase
            .valid     (found),
            .axis      (found_axis),
            .phase     (plain_phase),
            // corrected phase
            .done      (straight),
            .phase_out (straight_phase)
        );
    end else begin : g_no_harmonics
        assign {straight, straight_phase} = {found, plain_phase};
        wire unused = &{1'b0, harmonic_enable, written[7:6], harmonic_value};
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
        .done     (tracked),
        .step,
        .phase_out(phase),
        .overspeed(too_fast)
    );
    count_phase_check #(
        .AXES(AXES)
    ) u_count_phase_check (
        .clk,
        .rst,
        .learn,
        // both positions
        .valid(tracked),
        .axis (tracked_axis),
        .step,
        .count(tracked_count),
        .limit,
        .disagreement
    );

    assign found_axis    = axes[A*(CORRECTED+FOUND-1)+:A];
    assign straight_axis = axes[A*(CYCLES-2)+:A];
    assign tracked_axis  = axes[A*(CYCLES-1)+:A];
    assign sampled       = AXES'(filtered) << filtered_axis;
    assign rejected      = AXES'(held_back) << filtered_axis;
    assign phase_valid   = AXES'(found) << found_axis;
    assign done          = AXES'(tracked) << tracked_axis;
    assign overspeed     = AXES'(too_fast) << tracked_axis;
    assign overrun       = overruns != '0;

    always_comb begin
        written      = '0;
        setting_axis = '0;
        for (int n = 0; n < AXES; n++) begin
            written = written | setting_written[8*n+:8];
            if (setting_written[8*n+:8] != '0) setting_axis = setting_axis | A'(n);
        end
    end

    always_ff @(posedge clk) begin
        value         <= setting;
        filtered_axis <= served_axis;
        lost          <= overruns;
        axes          <= {axes[A*(CYCLES-1)-1:0], filtered_axis};
        if (rst) begin
            filtered_axis <= '0;
            lost          <= '0;
            axes          <= '0;
        end
    end
endmodule

`default_nettype wire
