// SPDX-License-Identifier: Apache-2.0
// actuator_registers -- the register block of actuator: bridge, stepper driver or DAC, and the fine
// stage.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, not to be edited
`default_nettype none

module actuator_registers #(
    parameter int HAS_BRIDGE     = 1,  // 0: settings that need it read 0
    parameter int HAS_DAC        = 1,  // 0: settings that need it read 0
    parameter int HAS_FINE_STAGE = 1,  // 0: settings that need it read 0
    parameter int HAS_STEPPER    = 1   // 0: settings that need it read 0
) (
    input  wire                clk,
    input  wire                rst,                        // settings take their first values
    input  wire                select,                     // strobe: access to this block
    input  wire                write,                      // level: it writes wdata
    input  wire         [ 5:0] word,                       // index of the word
    input  wire         [31:0] wdata,                      // value to write
    output logic        [31:0] rdata,                      // live bits read; else 0
    // kind of drive: 0 bridge, 1 stepper, 2 DAC
    output logic        [ 1:0] drive,
    output logic        [15:0] pwm_period,                 // PWM period of the bridge [cycle]
    // shortest times of a step pulse: high [cycle]
    output logic        [13:0] step_pulse_high,
    // shortest times of a step pulse: low [cycle]
    output logic        [13:0] step_pulse_low,
    // shortest times of the direction before and after a step pulse: setup [cycle]
    output logic        [13:0] step_direction_setup,
    // shortest times of the direction before and after a step pulse: hold [cycle]
    output logic        [13:0] step_direction_hold,
    // 0 step and direction, 1 quadrature, 2 pulses up and pulses down
    output logic        [ 1:0] step_output_mode,
    output logic               step_output_step_low,       // 1: step is active low
    output logic               step_output_direction_low,  // 1: direction is low going up
    input  wire signed  [31:0] steps,                      // steps sent since reset [step]
    // half a period of its clock; 0 acts as 1 [cycle]
    output logic        [ 7:0] dac_half_period,
    // time after which the last word is sent again [cycle]
    output logic        [15:0] dac_refresh,
    output logic signed [15:0] dac_trim,                   // offset added to each word
    // proportional gain of the fine stage [1/65536 command/(period/65536)]
    output logic        [23:0] fine_kp,
    output logic               fine_kp_written,            // strobe: new value
    // integral gain of the fine stage, each tick [1/16777216 command/(period/65536)]
    output logic        [23:0] fine_ki,
    output logic        [14:0] fine_limit,                 // largest |command| of the fine stage
    input  wire signed  [15:0] fine_command,               // command of the fine stage
    // derivative gain of the fine stage [1/65536 command/(period/65536/tick)]
    output logic        [23:0] fine_kd
);
    logic get_steps;
    logic get_fine_command;

    wire  get = select && !write;
    wire  put = select && write;

    // no register of this block has these bits
    wire  unused = &{1'b0, wdata[31:28]};

    // words read in the cycle before
    assign rdata = ({32{get_steps}} & steps) | ({32{get_fine_command}} & {16'd0, fine_command}) |
        {{16{(get_fine_command && fine_command[15])}}, 16'd0};

    always_ff @(posedge clk) begin
        get_steps <= get && word == 6'h08;
        get_fine_command <= get && word == 6'h0F;

        if (put && word == 6'h00) drive <= wdata[1:0];
        if (HAS_BRIDGE != 0 && put && word == 6'h01) pwm_period <= wdata[15:0];
        if (HAS_STEPPER != 0 && put && word == 6'h02) step_pulse_high <= wdata[13:0];
        if (HAS_STEPPER != 0 && put && word == 6'h02) step_pulse_low <= wdata[27:14];
        if (HAS_STEPPER != 0 && put && word == 6'h03) step_direction_setup <= wdata[13:0];
        if (HAS_STEPPER != 0 && put && word == 6'h03) step_direction_hold <= wdata[27:14];
        if (HAS_STEPPER != 0 && put && word == 6'h04) step_output_mode <= wdata[1:0];
        if (HAS_STEPPER != 0 && put && word == 6'h04) step_output_step_low <= wdata[2];
        if (HAS_STEPPER != 0 && put && word == 6'h04) step_output_direction_low <= wdata[3];
        if (HAS_DAC != 0 && put && word == 6'h09) dac_half_period <= wdata[7:0];
        if (HAS_DAC != 0 && put && word == 6'h09) dac_refresh <= wdata[23:8];
        if (HAS_DAC != 0 && put && word == 6'h0A) dac_trim <= wdata[15:0];
        fine_kp_written <= put && word == 6'h0C;
        if (HAS_FINE_STAGE != 0 && put && word == 6'h0C) fine_kp <= wdata[23:0];
        if (HAS_FINE_STAGE != 0 && put && word == 6'h0D) fine_ki <= wdata[23:0];
        if (HAS_FINE_STAGE != 0 && put && word == 6'h0E) fine_limit <= wdata[14:0];
        if (HAS_FINE_STAGE != 0 && put && word == 6'h10) fine_kd <= wdata[23:0];

        if (rst) begin
            get_steps <= 1'b0;
            get_fine_command <= 1'b0;
            drive <= 2'h0;
            pwm_period <= 16'h0000;
            step_pulse_high <= HAS_STEPPER == 0 ? '0 : 14'h0001;
            step_pulse_low <= HAS_STEPPER == 0 ? '0 : 14'h0001;
            step_direction_setup <= HAS_STEPPER == 0 ? '0 : 14'h0001;
            step_direction_hold <= HAS_STEPPER == 0 ? '0 : 14'h0001;
            step_output_mode <= 2'h0;
            step_output_step_low <= 1'b0;
            step_output_direction_low <= 1'b0;
            dac_half_period <= HAS_DAC == 0 ? '0 : 8'h01;
            dac_refresh <= HAS_DAC == 0 ? '0 : 16'hFFFF;
            dac_trim <= 16'h0000;
            fine_kp_written <= 1'b0;
            fine_kp <= 24'h000000;
            fine_ki <= 24'h000000;
            fine_limit <= 15'h0000;
            fine_kd <= 24'h000000;
        end
    end
endmodule

`default_nettype wire
