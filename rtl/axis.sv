// SPDX-License-Identifier: Apache-2.0
// axis -- control one machine axis, from the pins of its scale to the pins of its motor, behind
// three register blocks.
//
// latency  22 cycles from an ADC word to position, 23 with a segment table; with a shared chain see
//          feedback_channel; see motion_engine for the time from a tick to the command; one tick
//          from a target to its motor steps
// rate     one sample per `sample_tick`, one command per `tick`
// behaviour  Each HAS_... parameter builds one feature. What is not built has no logic, its pins
//          are idle, and the registers of its settings and its state read 0. `built` shows what
//          there is. An axis without a drive (HAS_DRIVE = 0) only measures: it has no interlock and
//          no actuator, and drive_enable is low. Profile, servo and velocity of all axes of a node
//          are in its motion_engine.
// source   S0: interferometer with sine, cosine and comparator outputs, limit switches, DC motor;
//          S2, S3: A/B/Z scales, stepper, linear motor
// model    the models of its blocks; tested together by tb/system
`default_nettype none

module axis #(
    parameter int W = 8,  // bits of a sample
    parameter int SEGMENTS = 0,  // most segments of the scale's table; 0: no table
    parameter int ADC_FRAME = 14,  // clocks of a conversion
    parameter int HAS_SINE = 1,  // 0: no sine and cosine, positions of counts only
    parameter int HAS_OWN_CHAIN = HAS_SINE,  // 1: build a chain for this axis; 0: one of the node
    parameter int HAS_MONITOR = HAS_SINE,  // 1: build the signal monitor; needs the sine
    parameter int HAS_HARMONICS = HAS_SINE,  // 1: build the harmonic correction, likewise
    parameter int HAS_RECORDER = HAS_SINE,  // 1: build the recorder of bursts, likewise
    parameter int HAS_CAPTURE = 1,  // 1: build the queue of captures
    parameter int HAS_COMPARE = 1,  // 1: build compare
    parameter int HAS_ENCODER_CHECK = 1,  // 1: build the check of the encoder
    parameter int HAS_VELOCITY = 1,  // 1: the engine estimates the velocity
    parameter int HAS_DRIVE = 1,  // 1: profile, servo, interlock, actuator; needs velocity
    parameter int FILTERS = 2 * HAS_DRIVE,  // biquads of the servo, 0 to 4
    parameter int HAS_BRIDGE = HAS_DRIVE,  // 1: build the bridge
    parameter int HAS_STEPPER = HAS_DRIVE,  // 1: build the step generator
    parameter int HAS_DAC = HAS_DRIVE,  // 1: build the DAC
    parameter int HAS_FINE_STAGE = HAS_DAC,  // 1: build the fine stage; needs the DAC
    parameter int HAS_SET_POINTS = 0,  // 1: set_point_player of the node serves the axis
    parameter int HAS_BACKLASH = 0  // 1: build the compensation of backlash
) (
    input wire clk,
    input wire rst,
    // register bus
    input wire select,  // strobe: an access to the axis
    input wire feedback_select,  // strobe: an access to its feedback channel
    input wire actuator_select,  // strobe: an access to its actuator
    input wire write,  // level: the access writes
    input wire [5:0] word,  // 32-bit word of the block
    input wire [31:0] wdata,  // value to write
    input wire [31:0] wdata_low,  // low word of a value of 64 bits
    output logic [31:0] rdata,  // live bits read, in the next cycle; else 0
    output logic [31:0] feedback_rdata,  // live bits read, in the next cycle; else 0
    output logic [31:0] actuator_rdata,  // live bits read, in the next cycle; else 0
    // time
    input wire tick,  // strobe: servo tick
    input wire sample_tick,  // strobe: take a sample
    input wire limit_tick,  // strobe: an eighth of the time of a limit switch
    input wire [31:0] now,  // cycles, time stamp
    // node
    input wire start,  // strobe: play the queued segments, with other axes
    input wire servo_overrun,  // strobe: a servo tick came too soon
    input wire sample_overrun,  // strobe: the shared chain has lost a sample
    input wire sync,  // strobe: the sync pulse of the bus captures
    input wire estop,  // level: 1 pressed
    input wire watchdog_expired,  // level: the master of the bus is silent
    input wire link_expired,  // level: no good packet over the link in time
    input wire cpu_stopped,  // level: the soft core has stopped or hangs
    // motion_engine: what it is given
    output logic [47:0] position,  // 2^-16 period
    output logic step_made,  // strobe: position moves in the next cycle
    output logic step_down,  // level: with step_made, it goes down
    output logic moves,  // level: position will jump
    output logic moved,  // strobe: position jumps by moved_by in the next cycle
    output logic [47:0] moved_by,  // 2^-16 period, signed
    output logic block_up,  // level: no positive command passes
    output logic block_down,  // level: no negative command passes
    output logic closed_loop,  // level: the servo commands the drive
    output logic [23:0] take_up,  // 2^-16 period, by which the motor is before the table
    output logic play,  // strobe: play the queued segments
    output logic arm,  // strobe: play them at start_at
    output logic controlled_stop,  // strobe: stop, and empty the queue
    output logic hold_target,  // strobe: target := position
    // motion_engine: its results
    input wire waits,  // level: a request is not done yet
    output logic pending,  // level: a request is not done and shown
    input wire result_valid,  // strobe: result is new, and of this axis
    input wire [2:0] result_kind,  // number of what it is
    input wire [47:0] result,  // value, signed
    input wire result_flag,  // level: its flag
    // set_point_player: the words of its registers
    input wire [31:0] stream_state,  // state of the stream
    input wire [31:0] stream_counts,  // counts of set-points
    // step_lines
    input wire line_start,  // strobe: the lines of motor steps begin
    input wire line_idle,  // level: the lines have ended
    input wire rate_valid,  // strobe: the rate of the next line of this axis is new
    input wire [36:0] rate,  // 2^-36 motor step per cycle, signed, with rate_valid
    input wire rate_restart,  // level: that line begins at a whole step
    input wire rate_steep,  // level: that line is too steep
    output logic line_stopped,  // level: no line is followed until a restart
    // pins of the scale
    input wire encoder_a,  // pin
    input wire encoder_b,  // pin
    input wire encoder_z,  // pin, index
    input wire [1:0] probe,  // pins of the touch probes
    input wire adc_sin,  // pin, serial data, synchronous to adc_sclk
    input wire adc_cos,  // pin, serial data, synchronous to adc_sclk
    output logic adc_cs_n,  // pin, low during a conversion
    output logic adc_sclk,  // pin, idles high
    output logic compare_pulse,  // pin, high during a compare pulse
    // to a shared interpolation_chain, as its ports of this axis
    output logic [7:0] chain_setting_written,  // strobes of its settings
    output logic chain_harmonic_enable,  // level: correct the harmonics
    output logic chain_learn,  // level: learn the count again
    output logic sample_valid,  // strobe: a new sample
    output logic signed [W-1:0] sample_sin,  // ADC counts, held until the next one
    output logic signed [W-1:0] sample_cos,  // ADC counts, held until the next one
    output logic signed [31:0] quadrature_count,  // 1/4 period
    // from a shared interpolation_chain
    input wire chain_sampled,  // strobe: the filtered sample is new
    input wire signed [W-1:0] chain_sin,  // ADC counts
    input wire signed [W-1:0] chain_cos,  // ADC counts
    input wire chain_rejected,  // strobe: an outlier was held back
    input wire chain_phase_valid,  // strobe: the plain phase is new
    input wire [15:0] chain_plain_phase,  // 2^-16 period, before the harmonics
    input wire chain_done,  // strobe: step leads to phase
    input wire signed [16:0] chain_step,  // 2^-16 period
    input wire [15:0] chain_phase,  // 2^-16 period, corrected
    input wire chain_overspeed,  // strobe: the speed is too high
    input wire chain_disagreement,  // level: position and count differ
    input wire chain_lost,  // strobe: a sample of this axis was lost
    // to a recorder
    output logic signed [47:0] target,  // 2^-16 period, held
    output logic [15:0] phase,  // 2^-16 period, corrected
    output logic signed [15:0] fine_command,  // of the fine stage, full scale 2^15
    output logic [12:0] faults,  // latched; bits as in axis_registers.faults
    // pins of the machine
    input wire limit_low_open,  // pin, 1: pressed or wire cut
    input wire limit_high_open,  // pin, 1: pressed or wire cut
    input wire drive_fault_n,  // pin, 0: the drive reports a fault
    // pins of the drive
    output logic bridge_a,  // pin, alone high for a positive command
    output logic bridge_b,  // pin, alone high for a negative command
    output logic step,  // pin, as step_output_mode says
    output logic direction,  // pin, as step_output_mode says
    output logic dac_cs_n,  // pin, low during a word
    output logic dac_sclk,  // pin, idles low
    output logic dac_sdi,  // pin, data of the DAC
    output logic drive_enable  // pin, 1: the drive may be on
);
    if (HAS_DRIVE == 0 && HAS_BRIDGE + HAS_STEPPER + HAS_DAC + HAS_FINE_STAGE != 0) begin : g_check
        ACTUATORS_NEED_HAS_DRIVE u_error ();
    end
    if (HAS_DRIVE != 0 && HAS_VELOCITY == 0) begin : g_check_velocity
        DRIVE_NEEDS_VELOCITY u_error ();
    end
    if (HAS_DRIVE == 0 && FILTERS != 0) begin : g_check_filters
        FILTERS_NEED_HAS_DRIVE u_error ();
    end
    if (HAS_DRIVE == 0 && HAS_SET_POINTS != 0) begin : g_check_set_points
        SET_POINTS_NEED_HAS_DRIVE u_error ();
    end
    if (HAS_DRIVE == 0 && HAS_BACKLASH != 0) begin : g_check_backlash
        BACKLASH_NEEDS_HAS_DRIVE u_error ();
    end

    // requests
    wire [1:0] control_enable, control_homing;  // each holds if both of its bits are 1
    wire control_fine;
    wire strobes_reset_faults, strobes_start;
    // settings of the feedback channel
    wire [5:0] deglitch;
    wire [15:0] amplitude_low, amplitude_high;
    wire sensing_written, disagreement_limit_written;
    wire        [ 5:0] encoder_fault_mask;
    wire signed [31:0] shift_origin;
    wire               shift_origin_written;

    // levels of the pins
    wire a, b, z, limit_low, limit_high, drive_fault;
    wire [1:0] probe_level;
    // measuring path
    wire signed [W-1:0] sin, cos;
    wire [15:0] amplitude;
    wire [ 5:0] encoder_events;
    wire sample_rejected, pulse_rejected, encoder_fault, position_valid, zero_up, zero_down;
    // target and command
    wire signed [31:0] velocity, error;
    wire signed [15:0] command, servo_command;
    wire [4:0] queue_free;
    wire moving, armed, saturated, line_up, line_down, underrun;
    wire compared, too_far, commanded;
    // interlock and drive
    wire [12:0] causes_now, first_fault;
    wire signed [47:0] fault_position;
    wire own_step, own_downward, fine_saturated;

    axis_inputs u_inputs (
        .clk,
        .rst,
        .limit_tick,
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
    feedback_channel #(
        .W                (W),
        .ADC_FRAME        (ADC_FRAME),
        .SEGMENTS         (SEGMENTS),
        .HAS_SINE         (HAS_SINE),
        .HAS_OWN_CHAIN    (HAS_OWN_CHAIN),
        .HAS_MONITOR      (HAS_MONITOR),
        .HAS_HARMONICS    (HAS_HARMONICS),
        .HAS_RECORDER     (HAS_RECORDER),
        .HAS_CAPTURE      (HAS_CAPTURE),
        .HAS_COMPARE      (HAS_COMPARE),
        .HAS_ENCODER_CHECK(HAS_ENCODER_CHECK),
        .HAS_BACKLASH     (HAS_BACKLASH)
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
        .amplitude_low,
        .amplitude_high,
        .encoder_fault_mask,
        .sensing_written,
        .limit_written(disagreement_limit_written),
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
        .own_step,
        .own_downward,
        // backlash
        .result_valid,
        .result_kind,
        .result,
        .take_up,
        // shared chain
        .chain_setting_written,
        .chain_harmonic_enable,
        .chain_learn,
        .sample_valid,
        .sample_sin,
        .sample_cos,
        .chain_sampled,
        .chain_sin,
        .chain_cos,
        .chain_rejected,
        .chain_phase_valid,
        .chain_plain_phase,
        .chain_done,
        .chain_step,
        .chain_phase,
        .chain_overspeed,
        .chain_disagreement,
        .chain_lost,
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
        .moves,
        .step_made,
        .step_down
    );
    engine_outputs u_outputs (
        .clk,
        .rst,
        // motion_engine
        .valid        (result_valid),
        .kind         (result_kind),
        .result,
        .flag         (result_flag),
        .waits,
        .line_start,
        // the profile
        .moving,
        .armed,
        .queue_free,
        .pending,
        .target,
        .line_up,
        .line_down,
        .underrun,
        // the servo
        .velocity,
        .error,
        .saturated,
        .error_valid  (compared),
        .too_far,
        .command_valid(commanded),
        .command      (servo_command)
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

    if (HAS_DRIVE != 0) begin : g_drive
        wire check_following, passed, step_overrun;

        axis_requests u_requests (
            // levels
            .closed_loop (closed_loop),
            .fine        (control_fine),
            // strobes
            .start       (strobes_start),
            .common_start(start),
            // joined
            .check_following,
            .play
        );

        drive_interlock u_interlock (
            .clk,
            .rst,
            // requests
            .enable_request  (&control_enable),
            .closed_loop     (check_following),
            .homing          (&control_homing),
            .reset_faults    (strobes_reset_faults),
            // causes
            .limit_low,
            .limit_high,
            .estop,
            .drive_fault,
            .encoder_fault,
            .error_valid     (compared),
            .error_too_far   (too_far),
            .watchdog_expired,
            .cpu_trap        (cpu_stopped),
            .profile_underrun(underrun),
            .step_overrun,
            .servo_overrun,
            .sample_overrun,
            .link_expired,
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
            .rdata (actuator_rdata),
            // permission
            .enable(drive_enable),
            .fine  (control_fine),
            .block_up,
            .block_down,
            // motion
            .valid (passed),
            .command,
            .target,
            .line_up,
            .line_down,
            .compared,
            .position,
            // lines of motor steps
            .line_start,
            .line_idle,
            .rate_valid,
            .rate,
            .rate_restart,
            .rate_steep,
            .line_stopped,
            // pins
            .bridge_a,
            .bridge_b,
            .step,
            .direction,
            .dac_cs_n,
            .dac_sclk,
            .dac_sdi,
            // state
            .own_step,
            .own_downward,
            .fine_command,
            .fine_saturated,
            .step_overrun
        );
    end else begin : g_no_drive
        assign {command, play} = '0;
        assign {block_up, block_down} = 2'b11;
        assign {drive_enable, faults, causes_now, first_fault, fault_position} = '0;
        assign {bridge_a, bridge_b, step, direction} = '0;
        assign {dac_cs_n, dac_sclk, dac_sdi} = 3'b100;
        assign {actuator_rdata, own_step, own_downward, fine_command, fine_saturated} = '0;
        assign line_stopped = 1'b1;

        wire unused_bus = &{1'b0, actuator_select, start};
        wire unused_requests = &{
            1'b0, control_enable, control_homing, control_fine, strobes_reset_faults,
            strobes_start
        };
        wire unused_causes = &{
            1'b0, estop, watchdog_expired, link_expired, cpu_stopped, limit_low, limit_high,
            drive_fault, encoder_fault, servo_overrun, sample_overrun, underrun, too_far
        };
        wire unused_motion = &{
            1'b0, line_up, line_down, compared, commanded, servo_command, line_idle, rate_valid,
            rate, rate_restart, rate_steep
        };
    end

    wire unused_stream = &{1'b0, stream_state[15:14]};

    axis_registers #(
        .HAS_MONITOR(HAS_MONITOR),
        .HAS_DRIVE  (HAS_DRIVE)
    ) u_registers (
        .clk,
        .rst,
        // register bus
        .select,
        .write,
        .word,
        .wdata,
        .rdata,
        // requests
        .control_enable,
        .control_closed_loop           (closed_loop),
        .control_homing,
        .control_fine,
        .strobes_reset_faults,
        .strobes_set_target_to_position(hold_target),
        .strobes_start,
        .strobes_controlled_stop       (controlled_stop),
        .strobes_arm                   (arm),
        // state
        .state_enabled                 (drive_enable),
        .state_limit_low               (limit_low),
        .state_limit_high              (limit_high),
        .state_estop                   (estop),
        .state_drive_fault             (drive_fault),
        .state_moving                  (moving),
        .state_saturated               (saturated),
        .state_queue_free              (queue_free),
        .state_armed                   (armed),
        .state_fine_saturated          (fine_saturated),
        .state_probe                   (HAS_CAPTURE != 0 ? probe_level : 2'd0),
        // what is built
        .built_sine                    (1'(HAS_SINE)),
        .built_monitor                 (1'(HAS_MONITOR)),
        .built_harmonics               (1'(HAS_HARMONICS)),
        .built_recorder                (1'(HAS_RECORDER)),
        .built_capture                 (1'(HAS_CAPTURE)),
        .built_compare                 (1'(HAS_COMPARE)),
        .built_encoder_check           (1'(HAS_ENCODER_CHECK)),
        .built_velocity                (1'(HAS_VELOCITY)),
        .built_drive                   (1'(HAS_DRIVE)),
        .built_bridge                  (1'(HAS_BRIDGE)),
        .built_stepper                 (1'(HAS_STEPPER)),
        .built_dac                     (1'(HAS_DAC)),
        .built_fine_stage              (1'(HAS_FINE_STAGE)),
        .built_filters                 (3'(FILTERS)),
        .built_segments                (8'(SEGMENTS)),
        .built_set_points              (1'(HAS_SET_POINTS)),
        .built_backlash                (1'(HAS_BACKLASH)),
        // interlock
        .faults,
        .causes_now,
        .first_fault,
        .fault_position,
        // position
        .position,
        .target,
        .velocity,
        .shift_origin,
        .shift_origin_written,
        .zero_crossing_up              (zero_up),
        .zero_crossing_down            (zero_down),
        // settings of the feedback channel
        .sensing_deglitch              (deglitch),
        .sensing_written,
        .amplitude_window_low          (amplitude_low),
        .amplitude_window_high         (amplitude_high),
        .disagreement_limit_written,
        // signals
        .sample_sin                    (16'(sin)),
        .sample_cos                    (16'(cos)),
        .phase_phase                   (phase),
        .phase_amplitude               (amplitude),
        .quadrature_count,
        .encoder_events,
        .encoder_fault_mask,
        .rejected_pulses               (pulse_rejected),
        .rejected_samples              (sample_rejected),
        // streamed set-points
        .stream_state_mode             (stream_state[2:0]),
        .stream_state_ended            (stream_state[5:3]),
        .stream_state_refusal          (stream_state[8:6]),
        .stream_state_room             (stream_state[13:9]),
        .stream_state_extrapolated     (stream_state[31:16]),
        .stream_counts_accepted        (stream_counts[15:0]),
        .stream_counts_late            (stream_counts[23:16]),
        .stream_counts_refused         (stream_counts[31:24]),
        // servo
        .following_error               (error),
        .command
    );
endmodule

`default_nettype wire
