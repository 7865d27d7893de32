// SPDX-License-Identifier: Apache-2.0
// actuator -- drive the motor of an axis: turn its target and its command into the pins of a
// bridge, a stepper driver or a DAC, with a fine stage that uses the DAC.
//
// latency  see bridge_pwm, step_generator, spi_dac and fine_stage
// rate     one command per tick, a tick at least 134 cycles after the one before
// behaviour  The pins of a drive that is not built are idle.
// source   S0: DC motor by PWM, piezo on top; S2: stepper; S3: current amplifier behind a DAC of 16
//          bits
// model    the models of its blocks; tested together by tb/system
`default_nettype none

module actuator #(
    parameter int HAS_BRIDGE     = 1,  // 1: build the bridge
    parameter int HAS_STEPPER    = 1,  // 1: build the step generator
    parameter int HAS_DAC        = 1,  // 1: build the DAC
    parameter int HAS_FINE_STAGE = 1   // 1: build the fine stage, which needs the DAC
) (
    input  wire                clk,
    input  wire                rst,
    // register bus
    input  wire                select,          // strobe: an access to this actuator
    input  wire                write,           // level: the access writes
    input  wire         [ 5:0] word,            // 32-bit word of the block
    input  wire         [31:0] wdata,           // value to write
    output logic        [31:0] rdata,           // live bits read, in the next cycle; else 0
    // permission
    input  wire                enable,          // level: the interlock allows the drive
    input  wire                fine,            // level: the fine stage holds the position
    input  wire                block_up,        // level: the interlock blocks motion up
    input  wire                block_down,      // level: the interlock blocks motion down
    // motion
    input  wire                valid,           // strobe: command is new
    input  wire signed  [15:0] command,         // full scale 2^15
    input  wire signed  [47:0] target,          // 2^-16 period
    input  wire                line_up,         // level: the target of the line moved up
    input  wire                line_down,       // level: the target of the line moved down
    // lines of motor steps
    input  wire                line_start,      // strobe: the lines begin
    input  wire                line_idle,       // level: the lines have ended
    input  wire                rate_valid,      // strobe: the rate of the next line is new
    input  wire signed  [36:0] rate,            // 2^-36 motor step per cycle, with rate_valid
    input  wire                rate_restart,    // level: that line begins at a whole step
    input  wire                rate_steep,      // level: that line is too steep
    output logic               line_stopped,    // level: no line is followed until a restart
    input  wire                compared,        // strobe: target of this tick is known
    input  wire signed  [47:0] position,        // 2^-16 period
    // pins
    output logic               bridge_a,        // pin, alone high for a positive command
    output logic               bridge_b,        // pin, alone high for a negative command
    output logic               step,            // pin, as step_output_mode says
    output logic               direction,       // pin, as step_output_mode says
    output logic               dac_cs_n,        // pin, low during a word
    output logic               dac_sclk,        // pin, idles low
    output logic               dac_sdi,         // pin, data of the DAC
    // state
    output logic               own_step,        // level: a step is made
    output logic               own_downward,    // level: that step and the next go down
    output logic signed [15:0] fine_command,    // of the fine stage, full scale 2^15
    output logic               fine_saturated,  // level: the fine stage is at its limit
    output logic               step_overrun     // level: too many steps are overdue
);
    if (HAS_BRIDGE + HAS_STEPPER + HAS_DAC == 0) begin : g_check_drives
        AN_ACTUATOR_NEEDS_A_DRIVE u_error ();
    end
    if (HAS_FINE_STAGE != 0 && HAS_DAC == 0) begin : g_check_fine
        FINE_STAGE_NEEDS_THE_DAC u_error ();
    end

    // which drive
    wire [1:0] kind;
    wire bridge_enable, stepper_selected, dac_valid;
    wire signed [15:0] dac_command;
    // bridge
    wire        [15:0] pwm_period;
    // stepper
    wire        [ 1:0] mode;
    wire [13:0] high_cycles, low_cycles, setup_cycles, hold_cycles;
    wire step_low, direction_low;
    wire signed [31:0] steps;
    // DAC
    wire        [ 7:0] half_period;
    wire        [15:0] refresh;
    wire signed [15:0] dac_trim;
    // fine stage
    wire [23:0] fine_kp, fine_ki, fine_kd;
    wire [14:0] fine_limit;
    wire fine_kp_written, fine_valid;

    drive_select u_select (
        // permission
        .kind,
        .enable,
        // commands
        .valid,
        .command,
        .fine_valid,
        .fine_command,
        // bridge and DAC
        .bridge_enable,
        .dac_valid,
        .dac_command,
        // stepper
        .stepper_selected
    );

    if (HAS_BRIDGE != 0) begin : g_bridge
        bridge_pwm u_bridge (
            .clk,
            .rst,
            .period(pwm_period),
            .enable(bridge_enable),
            .valid,
            .command,
            .bridge_a,
            .bridge_b
        );
    end else begin : g_no_bridge
        assign {bridge_a, bridge_b} = 2'b00;
        wire unused = &{1'b0, pwm_period, bridge_enable};
    end

    if (HAS_STEPPER != 0) begin : g_stepper
        wire allowed, upward;

        assign own_downward = !upward;

        step_permission u_permission (
            .enable,
            .by_steps   (stepper_selected),
            .block_up,
            .block_down,
            .target_up  (line_up),
            .target_down(line_down),
            .allowed
        );
        step_generator u_steps (
            .clk,
            .rst,
            // settings
            .high_cycles,
            .low_cycles,
            .setup_cycles,
            .hold_cycles,
            .mode,
            .step_low,
            .direction_low,
            // lines
            .enable (allowed),
            .line_start,
            .line_idle,
            .rate_valid,
            .rate,
            .rate_restart,
            .rate_steep,
            .stopped(line_stopped),
            // pins and state
            .step,
            .direction,
            .pulse  (own_step),
            .upward,
            .steps,
            .overrun(step_overrun)
        );
    end else begin : g_no_stepper
        assign {step, direction, own_step, own_downward, step_overrun, steps} = '0;
        assign line_stopped = 1'b1;
        wire unused_motion = &{1'b0, block_up, block_down, line_up, line_down};
        wire unused_lines = &{
            1'b0, line_start, line_idle, rate_valid, rate, rate_restart, rate_steep
        };
        wire unused_times = &{1'b0, high_cycles, low_cycles, setup_cycles, hold_cycles};
        wire unused_settings = &{1'b0, mode, step_low, direction_low, stepper_selected};
    end

    if (HAS_FINE_STAGE != 0) begin : g_fine
        fine_stage u_fine (
            .clk,
            .rst,
            // permission
            .enable,
            .hold         (fine),
            // settings
            .kp           (fine_kp),
            .ki           (fine_ki),
            .kd           (fine_kd),
            .limit        (fine_limit),
            .gains_changed(fine_kp_written),
            // motion
            .tick         (compared),
            .target,
            .position,
            // command
            .valid        (fine_valid),
            .command      (fine_command),
            .saturated    (fine_saturated)
        );
    end else begin : g_no_fine
        assign {fine_valid, fine_command, fine_saturated} = '0;
        wire unused_settings = &{1'b0, fine, fine_limit};
        wire unused_gains = &{1'b0, fine_kp, fine_ki, fine_kd, fine_kp_written};
        wire unused_motion = &{1'b0, compared, target, position};
    end

    if (HAS_DAC != 0) begin : g_dac
        wire sent;

        spi_dac u_dac (
            .clk,
            .rst,
            // settings
            .half_period,
            .refresh,
            .trim   (dac_trim),
            // command
            .enable,
            .valid  (dac_valid),
            .command(dac_command),
            // pins
            .cs_n   (dac_cs_n),
            .sclk   (dac_sclk),
            .sdi    (dac_sdi),
            .sent
        );

        wire unused = &{1'b0, sent};
    end else begin : g_no_dac
        assign {dac_cs_n, dac_sclk, dac_sdi} = 3'b100;
        wire unused = &{1'b0, half_period, refresh, dac_trim, dac_valid, dac_command};
    end

    actuator_registers #(
        .HAS_BRIDGE    (HAS_BRIDGE),
        .HAS_STEPPER   (HAS_STEPPER),
        .HAS_DAC       (HAS_DAC),
        .HAS_FINE_STAGE(HAS_FINE_STAGE)
    ) u_registers (
        .clk,
        .rst,
        // register bus
        .select,
        .write,
        .word,
        .wdata,
        .rdata,
        // which drive
        .drive                    (kind),
        // bridge
        .pwm_period,
        // stepper
        .step_pulse_high          (high_cycles),
        .step_pulse_low           (low_cycles),
        .step_direction_setup     (setup_cycles),
        .step_direction_hold      (hold_cycles),
        .step_output_mode         (mode),
        .step_output_step_low     (step_low),
        .step_output_direction_low(direction_low),
        .steps,
        // DAC
        .dac_half_period          (half_period),
        .dac_refresh              (refresh),
        .dac_trim,
        // fine stage
        .fine_kp,
        .fine_kp_written,
        .fine_ki,
        .fine_limit,
        .fine_command,
        .fine_kd
    );
endmodule

`default_nettype wire
