// SPDX-License-Identifier: Apache-2.0
// drive_select -- route the command of an axis to the kind of drive that the registers select.
//
// latency  0 cycles, combinational
// rate     one command per cycle
// behaviour  Kind 0 is the bridge, 1 the stepper driver, 2 the DAC, and 3 selects no drive. While
//          the DAC is not the drive, it carries the command of the fine stage.
// model    tb/drive/drive_select.py, equal for all inputs
// proved   The bridge and the stepper driver are never selected together, the bridge never without
//          enable, and the DAC carries the main command exactly while it is the drive.
`default_nettype none

module drive_select (
    input  wire         [ 1:0] kind,              // 0 bridge, 1 stepper driver, 2 DAC, 3 none
    input  wire                enable,            // level: the interlock allows the drive
    input  wire                valid,             // strobe: command is new
    input  wire signed  [15:0] command,           // full scale 2^15
    input  wire                fine_valid,        // strobe: fine_command is new
    input  wire signed  [15:0] fine_command,      // full scale 2^15
    output logic               bridge_enable,     // level: the bridge may switch
    output logic               stepper_selected,  // level: the drive is a stepper driver
    output logic               dac_valid,         // strobe: dac_command is new
    output logic signed [15:0] dac_command        // full scale 2^15
);
    wire dac_selected = kind == 2'd2;

    assign bridge_enable    = enable && kind == 2'd0;
    assign stepper_selected = kind == 2'd1;
    assign dac_valid        = dac_selected ? valid : fine_valid;
    assign dac_command      = dac_selected ? command : fine_command;

`ifdef FORMAL
    always_comb begin
        assert (!(bridge_enable && stepper_selected));
        assert (!bridge_enable || enable);
        assert (kind == 2'd2 || (dac_valid == fine_valid && dac_command == fine_command));
        assert (kind != 2'd2 || (dac_valid == valid && dac_command == command));
        cover (bridge_enable);
        cover (stepper_selected);
        cover (kind == 2'd2 && dac_valid);
    end
`endif
endmodule

`default_nettype wire
