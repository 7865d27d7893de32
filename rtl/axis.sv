// SPDX-License-Identifier: Apache-2.0
// axis -- one machine axis from the pins of its grating to the pins of its motor, behind two blocks
// of registers.
//
// latency  see the rooms; converter word to position 22 clk, 23 with a segment table, position to
//          command within one servo tick
// rate     one sample per `sample_tick`, one command per `tick`
// source   S0: interferometer with sine, cosine and comparator outputs, limit switches, DC motor;
//          S2, S3: A/B/Z scales, stepper, linear motor
// model    the models of its blocks; proved in motion by tb/system
`default_nettype none

module axis #(
    parameter int CLK_HZ   = 4_000_000,  // clk frequency
    parameter int W        = 8,          // bits of a sample
    parameter int DRIVES   = 15,         // see actuator
    parameter int FILTERS  = 2,          // of the servo, see biquad_cascade
    parameter int SEGMENTS = 0,          // most segments of the scale's table, see grating
    parameter int SINE     = 1           // see grating
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         tick,              // strobe: servo tick
    input  wire  [23:0] tick_period,       // clk
    input  wire         sample_tick,       // strobe: start a conversion
    input  wire         start,             // strobe: play the queued segments, with other axes
    input  wire         sync,              // strobe: a moment of all nodes of the line, captured
    input  wire         estop,             // level: 1 pressed
    input  wire         watchdog_expired,  // level: the line is silent
    input  wire         cpu_stopped,       // level: the soft core has stopped or hangs
    input  wire         select,            // register bus, this axis
    input  wire         write,
    input  wire  [ 5:0] word,              // 32-bit word of the block
    input  wire  [31:0] wdata,
    output logic [31:0] rdata,
    input  wire         feedback_select,   // register bus, its grating
    output logic [31:0] feedback_rdata,
    input  wire         actuator_select,   // register bus, its actuator
    output logic [31:0] actuator_rdata,
    input  wire  [31:0] now,               // clk
    input  wire         encoder_a,         // pins from here on
    input  wire         encoder_b,
    input  wire         encoder_z,         // index
    input  wire  [ 1:0] probe,
    input  wire         adc_sin,           // serial data, synchronous to adc_sclk
    input  wire         adc_cos,
    input  wire         limit_low_open,    // 1: pressed or wire cut
    input  wire         limit_high_open,
    input  wire         drive_fault_n,
    output logic        adc_cs_n,
    output logic        adc_sclk,
    output logic        bridge_a,
    output logic        bridge_b,
    output logic        step,
    output logic        direction,
    output logic        dac_cs_n,
    output logic        dac_sclk,
    output logic        dac_sdi,
    output logic        drive_enable,
    output logic        compare_pulse
);
    localparam int LIMIT_CLK = CLK_HZ / 10_000;  // a limit switch must be stable for 0.1 ms

    // settings and strobes from the registers
    wire control_enable, control_closed_loop, control_homing, control_fine;
    wire               strobes_reset_faults, strobes_set_target_to_position, strobes_start, strobes_controlled_stop, strobes_arm;
    wire        [31:0] following_limit, segment_jerk, stop_deceleration, stop_jerk, feed_override_slope, feed_override_curve, start_at;
    wire [16:0] feed_override_fraction;
    wire               feed_override_pause, kp_written, kd_written, kv_written, ka_written, filter_coefficient_written;
    wire        [ 3:0] filters_in_use;
    wire        [ 4:0] filters_address;
    wire signed [31:0] filter_coefficient;
    wire signed [31:0] shift_origin;
    wire shift_origin_written, segment_ticks_written, segment_last;
    wire [15:0] deglitch, amplitude_low, amplitude_high, dead_band;
    wire [7:0] outlier_step, outlier_hold;
    wire [19:0] disagreement_limit;
    wire [ 5:0] encoder_fault_mask;
    wire [23:0] kp, ki, kd, kv, ka, segment_ticks;
    wire [14:0] output_limit, integral_limit;
    wire signed [15:0] open_command;
    wire signed [63:0] segment_velocity, segment_acceleration;

    // pins
    wire        pin_a, pin_b, pin_z, pin_low, pin_high, pin_fault_n, limit_low, limit_high, low_rejected, high_rejected;
    wire [1:0] pin_probe;

    synchroniser #(
        .W(8)
    ) u_pins (
        .clk,
        .rst,
        .d({
            probe, drive_fault_n, limit_high_open, limit_low_open, encoder_z, encoder_b, encoder_a
        }),
        .q({pin_probe, pin_fault_n, pin_high, pin_low, pin_z, pin_b, pin_a})
    );
    deglitcher u_low (
        .clk,
        .rst,
        .stable_cycles(16'(LIMIT_CLK)),
        .level        (pin_low),
        .filtered     (limit_low),
        .rejected     (low_rejected)
    );
    deglitcher u_high (
        .clk,
        .rst,
        .stable_cycles(16'(LIMIT_CLK)),
        .level        (pin_high),
        .filtered     (limit_high),
        .rejected     (high_rejected)
    );

    // measuring path
    wire signed [W-1:0] sin, cos;
    wire sample_rejected, signal_fault, position_valid, zero_up, zero_down;
    wire [2:0] edge_rejected;
    wire [15:0] phase, amplitude;
    wire signed [31:0] quadrature_count, velocity;
    wire        [ 5:0] encoder_events;  // in the order of axis_registers
    wire signed [47:0] position;
    // shift_origin, or the segment table coming into force
    wire               moved;
    wire signed [47:0] moved_by;
    wire               upward;

    feedback_channel #(
        .W       (W),
        .SINE    (SINE),
        .SEGMENTS(SEGMENTS)
    ) u_feedback (
        .clk,
        .rst,
        .tick,
        .sample_tick,
        .sync,
        .now,
        .own_step     (step),
        .own_direction(upward),
        .select       (feedback_select),
        .write,
        .word,
        .wdata,
        .rdata        (feedback_rdata),
        .deglitch,
        .outlier_step,
        .outlier_hold,
        .amplitude_low,
        .amplitude_high,
        .disagreement_limit,
        .shift        (shift_origin_written),
        .shift_periods(shift_origin),
        .a            (pin_a),
        .b            (pin_b),
        .z            (pin_z),
        .probe        (pin_probe),
        .adc_sin,
        .adc_cos,
        .adc_cs_n,
        .adc_sclk,
        .compare_pulse,
        .sin,
        .cos,
        .sample_rejected,
        .edge_rejected,
        .phase,
        .amplitude,
        .quadrature_count,
        .events       (encoder_events),
        .signal_fault,
        .position_valid,
        .position,
        .moved,
        .moved_by,
        .velocity
    );
    zero_crossing u_zero (
        .clk,
        .rst,
        .valid(position_valid),
        .position,
        .shift(moved),
        .up   (zero_up),
        .down (zero_down)
    );

    // control
    wire signed [47:0] target;
    wire signed [31:0] target_velocity, target_acceleration, error;
    wire moving, armed, underrun, commanded, saturated, block_up, block_down;
    wire        [ 4:0] queue_free;
    wire signed [15:0] servo_command;

    profile_player u_profile (
        .clk,
        .rst,
        .stop_deceleration,
        .stop_jerk,
        .slope                 (feed_override_slope),
        .curve                 (feed_override_curve),
        .feed_fraction         (feed_override_fraction),
        .pause                 (feed_override_pause),
        .tick,
        .push                  (segment_ticks_written),
        .segment_velocity,
        .segment_acceleration,
        .segment_jerk,
        .segment_ticks,
        .segment_last,
        .start                 (strobes_start || start),
        .arm                   (strobes_arm),
        .start_at,
        .now,
        .controlled_stop       (strobes_controlled_stop),
        .set_target_to_position(strobes_set_target_to_position),
        .position,
        .shift                 (moved),
        .shift_by              (moved_by),
        .target,
        .target_velocity,
        .target_acceleration,
        .moving,
        .armed,
        .queue_free,
        .underrun
    );
    pid_servo #(
        .BIQUADS(FILTERS)
    ) u_servo (
        .clk,
        .rst,
        .closed_loop        (control_closed_loop),
        .kp,
        .ki,
        .kd,
        .kv,
        .ka,
        .output_limit,
        .integral_limit,
        .dead_band,
        .gains_changed      (kp_written || kd_written || kv_written || ka_written),
        .filters_in_use,
        .coefficient_write  (filter_coefficient_written),
        .coefficient_address(filters_address),
        .coefficient        (filter_coefficient),
        .tick,
        .target,
        .target_velocity,
        .target_acceleration,
        .moving,
        .position,
        .velocity,
        .open_command,
        .block_up,
        .block_down,
        .valid              (commanded),
        .command            (servo_command),
        .error,
        .saturated
    );

    // guard
    wire passed, step_overrun, fine_saturated;
    wire signed [15:0] command;
    wire [9:0] faults, causes_now, first_fault;
    wire signed [47:0] fault_position;

    drive_interlock u_interlock (
        .clk,
        .rst,
        .enable_request  (control_enable),
        .closed_loop     (control_closed_loop || control_fine),
        .homing          (control_homing),
        .reset_faults    (strobes_reset_faults),
        .limit_low,
        .limit_high,
        .estop,
        .drive_fault     (!pin_fault_n),
        .encoder_fault   (signal_fault || |(encoder_events & encoder_fault_mask)),
        .following_limit,
        .error,
        .error_valid     (commanded),
        .watchdog_expired,
        .cpu_trap        (cpu_stopped),
        .profile_underrun(underrun),
        .step_overrun,
        .position,
        .valid_in        (commanded),
        .command_in      (servo_command),
        .valid_out       (passed),
        .command_out     (command),
        .enabled         (drive_enable),
        .faults,
        .causes_now,
        .first_fault,
        .fault_position,
        .block_up,
        .block_down
    );

    // drive
    actuator #(
        .DRIVES(DRIVES)
    ) u_actuator (
        .clk,
        .rst,
        .tick,
        .tick_period,
        .select(actuator_select),
        .write,
        .word,
        .wdata,
        .rdata (actuator_rdata),
        .enable(drive_enable),
        .fine  (control_fine),
        .rebase(strobes_set_target_to_position || moved),
        .block_up,
        .block_down,
        .valid (passed),
        .command,
        .target,
        .target_velocity,
        .moving,
        .position,
        .bridge_a,
        .bridge_b,
        .step,
        .direction,
        .upward,
        .dac_cs_n,
        .dac_sclk,
        .dac_sdi,
        .fine_saturated,
        .step_overrun
    );

    // registers
    axis_registers #(
        .SINE(SINE)
    ) u_registers (
        .clk,
        .rst,
        .select,
        .write,
        .word,
        .wdata,
        .rdata,
        .control_enable,
        .control_closed_loop,
        .control_homing,
        .control_fine,
        .strobes_reset_faults,
        .strobes_set_target_to_position,
        .strobes_start,
        .strobes_controlled_stop,
        .strobes_arm,
        .state_enabled                 (drive_enable),
        .state_limit_low               (limit_low),
        .state_limit_high              (limit_high),
        .state_estop                   (estop),
        .state_drive_fault             (!pin_fault_n),
        .state_moving                  (moving),
        .state_saturated               (saturated),
        .state_queue_free              (queue_free),
        .state_armed                   (armed),
        .state_fine_saturated          (fine_saturated),
        .faults_limit_low              (faults[0]),
        .faults_limit_high             (faults[1]),
        .faults_estop                  (faults[2]),
        .faults_following_error        (faults[3]),
        .faults_encoder                (faults[4]),
        .faults_bus_watchdog           (faults[5]),
        .faults_drive                  (faults[6]),
        .faults_cpu                    (faults[7]),
        .faults_profile_underrun       (faults[8]),
        .faults_step_overrun           (faults[9]),
        .causes_now,
        .first_fault,
        .fault_position,
        .following_limit,
        .position,
        .target,
        .velocity,
        .shift_origin,
        .shift_origin_written,
        .zero_crossing_up              (zero_up),
        .zero_crossing_down            (zero_down),
        .sensing_deglitch              (deglitch),
        .sensing_outlier_step          (outlier_step),
        .sensing_outlier_hold          (outlier_hold),
        .amplitude_window_low          (amplitude_low),
        .amplitude_window_high         (amplitude_high),
        .disagreement_limit,
        .sample_sin                    (16'(sin)),
        .sample_cos                    (16'(cos)),
        .phase_phase                   (phase),
        .phase_amplitude               (amplitude),
        .quadrature_count,
        .encoder_events_illegal_edge   (encoder_events[0]),
        .encoder_events_overspeed      (encoder_events[1]),
        .encoder_events_amplitude_low  (encoder_events[2]),
        .encoder_events_amplitude_high (encoder_events[3]),
        .encoder_events_disagreement   (encoder_events[4]),
        .encoder_events_pulse_too_short(encoder_events[5]),
        .encoder_fault_mask,
        .rejected_pulses               (|edge_rejected),
        .rejected_samples              (sample_rejected),
        .kp,
        .kp_written,
        .ki,
        .kd,
        .kd_written,
        .kv,
        .kv_written,
        .ka,
        .ka_written,
        .servo_limits_output           (output_limit),
        .servo_limits_integral         (integral_limit),
        .dead_band,
        .following_error               (error),
        .command,
        .open_command,
        .filters_in_use,
        .filters_address,
        .filter_coefficient,
        .filter_coefficient_written,
        .segment_velocity,
        .segment_acceleration,
        .segment_jerk,
        .segment_ticks,
        .segment_ticks_written,
        .segment_ticks_last            (segment_last),
        .stop_deceleration,
        .stop_jerk,
        .feed_override_fraction,
        .feed_override_pause,
        .feed_override_slope,
        .feed_override_curve,
        .start_at
    );

    wire unused = &{1'b0, low_rejected, high_rejected};
endmodule

`default_nettype wire
