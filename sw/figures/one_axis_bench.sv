// SPDX-License-Identifier: Apache-2.0
// one_axis_bench -- one axis with its motion engine, its register memory and an interpolation chain
// that it shares with a converter of any speed, as in node.sv; the top of
// sw/figures/interlock_run.cpp.
`default_nettype none

module one_axis_bench (
    input wire clk,
    input wire rst,
    // register bus
    input wire select,  // strobe: an access, while ready is high
    input wire write,  // level: the access writes
    input wire [15:0] address,  // byte address in the register map, from 1 cycle before select on
    input wire [31:0] wdata,  // value to write, from 1 cycle before select on
    output logic [31:0] rdata,  // live bits read, in the next cycle
    output logic ready,  // level: an access may come
    // time
    input wire tick,  // strobe: servo tick
    input wire [23:0] tick_period,  // cycles
    input wire sample_tick,  // strobe: take a sample
    input wire limit_tick,  // strobe: an eighth of the time of a limit switch
    input wire [31:0] now,  // cycles
    // node
    input wire estop,  // level: 1 pressed
    input wire watchdog_expired,  // level: the master of the bus is silent
    input wire link_expired,  // level: no good packet over the link in time
    input wire cpu_stopped,  // level: the soft core has stopped or hangs
    input wire other_sample,  // strobe: a sample of the other converter
    output logic sample_valid,  // strobe: a sample of the axis
    // pins
    input wire encoder_a,  // pin
    input wire encoder_b,  // pin
    input wire limit_low_open,  // pin, 1: pressed or wire cut
    input wire limit_high_open,  // pin, 1: pressed or wire cut
    input wire drive_fault_n,  // pin, 0: the drive reports a fault
    output logic bridge_a,  // pin
    output logic bridge_b,  // pin
    output logic step,  // pin
    output logic direction,  // pin
    output logic drive_enable,  // pin, 1: the drive may be on
    output logic [47:0] target,  // 2^-16 period, of the engine
    output logic [15:0] cycles,  // cycles that a tick needs at most
    output logic [15:0] most_steps  // steps still to be made that stop the step generator
);
    wire memory_ready, stores, hold, waits;
    wire [13:0] stored_at;
    wire [31:0] stored_value, wdata_low, settings, live, feedback_rdata, actuator_rdata;
    wire [2:0] result_axis, result_kind;
    wire pending, moves, moved, request_waits, overrun;
    wire [31:0] tick_count, stream_state, stream_counts;
    wire unused_stream = &{1'b0, tick_count};
    wire step_made, step_down, block_up, block_down, closed_loop, play, arm, controlled_stop;
    wire hold_target, result_valid, integral_valid, result_flag;
    wire [47:0] position, moved_by, result;
    wire [23:0] take_up;
    wire line_start, line_idle, rate_valid, rate_restart, rate_steep, line_stopped;
    wire signed [36:0] rate;
    wire        [ 7:0] chain_setting_written;
    wire chain_harmonic_enable, chain_learn;
    wire signed [7:0] sample_sin, sample_cos, chain_sin, chain_cos;
    // the axis is number 1 of the chain, which serves the other converter first
    wire [1:0] chain_sampled, chain_rejected, chain_phase_valid, chain_done, chain_overspeed;
    wire [1:0] chain_disagreement, chain_lost;
    wire [15:0] phase, fine_command;
    wire [12:0] faults;
    wire [15:0] chain_plain_phase, chain_phase;
    wire signed [16:0] chain_step;
    wire               sample_overrun;
    wire signed [31:0] quadrature_count;
    wire compare_pulse, adc_cs_n, adc_sclk, dac_cs_n, dac_sclk, dac_sdi;

    assign ready  = memory_ready && !waits;
    assign most_steps = 16'(1 << (u_axis.g_drive.u_actuator.g_stepper.u_steps.AHEAD_W - 2));
    assign rdata = live | feedback_rdata | actuator_rdata;

    register_memory u_memory (
        .clk,
        .rst,
        .hold,
        .select,
        .write,
        .address(address[15:2]),
        .wdata,
        .ready  (memory_ready),
        .rdata  (settings),
        .wdata_low,
        .stores,
        .stored_at,
        .stored_value
    );
    motion #(
        .FILTERS(2)
    ) u_motion (
        .clk,
        .rst,
        .tick,
        .tick_period  (tick_period[17:0]),
        .now,
        .stores,
        .stored_at,
        .stored_value,
        .wdata_low,
        .hold,
        .waits,
        .position,
        .step_made,
        .step_down,
        .moves,
        .moved,
        .moved_by,
        .take_up,
        .block_up,
        .block_down,
        .closed_loop,
        .enabled      (drive_enable),
        .tick_count,
        .stream_states(stream_state),
        .stream_counts,
        .play,
        .arm,
        .controlled_stop,
        .hold_target,
        .request_waits,
        .pending,
        .result_valid,
        .integral_valid,
        .result_axis,
        .result_kind,
        .result,
        .result_flag,
        .servo_overrun(overrun),
        .cycles,
        .line_start,
        .line_idle,
        .rate_valid,
        .rate,
        .rate_restart,
        .rate_steep,
        .line_stopped
    );
    interpolation_chain #(
        .AXES(2)
    ) u_chain (
        .clk,
        .rst,
        .setting        (wdata),
        .setting_written({chain_setting_written, 8'd0}),
        .harmonic_enable({chain_harmonic_enable, 1'b0}),
        .learn          ({chain_learn, 1'b0}),
        .valid          ({sample_valid, other_sample}),
        .sin            ({sample_sin, 8'd0}),
        .cos            ({sample_cos, 8'd100}),
        .count          ({quadrature_count, 32'd0}),
        .sampled        (chain_sampled),
        .sampled_sin    (chain_sin),
        .sampled_cos    (chain_cos),
        .rejected       (chain_rejected),
        .phase_valid    (chain_phase_valid),
        .plain_phase    (chain_plain_phase),
        .done           (chain_done),
        .step           (chain_step),
        .phase          (chain_phase),
        .overspeed      (chain_overspeed),
        .disagreement   (chain_disagreement),
        .overrun        (sample_overrun),
        .lost           (chain_lost)
    );
    axis #(
        .HAS_OWN_CHAIN(0)
    ) u_axis (
        .clk,
        .rst,
        .select            (select && address[15:8] == 8'h04),
        .feedback_select   (select && address[15:8] == 8'h0C),
        .actuator_select   (select && address[15:8] == 8'h14),
        .write,
        .word              (address[7:2]),
        .wdata,
        .wdata_low,
        .rdata             (live),
        .feedback_rdata,
        .actuator_rdata,
        .tick,
        .sample_tick,
        .limit_tick,
        .now,
        .start             (1'b0),
        .servo_overrun     (overrun),
        .sample_overrun,
        .sync              (1'b0),
        .estop,
        .watchdog_expired,
        .link_expired,
        .cpu_stopped,
        .position,
        .step_made,
        .step_down,
        .moves,
        .moved,
        .moved_by,
        .take_up,
        .block_up,
        .block_down,
        .closed_loop,
        .play,
        .arm,
        .controlled_stop,
        .hold_target,
        .waits             (request_waits),
        .pending,
        .result_valid,
        .result_kind,
        .result,
        .result_flag,
        .line_start,
        .line_idle,
        .rate_valid,
        .rate,
        .rate_restart,
        .rate_steep,
        .line_stopped,
        .stream_state,
        .stream_counts,
        .chain_setting_written,
        .chain_harmonic_enable,
        .chain_learn,
        .sample_valid,
        .sample_sin,
        .sample_cos,
        .quadrature_count,
        .chain_sampled     (chain_sampled[1]),
        .chain_sin,
        .chain_cos,
        .chain_rejected    (chain_rejected[1]),
        .chain_phase_valid (chain_phase_valid[1]),
        .chain_plain_phase,
        .chain_done        (chain_done[1]),
        .chain_step,
        .chain_phase,
        .chain_overspeed   (chain_overspeed[1]),
        .chain_disagreement(chain_disagreement[1]),
        .chain_lost        (chain_lost[1]),
        .target,
        .phase,
        .fine_command,
        .faults,
        .encoder_a,
        .encoder_b,
        .encoder_z         (1'b0),
        .probe             (2'b00),
        .adc_sin           (1'b0),
        .adc_cos           (1'b0),
        .adc_cs_n,
        .adc_sclk,
        .compare_pulse,
        .limit_low_open,
        .limit_high_open,
        .drive_fault_n,
        .bridge_a,
        .bridge_b,
        .step,
        .direction,
        .dac_cs_n,
        .dac_sclk,
        .dac_sdi,
        .drive_enable
    );

    wire chain = &{
        1'b0, chain_sampled[0], chain_rejected[0], chain_phase_valid[0], chain_done[0],
        chain_overspeed[0], chain_disagreement[0], chain_lost[0]
    };
    wire unused = &{
        1'b0, chain, address[1:0], tick_period[23:18], settings, result_axis, integral_valid, compare_pulse,
        adc_cs_n, adc_sclk, dac_cs_n, dac_sclk, dac_sdi, phase, fine_command, faults
    };
endmodule

`default_nettype wire
