// SPDX-License-Identifier: Apache-2.0
// correction_settings -- hold the four values of the signal correction of each axis until they are
// loaded together.
//
// latency  1 cycle from load to load_out and the values; a value must be written a cycle before
// rate     one write or load per cycle
// behaviour  After reset an axis has the offsets 0, the gain 1 and the quadrature error 0.
// model    tb/interpolate/correction_settings.py, equal in every bit of every cycle
`default_nettype none

module correction_settings #(
    parameter  int AXES = 8,                            // axes that are served, 1 to 16
    // bits of the number of an axis
    localparam int A    = AXES == 1 ? 1 : $clog2(AXES)
) (
    input wire clk,
    input wire rst,  // level: the values of all axes are reset
    // settings
    input wire [A-1:0] setting_axis,  // number of the axis that is set
    input wire [31:0] setting,  // value, as in the registers
    input wire offset_written,  // strobe: it has both offsets
    input wire gain_written,  // strobe: it is the gain
    input wire quadrature_error_written,  // strobe: it is the quadrature error
    input wire load,  // strobe: load the values of the axis
    // values that are loaded
    output logic load_out,  // strobe: the values below are new
    output logic [A-1:0] axis,  // number of their axis
    output logic signed [15:0] sin_offset,  // full scale = 2^15
    output logic signed [15:0] cos_offset,  // full scale = 2^15
    output logic [16:0] gain,  // factor, 1.0 = 2^16
    output logic signed [16:0] quadrature_error  // factor, 1.0 = 2^16
);
    wire [31:0] offset_stored;
    wire [16:0] gain_stored, quadrature_error_stored;

    axis_setting #(
        .AXES (AXES),
        .WIDTH(32)
    ) u_offset (
        .clk,
        .rst,
        .write     (offset_written),
        .write_axis(setting_axis),
        .value     (setting),
        .axis      (setting_axis),
        .stored    (offset_stored)
    );
    axis_setting #(
        .AXES   (AXES),
        .WIDTH  (17),
        .INITIAL(17'd65536)
    ) u_gain (
        .clk,
        .rst,
        .write     (gain_written),
        .write_axis(setting_axis),
        .value     (setting[16:0]),
        .axis      (setting_axis),
        .stored    (gain_stored)
    );
    axis_setting #(
        .AXES (AXES),
        .WIDTH(17)
    ) u_quadrature_error (
        .clk,
        .rst,
        .write     (quadrature_error_written),
        .write_axis(setting_axis),
        .value     (setting[16:0]),
        .axis      (setting_axis),
        .stored    (quadrature_error_stored)
    );

    always_ff @(posedge clk) begin
        load_out                 <= load;
        axis                     <= setting_axis;
        {cos_offset, sin_offset} <= offset_stored;
        gain                     <= gain_stored;
        quadrature_error         <= $signed(quadrature_error_stored);
        if (rst) load_out <= 1'b0;
    end
endmodule

`default_nettype wire
