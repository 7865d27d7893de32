// SPDX-License-Identifier: Apache-2.0
// axis_registers -- the register block of axis: position, servo, profile, drive-enable interlock.
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, not to be edited
`default_nettype none

module axis_registers #(
    parameter int HAS_DRIVE   = 1,  // 0: settings that need it read 0
    parameter int HAS_MONITOR = 1   // 0: settings that need it read 0
) (
    input  wire                clk,
    input  wire                rst,                             // settings take their first values
    input  wire                select,                          // strobe: access to this block
    input  wire                write,                           // level: it writes wdata
    input  wire         [ 5:0] word,                            // index of the word
    input  wire         [31:0] wdata,                           // value to write
    output logic        [31:0] rdata,                           // live bits read; else 0
    // 3 requests the drive; the interlock grants it only without a latched fault
    output logic        [ 1:0] control_enable,
    // 1: the servo commands the drive, 0: open_command does
    output logic               control_closed_loop,
    // homing; 3: a limit switch only blocks motion towards it, else it is a fault
    output logic        [ 1:0] control_homing,
    // 1: the fine stage holds; the main command keeps its value. 0: the fine stage returns to its
    // middle
    output logic               control_fine,
    // strobe: clears latched faults whose cause is gone; needs enable = 0
    output logic               strobes_reset_faults,
    // strobe: sets the target to the position, and empties the profile queue
    output logic               strobes_set_target_to_position,
    output logic               strobes_start,                   // strobe: plays the queued segments
    // strobe: controlled stop: empties the queue, and stops the target within stop_deceleration and
    // stop_jerk
    output logic               strobes_controlled_stop,
    // strobe: plays the queued segments when the time stamp reaches start_at
    output logic               strobes_arm,
    input  wire                state_enabled,                   // the drive is on
    // switch at the low end, 1: pressed; filtered
    input  wire                state_limit_low,
    // switch at the high end, 1: pressed; filtered
    input  wire                state_limit_high,
    input  wire                state_estop,                     // emergency stop, 1: pressed
    // drive fault, 1: the drive reports a fault
    input  wire                state_drive_fault,
    input  wire                state_moving,                    // a profile is being played
    input  wire                state_saturated,                 // the command is at its limit
    input  wire         [ 4:0] state_queue_free,                // segments that can be queued
    input  wire                state_armed,                     // a profile waits for start_at
    input  wire                state_fine_saturated,            // fine stage at its limit
    // HAS_CAPTURE: levels of the touch probes, 0 and 1
    input  wire         [ 1:0] state_probe,
    input  wire         [12:0] faults,                          // levels: latched faults
    // causes present now, same bits as faults
    input  wire         [12:0] causes_now,
    // cause that came first, same bits as faults; one bit
    input  wire         [12:0] first_fault,
    // position when the first fault was latched [1/65536 period]
    input  wire signed  [47:0] fault_position,
    input  wire signed  [47:0] position,                        // position [1/65536 period]
    // target of the servo [1/65536 period]
    input  wire signed  [47:0] target,
    input  wire signed  [31:0] velocity,                        // velocity [1/65536 period/tick]
    // shift of the origin: position and target both grow by this many whole periods, in one cycle
    // [period]
    output logic signed [31:0] shift_origin,
    output logic               shift_origin_written,            // strobe: new value
    // strobe: crossed going up; write 1 to clear
    input  wire                zero_crossing_up,
    // strobe: crossed going down; write 1 to clear
    input  wire                zero_crossing_down,
    // samples in a row that a, b and z must have the same level; one in each edge_filter.skip + 1
    // cycles [sample]
    output logic        [ 5:0] sensing_deglitch,
    output logic               sensing_written,                 // strobe: new value
    // amplitude window; full scale 2^(W-1): low
    output logic        [15:0] amplitude_window_low,
    // amplitude window; full scale 2^(W-1): high
    output logic        [15:0] amplitude_window_high,
    output logic               disagreement_limit_written,      // strobe: new value
    // last sample, after the outlier filter; full scale 2^(W-1): sin
    input  wire signed  [15:0] sample_sin,
    // last sample, after the outlier filter; full scale 2^(W-1): cos
    input  wire signed  [15:0] sample_cos,
    // phase and amplitude of the last sample: phase [1/65536 period]
    input  wire         [15:0] phase_phase,
    input  wire         [15:0] phase_amplitude,                 // amplitude, full scale 2^(W-1)
    // count of the quadrature decoder [1/4 period]
    input  wire signed  [31:0] quadrature_count,
    // strobes: encoder events; each one stays until 1 is written to it
    input  wire         [ 5:0] encoder_events,
    // encoder events that are a fault; same bits as encoder_events
    output logic        [ 5:0] encoder_fault_mask,
    // strobe: pulses of a, b or z that the filter rejected; writing clears the count, which stops
    // at its largest value
    input  wire                rejected_pulses,
    // strobe: samples that the outlier filter rejected; writing clears the count
    input  wire                rejected_samples,
    // HAS_SINE: sine and cosine; 0: the position is made of counts
    input  wire                built_sine,
    // HAS_MONITOR: signal monitor, amplitude
    input  wire                built_monitor,
    // HAS_HARMONICS: harmonic correction
    input  wire                built_harmonics,
    // HAS_RECORDER: recorder of bursts, for the auto-calibration
    input  wire                built_recorder,
    // HAS_CAPTURE: queue of captures; 0: one index at a time
    input  wire                built_capture,
    input  wire                built_compare,                   // HAS_COMPARE: compare pulses
    // HAS_ENCODER_CHECK: check of counts per revolution, count at the index, time of the last edge
    input  wire                built_encoder_check,
    input  wire                built_velocity,                  // HAS_VELOCITY: measured velocity
    // HAS_DRIVE: profile, servo, interlock; 0: the axis only measures
    input  wire                built_drive,
    input  wire                built_bridge,                    // HAS_BRIDGE: bridge
    input  wire                built_stepper,                   // HAS_STEPPER: step generator
    input  wire                built_dac,                       // HAS_DAC: DAC
    input  wire                built_fine_stage,                // HAS_FINE_STAGE: fine stage
    // FILTERS: biquads of the servo; 0: none
    input  wire         [ 2:0] built_filters,
    // SEGMENTS: most segments of the table; 0: none
    input  wire         [ 7:0] built_segments,
    // HAS_SET_POINTS: player of streamed set-points
    input  wire                built_set_points,
    // HAS_BACKLASH: compensation of backlash
    input  wire                built_backlash,
    // 0 off, 1 prepared, without a set-point yet, 2 streaming, 3 extrapolating, 4 ended
    input  wire         [ 2:0] stream_state_mode,
    // how the last stream ended: 0 not, 1 released at rest, 2 stopped, 3 set-point late, 4 fault
    input  wire         [ 2:0] stream_state_ended,
    // why the last set-point was refused: 0 none was, 1 late, 2 limits, 3 out of travel, 4 queue
    // full, 5 incomplete, 6 not streamed, 7 more than 255 ticks ahead
    input  wire         [ 2:0] stream_state_refusal,
    input  wire         [ 4:0] stream_state_room,               // set-points that can be committed
    // ticks extrapolated since the stream began; wraps [tick]
    input  wire         [15:0] stream_state_extrapolated,
    // set-points since the stream began; the counts wrap: accepted
    input  wire         [15:0] stream_counts_accepted,
    input  wire         [ 7:0] stream_counts_late,              // late ones
    input  wire         [ 7:0] stream_counts_refused,           // those refused for another cause
    // target - position, limited to 32 bits [1/65536 period]
    input  wire signed  [31:0] following_error,
    // command to the drive, full scale 2^15, after the interlock
    input  wire signed  [15:0] command
);
    logic [ 5:0] encoder_events_held;
    logic [15:0] fault_position_high;
    logic [15:0] position_high;
    logic [15:0] target_high;
    logic        zero_crossing_up_held;
    logic        zero_crossing_down_held;
    logic [15:0] rejected_pulses_count;
    wire  [16:0] rejected_pulses_next = {1'b0, rejected_pulses_count} + 17'(rejected_pulses);
    logic [15:0] rejected_samples_count;
    wire  [16:0] rejected_samples_next = {1'b0, rejected_samples_count} + 17'(rejected_samples);
    logic        get_state;
    logic        get_faults;
    logic        get_causes_now;
    logic        get_first_fault;
    logic        get_fault_position;
    logic        get_fault_position_high;
    logic        get_position;
    logic        get_position_high;
    logic        get_target;
    logic        get_target_high;
    logic        get_velocity;
    logic        get_zero_crossing;
    logic        get_sample;
    logic        get_phase;
    logic        get_quadrature_count;
    logic        get_encoder_events;
    logic        get_rejected_pulses;
    logic        get_rejected_samples;
    logic        get_built;
    logic        get_stream_state;
    logic        get_stream_counts;
    logic        get_following_error;
    logic        get_command;

    wire         get = select && !write;
    wire         put = select && write;

    // words read in the cycle before
    assign rdata = ({32{get_state}} & {16'd0, state_probe, state_fine_saturated, state_armed,
        state_queue_free, state_saturated, state_moving, state_drive_fault, state_estop,
        state_limit_high, state_limit_low, state_enabled}) | ({32{get_faults}} & {19'd0, faults}) |
        ({32{get_causes_now}} & {19'd0, causes_now}) | ({32{get_first_fault}} & {19'd0,
        first_fault}) | ({32{get_fault_position}} & fault_position[31:0]) |
        ({32{get_fault_position_high}} & {16'd0, fault_position_high}) | ({32{get_position}} &
        position[31:0]) | ({32{get_position_high}} & {16'd0, position_high}) | ({32{get_target}} &
        target[31:0]) | ({32{get_target_high}} & {16'd0, target_high}) | ({32{get_velocity}} &
        velocity) | ({32{get_zero_crossing}} & {30'd0, zero_crossing_down_held,
        zero_crossing_up_held}) | ({32{get_sample}} & {sample_cos, sample_sin}) | ({32{get_phase}} &
        {phase_amplitude, phase_phase}) | ({32{get_quadrature_count}} & quadrature_count) |
        ({32{get_encoder_events}} & {26'd0, encoder_events_held}) | ({32{get_rejected_pulses}} &
        {16'd0, rejected_pulses_count}) | ({32{get_rejected_samples}} & {16'd0,
        rejected_samples_count}) | ({32{get_built}} & {6'd0, built_backlash, built_set_points,
        built_segments, built_filters, built_fine_stage, built_dac, built_stepper, built_bridge,
        built_drive, built_velocity, built_encoder_check, built_compare, built_capture,
        built_recorder, built_harmonics, built_monitor, built_sine}) | ({32{get_stream_state}} &
        {stream_state_extrapolated, 2'd0, stream_state_room, stream_state_refusal,
        stream_state_ended, stream_state_mode}) | ({32{get_stream_counts}} & {stream_counts_refused,
        stream_counts_late, stream_counts_accepted}) | ({32{get_following_error}} & following_error)
        | ({32{get_command}} & {16'd0, command}) | {{16{(get_fault_position_high &&
        fault_position_high[15]) || (get_position_high && position_high[15]) || (get_target_high &&
        target_high[15]) || (get_command && command[15])}}, 16'd0};

    always_ff @(posedge clk) begin
        get_state <= get && word == 6'h02;
        get_faults <= get && word == 6'h03;
        get_causes_now <= get && word == 6'h04;
        get_first_fault <= get && word == 6'h05;
        get_fault_position <= get && word == 6'h06;
        get_fault_position_high <= get && word == 6'h07;
        get_position <= get && word == 6'h0A;
        get_position_high <= get && word == 6'h0B;
        get_target <= get && word == 6'h0C;
        get_target_high <= get && word == 6'h0D;
        get_velocity <= get && word == 6'h0E;
        get_zero_crossing <= get && word == 6'h10;
        get_sample <= get && word == 6'h14;
        get_phase <= get && word == 6'h15;
        get_quadrature_count <= get && word == 6'h16;
        get_encoder_events <= get && word == 6'h17;
        get_rejected_pulses <= get && word == 6'h19;
        get_rejected_samples <= get && word == 6'h1A;
        get_built <= get && word == 6'h1B;
        get_stream_state <= get && word == 6'h1E;
        get_stream_counts <= get && word == 6'h1F;
        get_following_error <= get && word == 6'h27;
        get_command <= get && word == 6'h28;
        if (get_fault_position) fault_position_high <= fault_position[47:32];
        if (get_position) position_high <= position[47:32];
        if (get_target) target_high <= target[47:32];

        if (HAS_DRIVE != 0 && put && word == 6'h00) control_enable <= wdata[1:0];
        if (HAS_DRIVE != 0 && put && word == 6'h00) control_closed_loop <= wdata[2];
        if (HAS_DRIVE != 0 && put && word == 6'h00) control_homing <= wdata[4:3];
        if (HAS_DRIVE != 0 && put && word == 6'h00) control_fine <= wdata[5];
        strobes_reset_faults <= put && word == 6'h01 && wdata[0];
        strobes_set_target_to_position <= put && word == 6'h01 && wdata[1];
        strobes_start <= put && word == 6'h01 && wdata[2];
        strobes_controlled_stop <= put && word == 6'h01 && wdata[3];
        strobes_arm <= put && word == 6'h01 && wdata[4];
        shift_origin_written <= put && word == 6'h0F;
        shift_origin <= put && word == 6'h0F ? wdata[31:0] : '0;
        zero_crossing_up_held <= zero_crossing_up || (zero_crossing_up_held && !(put && word ==
            6'h10 && wdata[0]));
        zero_crossing_down_held <= zero_crossing_down || (zero_crossing_down_held && !(put && word
            == 6'h10 && wdata[1]));
        sensing_written <= put && word == 6'h11;
        if (put && word == 6'h11) sensing_deglitch <= wdata[5:0];
        if (HAS_MONITOR != 0 && put && word == 6'h12) amplitude_window_low <= wdata[15:0];
        if (HAS_MONITOR != 0 && put && word == 6'h12) amplitude_window_high <= wdata[31:16];
        disagreement_limit_written <= put && word == 6'h13;
        encoder_events_held[0] <= encoder_events[0] || (encoder_events_held[0] && !(put && word ==
            6'h17 && wdata[0]));
        encoder_events_held[1] <= encoder_events[1] || (encoder_events_held[1] && !(put && word ==
            6'h17 && wdata[1]));
        encoder_events_held[2] <= encoder_events[2] || (encoder_events_held[2] && !(put && word ==
            6'h17 && wdata[2]));
        encoder_events_held[3] <= encoder_events[3] || (encoder_events_held[3] && !(put && word ==
            6'h17 && wdata[3]));
        encoder_events_held[4] <= encoder_events[4] || (encoder_events_held[4] && !(put && word ==
            6'h17 && wdata[4]));
        encoder_events_held[5] <= encoder_events[5] || (encoder_events_held[5] && !(put && word ==
            6'h17 && wdata[5]));
        if (put && word == 6'h18) encoder_fault_mask <= wdata[5:0];
        if (put && word == 6'h19) rejected_pulses_count <= 16'(rejected_pulses);
        else if (!rejected_pulses_next[16]) rejected_pulses_count <= rejected_pulses_next[15:0];
        if (put && word == 6'h1A) rejected_samples_count <= 16'(rejected_samples);
        else if (!rejected_samples_next[16]) rejected_samples_count <= rejected_samples_next[15:0];

        if (rst) begin
            get_state <= 1'b0;
            get_faults <= 1'b0;
            get_causes_now <= 1'b0;
            get_first_fault <= 1'b0;
            get_fault_position <= 1'b0;
            get_fault_position_high <= 1'b0;
            get_position <= 1'b0;
            get_position_high <= 1'b0;
            get_target <= 1'b0;
            get_target_high <= 1'b0;
            get_velocity <= 1'b0;
            get_zero_crossing <= 1'b0;
            get_sample <= 1'b0;
            get_phase <= 1'b0;
            get_quadrature_count <= 1'b0;
            get_encoder_events <= 1'b0;
            get_rejected_pulses <= 1'b0;
            get_rejected_samples <= 1'b0;
            get_built <= 1'b0;
            get_stream_state <= 1'b0;
            get_stream_counts <= 1'b0;
            get_following_error <= 1'b0;
            get_command <= 1'b0;
            control_enable <= 2'h0;
            control_closed_loop <= 1'b0;
            control_homing <= 2'h0;
            control_fine <= 1'b0;
            strobes_reset_faults <= 1'b0;
            strobes_set_target_to_position <= 1'b0;
            strobes_start <= 1'b0;
            strobes_controlled_stop <= 1'b0;
            strobes_arm <= 1'b0;
            fault_position_high <= '0;
            position_high <= '0;
            target_high <= '0;
            shift_origin_written <= 1'b0;
            shift_origin <= 32'h00000000;
            zero_crossing_up_held <= '0;
            zero_crossing_down_held <= '0;
            sensing_written <= 1'b0;
            sensing_deglitch <= 6'h10;
            amplitude_window_low <= 16'h0000;
            amplitude_window_high <= HAS_MONITOR == 0 ? '0 : 16'hFFFF;
            disagreement_limit_written <= 1'b0;
            encoder_events_held[0] <= '0;
            encoder_events_held[1] <= '0;
            encoder_events_held[2] <= '0;
            encoder_events_held[3] <= '0;
            encoder_events_held[4] <= '0;
            encoder_events_held[5] <= '0;
            encoder_fault_mask <= 6'h00;
            rejected_pulses_count <= '0;
            rejected_samples_count <= '0;
        end
    end
endmodule

`default_nettype wire
