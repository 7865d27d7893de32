// SPDX-License-Identifier: Apache-2.0
// signal_correction -- remove offset, gain and phase error from a sine and a cosine sample: an
// ellipse becomes a circle.
//
// latency  3 cycles from valid to done
// rate     one sample per cycle
// behaviour Both outputs have half the size of the inputs, so a corrected channel may be larger
//          than full scale; what is still too large saturates. With AXES above 1 it serves several
//          axes, each with settings of its own. Settings act on the samples after load.
// source   Heydemann, Appl. Opt. 20 (1981) 3382: cos' = cos - cos_offset, sin' = gain (sin -
//          sin_offset) + quadrature_error cos'
// model    tb/interpolate/signal_correction.py, equal in every bit of every cycle
`default_nettype none

module signal_correction #(
    parameter  int W    = 8,                            // bits of a sample, 8 to 16
    parameter  int AXES = 1,                            // axes that are served
    // bits of the number of an axis
    localparam int A    = AXES == 1 ? 1 : $clog2(AXES)
) (
    input  wire                 clk,
    input  wire                 rst,               // level: nothing is corrected until load
    input  wire                 load,              // strobe: use the settings from now on
    input  wire         [A-1:0] load_axis,         // number of the axis for which; 0 for one axis
    input  wire signed  [ 15:0] sin_offset,        // full scale = 2^15
    input  wire signed  [ 15:0] cos_offset,        // full scale = 2^15
    input  wire         [ 16:0] gain,              // factor, 1.0 = 2^16
    input  wire signed  [ 16:0] quadrature_error,  // factor, 1.0 = 2^16
    input  wire                 valid,             // strobe: sin and cos are a new sample
    input  wire         [A-1:0] axis,              // number of its axis; 0 for one axis
    input  wire signed  [W-1:0] sin,               // counts, full scale = 2^(W-1)
    input  wire signed  [W-1:0] cos,               // counts, full scale = 2^(W-1)
    output logic                done,              // strobe: sin_out and cos_out are new
    output logic signed [ 15:0] sin_out,           // full scale of sin = 2^14
    output logic signed [ 15:0] cos_out            // full scale of cos = 2^14
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    logic centred, multiplied;  // strobes
    // settings of the axis
    wire signed [15:0] sin_zero, cos_zero;
    wire        [16:0] sin_gain;
    wire signed [16:0] cos_part_of_sin;
    logic signed [17:0] sin_factor, cos_factor;  // of the sample that is centred
    logic signed [16:0] sin_channel, cos_channel, cos_kept;  // full scale of sin = 2^15
    logic signed [34:0] sin_part, cos_part;

    wire signed [15:0] sin_wide = 16'(sin) <<< (16 - W);
    wire signed [15:0] cos_wide = 16'(cos) <<< (16 - W);
    wire signed [35:0] sum = 36'(sin_part) + 36'(cos_part);
    // The rounding has an adder of its own: one sum of three numbers would take more cells.
    wire signed [19:0] sin_whole = 20'(sum >>> 16);
    wire signed [18:0] sin_half = 19'((sin_whole + 20'sd1) >>> 1);
    wire signed [16:0] cos_half = 17'((18'(cos_kept) + 18'sd1) >>> 1);
    wire               sin_fits = sin_half[18:15] == {4{sin_half[18]}};
    wire               cos_fits = cos_half[16] == cos_half[15];

    axis_setting #(
        .AXES   (AXES),
        .WIDTH  (66),
        .INITIAL({16'd0, 16'd0, 17'd65536, 17'd0})
    ) u_settings (
        .clk,
        .rst,
        .write     (load),
        .write_axis(load_axis),
        .value     ({sin_offset, cos_offset, gain, quadrature_error}),
        .axis,
        .stored    ({sin_zero, cos_zero, sin_gain, cos_part_of_sin})
    );

    always_ff @(posedge clk) begin
        centred    <= valid;
        multiplied <= centred;
        done       <= multiplied;
        if (valid) begin
            sin_channel <= 17'(sin_wide) - 17'(sin_zero);
            cos_channel <= 17'(cos_wide) - 17'(cos_zero);
            sin_factor  <= $signed({1'b0, sin_gain});
            cos_factor  <= 18'(cos_part_of_sin);
        end
        if (centred) begin
            sin_part <= sin_channel * sin_factor;
            cos_part <= cos_channel * cos_factor;
            cos_kept <= cos_channel;
        end
        if (multiplied) begin
            sin_out <= sin_fits ? sin_half[15:0] : {sin_half[18], {15{!sin_half[18]}}};
            cos_out <= cos_fits ? cos_half[15:0] : {cos_half[16], {15{!cos_half[16]}}};
        end
        if (rst) begin
            centred    <= 1'b0;
            multiplied <= 1'b0;
            done       <= 1'b0;
            sin_out    <= '0;
            cos_out    <= '0;
        end
    end
endmodule

`default_nettype wire
