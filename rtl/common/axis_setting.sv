// SPDX-License-Identifier: Apache-2.0
// axis_setting -- store one setting for each axis of a node; an axis has the initial value until
// its setting is written.
//
// latency  0 cycles from axis to stored, combinational; 1 cycle from write to the new value
// rate     one read and one write per cycle
// behaviour  For one axis the setting is a register that is reset. For several it is in LUT RAM
//          (axis_memory), which cannot be reset, so one bit for each axis says if it was written.
// model    tb/common/axis_setting.py, equal in every bit of every cycle
`default_nettype none

module axis_setting #(
    parameter  int             AXES    = 8,                            // settings, 1 to 16
    parameter  int             WIDTH   = 8,                            // bits of a setting
    parameter      [WIDTH-1:0] INITIAL = '0,                           // value after reset
    // bits of the number of an axis
    localparam int             A       = AXES == 1 ? 1 : $clog2(AXES)
) (
    input  wire              clk,
    input  wire              rst,         // level: all settings have their initial value
    input  wire              write,       // strobe: store value
    input  wire  [    A-1:0] write_axis,  // number of the axis whose setting is written
    input  wire  [WIDTH-1:0] value,       // setting to write
    input  wire  [    A-1:0] axis,        // number of the axis whose setting is read
    output logic [WIDTH-1:0] stored       // its setting
);
    if (AXES == 1) begin : g_one
        logic [WIDTH-1:0] setting;

        always_ff @(posedge clk) begin
            if (write) setting <= value;
            if (rst) setting <= INITIAL;
        end
        assign stored = setting;

        wire unused = &{1'b0, write_axis, axis};
    end else begin : g_many
        logic [ AXES-1:0] known;  // written since reset
        wire  [WIDTH-1:0] word;

        axis_memory #(
            .AXES (AXES),
            .WIDTH(WIDTH)
        ) u_settings (
            .clk,
            .write,
            .write_axis,
            .value,
            .axis,
            .stored(word)
        );
        assign stored = known[axis] ? word : INITIAL;
        always_ff @(posedge clk) begin
            if (write) known[write_axis] <= 1'b1;
            if (rst) known <= '0;
        end
    end
endmodule

`default_nettype wire
