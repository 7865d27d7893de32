// SPDX-License-Identifier: Apache-2.0
// axis -- one machine axis from the pins of its scale to the pins of its motor, behind three
// register blocks.
//
// latency  22 cycles from an ADC word to position, 23 with a segment table; from position to
//          command within one servo tick
// rate     one sample per `sample_tick`, one command per `tick`
// source   S0: interferometer with sine, cosine and comparator outputs, limit switches, DC motor;
//          S2, S3: A/B/Z scales, stepper, linear motor
// model    the models of its blocks; proved in motion by tb/system
`default_nettype none

module axis #(
    parameter int CLK_HZ         = 4_000_000,  // Hz, clk frequency
    parameter int W              = 8,          // bits of a sample
    parameter int FILTERS        = 2,          // biquads of the servo, 0 to 4
    parameter int SEGMENTS       = 0,          // most segments of the scale's table; 0: no table
    parameter int HAS_SINE       = 1,          // 0: no sine and cosine, positions of counts only
    parameter int HAS_BRIDGE     = 1,          // 1: build the bridge
    parameter int HAS_STEPPER    = 1,          // 1: build the step generator
    parameter int HAS_DAC        = 1,          // 1: build the DAC
    parameter int HAS_FINE_STAGE = 1           // 1: build the fine stage, which needs the DAC
) (
    input  wire         clk,
    input  wire         rst,
    // register bus
    input  wire         select,            // strobe: an access to the axis
    input  wire         feedback_select,   // strobe: an access to its feedback channel
    input  wire         actuator_select,   // strobe: an access to its actuator
    input  wire         write,             // level: the access writes
    input  wire  [ 5:0] word,              // 32-bit word of the block
    input  wire  [31:0] wdata,             // value to write
    input  wire  [31:0] wdata_low,         // low word of a value of 64 bits
    output logic [31:0] rdata,             // live bits read, in the next cycle; else 0
    output logic [31:0] feedback_rdata,    // live bits read, in the next cycle; else 0
    output logic [31:0] actuator_rdata,    // live bits read, in the next cycle; else 0
    // time
    input  wire         tick,              // strobe: servo tick
    input  wire  [23:0] tick_period,       // cycles
    input  wire         sample_tick,       // strobe: take a sample
    input  wire  [31:0] now,               // cycles, time stamp
    // node
    input  wire         start,             // strobe: play the queued segments, with other axes
    input  wire         sync,              // strobe: the sync pulse of the bus captures
    input  wire         estop,             // level: 1 pressed
    input  wire         watchdog_expired,  // level: the master of the bus is silent
    input  wire         cpu_stopped,       // level: the soft core has stopped or hangs
    // pins of the scale
    input  wire         encoder_a,         // pin
    input  wire         encoder_b,         // pin
    input  wire         encoder_z,         // pin, index
    input  wire  [ 1:0] probe,             // pins of the touch probes
    input  wire         adc_sin,           // pin, serial data, synchronous to adc_sclk
    input  wire         adc_cos,           // pin, serial data, synchronous to adc_sclk
    output logic        adc_cs_n,          // pin, low during a conversion
    output logic        adc_sclk,          // pin, idles high
    output logic        compare_pulse,     // pin, high during a compare pulse
    // pins of the machine
    input  wire         limit_low_open,    // pin, 1: pressed or wire cut
    input  wire         limit_high_open,   // pin, 1: pressed or wire cut
    input  wire         drive_fault_n,     // pin, 0: the drive reports a fault
    // pins of the drive
    output logic        bridge_a,          // pin, alone high for a positive command
    output logic        bridge_b,          // pin, alone high for a negative command
    output logic        step,              // pin, as step_output_mode says
    output logic        direction,         // pin, as step_output_mode says
    output logic        dac_cs_n,          // pin, low during a word
    output logic        dac_sclk,          // pin, idles low
    output logic        dac_sdi,           // pin, data of the DAC
    output logic        drive_enable       // pin, 1: the drive may be on
);
    // requests
    wire control_enable, control_closed_loop, control_homing, control_fine;
    wire strobes_reset_faults, strobes_set_target_to_position, strobes_start;
    wire strobes_controlled_stop, strobes_arm;
    wire check_following, play, rebase, gains_changed;
    // settings of the feedback channel
    wire [15:0] deglitch, amplitude_low, amplitude_high;
    wire [7:0] outlier_step, outlier_hold;
    wire        [19:0] disagreement_limit;
    wire        [ 5:0] encoder_fault_mask;
    wire signed [31:0] shift_origin;
    wire               shift_origin_written;
    // settings of the profile
    wire signed [63:0] segment_velocity, segment_acceleration;
    wire signed [31:0] segment_jerk;
    wire        [23:0] segment_ticks;
    wire segment_ticks_written, segment_last;
    wire [31:0] stop_deceleration, stop_jerk, start_at;
    wire [31:0] feed_override_slope, feed_override_curve;
    wire [16:0] feed_override_fraction;
    wire        feed_override_pause;
    // settings of the servo
    wire [23:0] kp, ki, kd, kv, ka;
    wire kp_written, kd_written, kv_written, ka_written;
    wire [14:0] output_limit, integral_limit;
    wire        [15:0] dead_band;
    wire signed [15:0] open_command;
    wire        [ 3:0] filters_in_use;
    wire        [ 4:0] filters_address;
    wire signed [31:0] filter_coefficient;
    wire               filter_coefficient_written;

    // levels of the pins
    wire a, b, z, limit_low, limit_high, drive_fault;
    wire [1:0] probe_level;
    // measuring path
    wire signed [W-1:0] sin, cos;
    wire [15:0] phase, amplitude;
    wire signed [31:0] quadrature_count, velocity;
    wire [5:0] encoder_events;
    wire signed [47:0] position, moved_by;
    wire sample_rejected, pulse_rejected, encoder_fault, position_valid, moved, zero_up, zero_down;
    // target and command
    wire signed [47:0] target;
    wire signed [31:0] target_velocity, target_acceleration, error;
    wire signed [15:0] servo_command, command;
    wire [4:0] queue_free;
    wire moving, armed, underrun, commanded, saturated, passed;
    // interlock and drive
    wire [31:0] following_limit;
    wire [9:0] faults, causes_now, first_fault;
    wire signed [47:0] fault_position;
    wire block_up, block_down, downward, fine_saturated, step_overrun;

    axis_inputs #(
        .CLK_HZ(CLK_HZ)
    ) u_inputs (
        .clk,
        .rst,
        // pins
        .encoder_a,
        .encoder_b,
        .encoder_z,
        .probe,
        .limit_low_open,
        .limit_high_open,
        .drive_fault_n,
        // levels
        .a,
        .b,
        .z,
        .probe_level,
        .limit_low,
        .limit_high,
        .drive_fault
    );
    axis_requests u_requests (
        // levels
        .closed_loop           (control_closed_loop),
        .fine                  (control_fine),
        // strobes
        .start                 (strobes_start),
        .common_start          (start),
        .set_target_to_position(strobes_set_target_to_position),
        .moved,
        .kp_written,
        .kd_written,
        .kv_written,
        .ka_written,
        // joined
        .check_following,
        .play,
        .rebase,
        .gains_changed
    );

    feedback_channel #(
        .W       (W),
        .HAS_SINE(HAS_SINE),
        .SEGMENTS(SEGMENTS)
    ) u_feedback (
        .clk,
        .rst,
        // register bus
        .select       (feedback_select),
        .write,
        .word,
        .wdata,
        .wdata_low,
        .rdata        (feedback_rdata),
        // time
        .tick,
        .sample_tick,
        .sync,
        .now,
        // settings
        .deglitch,
        .outlier_step,
        .outlier_hold,
        .amplitude_low,
        .amplitude_high,
        .disagreement_limit,
        .encoder_fault_mask,
        .shift        (shift_origin_written),
        .shift_periods(shift_origin),
        // pins
        .a,
        .b,
        .z,
        .probe        (probe_level),
        .adc_sin,
        .adc_cos,
        .adc_cs_n,
        .adc_sclk,
        .compare_pulse,
        // own steps
        .own_step     (step),
        .own_downward (downward),
        // signals
        .sin,
        .cos,
        .phase,
        .amplitude,
        .quadrature_count,
        // events
        .sample_rejected,
        .pulse_rejected,
        .events       (encoder_events),
        .encoder_fault,
        // position
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

    profile_player u_profile (
        .clk,
        .rst,
        // settings
        .stop_deceleration,
        .stop_jerk,
        .slope                 (feed_override_slope),
        .curve                 (feed_override_curve),
        .feed_fraction         (feed_override_fraction),
        .pause                 (feed_override_pause),
        // segments
        .tick,
        .push                  (segment_ticks_written),
        .segment_velocity,
        .segment_acceleration,
        .segment_jerk,
        .segment_ticks,
        .segment_last,
        // requests
        .start                 (play),
        .arm                   (strobes_arm),
        .start_at,
        .now,
        .controlled_stop       (strobes_controlled_stop),
        .set_target_to_position(strobes_set_target_to_position),
        // position
        .position,
        .shift                 (moved),
        .shift_by              (moved_by),
        // target
        .target,
        .target_velocity,
        .target_acceleration,
        // state
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
        // settings
        .closed_loop        (control_closed_loop),
        .kp,
        .ki,
        .kd,
        .kv,
        .ka,
        .output_limit,
        .integral_limit,
        .dead_band,
        .gains_changed,
        // filters
        .filters_in_use,
        .coefficient_write  (filter_coefficient_written),
        .coefficient_address(filters_address),
        .coefficient        (filter_coefficient),
        // target
        .tick,
        .target,
        .target_velocity,
        .target_acceleration,
        .moving,
        // position
        .position,
        .velocity,
        // command
        .open_command,
        .block_up,
        .block_down,
        .valid              (commanded),
        .command            (servo_command),
        .error,
        .saturated
    );

    drive_interlock u_interlock (
        .clk,
        .rst,
        // requests
        .enable_request  (control_enable),
        .closed_loop     (check_following),
        .homing          (control_homing),
        .reset_faults    (strobes_reset_faults),
        // causes
        .limit_low,
        .limit_high,
        .estop,
        .drive_fault,
        .encoder_fault,
        .following_limit,
        .error,
        .error_valid     (commanded),
        .watchdog_expired,
        .cpu_trap        (cpu_stopped),
        .profile_underrun(underrun),
        .step_overrun,
        // command
        .position,
        .valid_in        (commanded),
        .command_in      (servo_command),
        .valid_out       (passed),
        .command_out     (command),
        // permission
        .enabled         (drive_enable),
        .block_up,
        .block_down,
        // faults
        .faults,
        .causes_now,
        .first_fault,
        .fault_position
    );

    actuator #(
        .HAS_BRIDGE    (HAS_BRIDGE),
        .HAS_STEPPER   (HAS_STEPPER),
        .HAS_DAC       (HAS_DAC),
        .HAS_FINE_STAGE(HAS_FINE_STAGE)
    ) u_actuator (
        .clk,
        .rst,
        // register bus
        .select(actuator_select),
        .write,
        .word,
        .wdata,
        .wdata_low,
        .rdata (actuator_rdata),
        // time
        .tick,
        .tick_period,
        // permission
        .enable(drive_enable),
        .fine  (control_fine),
        .rebase,
        .block_up,
        .block_down,
        // motion
        .valid (passed),
        .command,
        .target,
        .target_velocity,
        .moving,
        .position,
        // pins
        .bridge_a,
        .bridge_b,
        .step,
        .direction,
        .dac_cs_n,
        .dac_sclk,
        .dac_sdi,
        // state
        .downward,
        .fine_saturated,
        .step_overrun
    );

    axis_registers #(
        .HAS_SINE(HAS_SINE)
    ) u_registers (
        .clk,
        .rst,
        // register bus
        .select,
        .write,
        .word,
        .wdata,
        .wdata_low,
        .rdata,
        // requests
        .control_enable,
        .control_closed_loop,
        .control_homing,
        .control_fine,
        .strobes_reset_faults,
        .strobes_set_target_to_position,
        .strobes_start,
        .strobes_controlled_stop,
        .strobes_arm,
        // state
        .state_enabled        (drive_enable),
        .state_limit_low      (limit_low),
        .state_limit_high     (limit_high),
        .state_estop          (estop),
        .state_drive_fault    (drive_fault),
        .state_moving         (moving),
        .state_saturated      (saturated),
        .state_queue_free     (queue_free),
        .state_armed          (armed),
        .state_fine_saturated (fine_saturated),
        // interlock
        .faults,
        .causes_now,
        .first_fault,
        .fault_position,
        .following_limit,
        // position
        .position,
        .target,
        .velocity,
        .shift_origin,
        .shift_origin_written,
        .zero_crossing_up     (zero_up),
        .zero_crossing_down   (zero_down),
        // settings of the feedback channel
        .sensing_deglitch     (deglitch),
        .sensing_outlier_step (outlier_step),
        .sensing_outlier_hold (outlier_hold),
        .amplitude_window_low (amplitude_low),
        .amplitude_window_high(amplitude_high),
        .disagreement_limit,
        // signals
        .sample_sin           (16'(sin)),
        .sample_cos           (16'(cos)),
        .phase_phase          (phase),
        .phase_amplitude      (amplitude),
        .quadrature_count,
        .encoder_events,
        .encoder_fault_mask,
        .rejected_pulses      (pulse_rejected),
        .rejected_samples     (sample_rejected),
        // servo
        .kp,
        .kp_written,
        .ki,
        .kd,
        .kd_written,
        .kv,
        .kv_written,
        .ka,
        .ka_written,
        .servo_limits_output  (output_limit),
        .servo_limits_integral(integral_limit),
        .dead_band,
        .following_error      (error),
        .command,
        .open_command,
        .filters_in_use,
        .filters_address,
        .filter_coefficient,
        .filter_coefficient_written,
        // profile
        .segment_velocity,
        .segment_acceleration,
        .segment_jerk,
        .segment_ticks,
        .segment_ticks_written,
        .segment_ticks_last   (segment_last),
        .stop_deceleration,
        .stop_jerk,
        .feed_override_fraction,
        .feed_override_pause,
        .feed_override_slope,
        .feed_override_curve,
        .start_at
    );
endmodule

`default_nettype wire
