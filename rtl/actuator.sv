// SPDX-License-Identifier: Apache-2.0
// actuator -- the driving path of an axis: from its target and its command to the pins of a bridge,
// a stepper driver or a converter, and a fine stage behind the converter.
//
// latency  see the room drive; the fine command 61 clk after tick
// rate     one command per `tick`, a tick at least 61 clk after the one before
// source   S0: DC motor by PWM, piezo on top; S2: stepper; S3: current amplifier behind a converter
//          of 16 bits
// model    the models of its blocks; proved in motion by tb/system
`default_nettype none

module actuator #(
    parameter int DRIVES = 15                   // what is built: bit 0 bridge, 1 steps, 2 converter, 3 fine stage behind it
) (
    input wire clk,
    input wire rst,
    input wire tick,  // strobe: servo tick
    input wire [23:0] tick_period,  // clk
    input wire select,  // register bus, this actuator
    input wire write,
    input wire [5:0] word,  // 32-bit word of the block
    input wire [31:0] wdata,
    output logic [31:0] rdata,
    input wire enable,  // level: the guard allows the drive
    input wire fine,  // level: the fine stage holds the position
    input wire rebase,  // strobe: target := position, or the origin moves
    input wire block_up,  // level: the guard lets nothing go up
    input wire block_down,
    input wire valid,  // strobe: command is new
    input wire signed [15:0] command,  // full scale 2^15
    input wire signed [47:0] target,  // 2^-16 period
    input wire signed [31:0] target_velocity,  // 2^-16 period/tick
    input wire moving,  // a profile is being played
    input wire signed [47:0] position,  // 2^-16 period
    output logic bridge_a,  // pins from here on; those that were not built are low
    output logic bridge_b,
    output logic step,
    output logic direction,
    output logic upward,  // level: direction, whatever its polarity
    output logic dac_cs_n,
    output logic dac_sclk,
    output logic dac_sdi,
    output logic fine_saturated,  // level: the command of the fine stage stands at its limit
    output logic step_overrun  // level: more steps are owed than may be
);
    if (DRIVES < 1 || DRIVES > 15) begin : g_check_drives
        DRIVES_MUST_BE_FROM_1_TO_15 u_error ();
    end
    if (DRIVES[3] && !DRIVES[2]) begin : g_check_fine
        FINE_STAGE_NEEDS_THE_DAC u_error ();
    end

    // settings from the registers
    wire [1:0] kind, mode;
    wire [15:0] pwm_period, refresh;
    wire [13:0] high_cycles, low_cycles, setup_cycles, hold_cycles;
    wire step_low, direction_low, fine_kp_written;
    wire        [ 3:0] trim_shift;
    wire signed [47:0] step_ratio;
    wire signed [31:0] steps;
    wire        [ 7:0] half_period;
    wire signed [15:0] dac_trim, fine_command;
    wire [23:0] fine_kp, fine_ki;
    wire [14:0] fine_limit;

    wire        by_bridge = kind == 2'd0, by_steps = kind == 2'd1, by_dac = kind == 2'd2;

    // bridge
    if (DRIVES[0]) begin : g_bridge
        bridge_pwm u_bridge (
            .clk,
            .rst,
            .period(pwm_period),
            .enable(enable && by_bridge),
            .valid,
            .command,
            .bridge_a,
            .bridge_b
        );
    end else begin : g_no_bridge
        assign {bridge_a, bridge_b} = 2'b00;
    end

    // steps
    if (DRIVES[1]) begin : g_steps
        wire go, restart, driven, allowed;
        wire signed [47:0] step_target;
        assign upward = direction ^ direction_low;

        step_permission u_permission (
            .enable,
            .by_steps,
            .block_up,
            .block_down,
            .target_velocity,
            .driven,
            .allowed
        );
        step_follower u_follower (
            .clk,
            .rst,
            .ratio   (step_ratio),
            .shift   (trim_shift),
            .enable  (driven),
            .rebase,
            .tick,
            .target,
            .trim    (command),
            .go,
            .restart,
            .position(step_target)
        );
        step_generator #(
            .PERIOD_W(18)
        ) u_steps (
            .clk,
            .rst,
            .period (tick_period[17:0]),
            .high_cycles,
            .low_cycles,
            .setup_cycles,
            .hold_cycles,
            .mode,
            .step_low,
            .direction_low,
            .enable (allowed),
            .load   (restart),
            .tick   (go),
            .target (step_target),
            .step,
            .direction,
            .steps,
            .overrun(step_overrun)
        );
    end else begin : g_no_steps
        assign {step, direction, upward, step_overrun, steps} = '0;
    end

    // fine stage: a PI loop on the same error; while it rests its command goes back to the middle,
    // slowly enough for the main loop
    // to follow, and the loop takes over from wherever it is
    wire fine_valid;

    if (DRIVES[3]) begin : g_fine
        localparam signed [15:0] RETURN = 16'sd16;  // of the command, in a tick

        wire signed [31:0] fine_error;
        wire fine_clipped;
        wire signed [15:0] limit = {1'b0, fine_limit};
        wire signed [15:0] nearer = fine_command > RETURN ? fine_command - RETURN :
                                    fine_command < -RETURN ? fine_command + RETURN : 16'sd0;

        pid_servo #(
            .TERMS  (2),
            .BIQUADS(0)
        ) u_fine (
            .clk,
            .rst,
            .closed_loop        (fine && enable),
            .kp                 (fine_kp),
            .ki                 (fine_ki),
            .kd                 (24'd0),
            .kv                 (24'd0),
            .ka                 (24'd0),
            .output_limit       (fine_limit),
            .integral_limit     (fine_limit),
            .dead_band          (16'd0),
            .gains_changed      (fine_kp_written),
            .filters_in_use     (4'd0),
            .coefficient_write  (1'b0),
            .coefficient_address(5'd0),
            .coefficient        (32'sd0),
            .tick,
            .target,
            .target_velocity    (32'sd0),
            .target_acceleration(32'sd0),
            .moving,
            .position,
            .velocity           (32'sd0),
            .open_command       (enable ? nearer : 16'sd0),
            .block_up           (!enable),
            .block_down         (!enable),
            .valid              (fine_valid),
            .command            (fine_command),
            .error              (fine_error),
            .saturated          (fine_clipped)
        );
        assign fine_saturated = fine && (fine_command == limit || fine_command == -limit);
        wire unused_fine = &{1'b0, fine_error, fine_clipped};
    end else begin : g_no_fine
        assign {fine_valid, fine_saturated, fine_command} = '0;
    end

    // converter: of the main command, or of the fine stage
    if (DRIVES[2]) begin : g_dac
        wire sent;

        spi_dac u_dac (
            .clk,
            .rst,
            .half_period,
            .refresh,
            .trim   (dac_trim),
            .enable,
            .valid  (by_dac ? valid : fine_valid),
            .command(by_dac ? command : fine_command),
            .cs_n   (dac_cs_n),
            .sclk   (dac_sclk),
            .sdi    (dac_sdi),
            .sent
        );
        wire unused_dac = &{1'b0, sent};
    end else begin : g_no_dac
        assign {dac_cs_n, dac_sclk, dac_sdi} = 3'b100;
    end

    // registers
    actuator_registers u_registers (
        .clk,
        .rst,
        .select,
        .write,
        .word,
        .wdata,
        .rdata,
        .drive_kind               (kind),
        .drive_built              (4'(DRIVES)),
        .pwm_period,
        .step_pulse_high          (high_cycles),
        .step_pulse_low           (low_cycles),
        .step_direction_setup     (setup_cycles),
        .step_direction_hold      (hold_cycles),
        .step_output_mode         (mode),
        .step_output_step_low     (step_low),
        .step_output_direction_low(direction_low),
        .step_output_trim         (trim_shift),
        .step_ratio,
        .steps,
        .dac_half_period          (half_period),
        .dac_refresh              (refresh),
        .dac_trim,
        .fine_kp,
        .fine_kp_written,
        .fine_ki,
        .fine_limit,
        .fine_command
    );

    wire unused = &{1'b0, tick_period, valid, high_cycles, low_cycles, setup_cycles, hold_cycles, mode, step_low, direction_low, trim_shift, step_ratio,
                    half_period, refresh, dac_trim, fine_kp, fine_kp_written, fine_ki, fine_limit, pwm_period, block_up, block_down, rebase,
                    fine, moving, position, target, target_velocity, tick, by_bridge, by_steps, by_dac, fine_valid, fine_command};
endmodule

`default_nettype wire
