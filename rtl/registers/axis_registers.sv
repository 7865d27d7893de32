// SPDX-License-Identifier: Apache-2.0
// axis_registers -- the register block of axis: sensor, position, servo, profile, drive, guard.
//
// latency  1 clk from select to rdata, and from a write to the new value        rate  one access per clk
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle; test tb/registers/test_registers.py
// made     by tables/registers.py, never by hand
`default_nettype none

module axis_registers #(
    parameter int SINE = 1                // 0: the settings that need it have no bits and read 0
) (
    input  wire                clk,
    input  wire                rst,                             // every setting takes its first value, what was counted or held is cleared
    input  wire                select,                          // an access to this block
    input  wire                write,                           // with select: wdata goes into the word
    input  wire  [5:0]         word,                            // index of the 32-bit word; a word without a register reads 0
    input  wire  [31:0]        wdata,
    output logic [31:0]        rdata,                           // what was read, for one clk; 0 in every other
    output logic               control_enable,                  // ask for the drive; the guard grants it only without a latched fault
    output logic               control_closed_loop,             // 1: servo commands the drive, 0: open_command does
    output logic               control_homing,                  // 1: a limit switch only blocks the way into it, 0: it is a fault
    output logic               control_fine,                    // 1: the fine stage holds the position and the main command rests, 0: the fine stage rests in its middle
    output logic               strobes_reset_faults,            // strobe: clear latched faults whose cause is gone; needs enable = 0
    output logic               strobes_set_target_to_position,  // strobe: target := position, profile queue emptied
    output logic               strobes_start,                   // strobe: play the queued segments
    output logic               strobes_controlled_stop,         // strobe: controlled stop: queue emptied, the target comes to rest within stop_deceleration and stop_jerk
    output logic               strobes_arm,                     // strobe: play the queued segments when the time stamp reaches start_at
    input  wire                state_enabled,                   // the drive is on
    input  wire                state_limit_low,                 // level of the switch at the low end, deglitched; 1: pressed
    input  wire                state_limit_high,                // level of the switch at the high end, deglitched; 1: pressed
    input  wire                state_estop,                     // 1: emergency stop is pressed
    input  wire                state_drive_fault,               // 1: the drive reports a fault
    input  wire                state_moving,                    // a profile is being played
    input  wire                state_saturated,                 // the command stands at its limit
    input  wire  [4:0]         state_queue_free,                // segments that may still be queued
    input  wire                state_armed,                     // a profile waits for start_at
    input  wire                state_fine_saturated,            // the command of the fine stage stands at its limit
    input  wire                faults_limit_low,                // latched causes: limit low
    input  wire                faults_limit_high,               // latched causes: limit high
    input  wire                faults_estop,                    // latched causes: estop
    input  wire                faults_following_error,          // latched causes: following error
    input  wire                faults_encoder,                  // latched causes: encoder
    input  wire                faults_bus_watchdog,             // latched causes: bus watchdog
    input  wire                faults_drive,                    // latched causes: drive
    input  wire                faults_cpu,                      // latched causes: cpu
    input  wire                faults_profile_underrun,         // latched causes: profile underrun
    input  wire                faults_step_overrun,             // latched causes: step overrun
    input  wire  [9:0]         causes_now,                      // causes that stand now, same order as faults
    input  wire  [9:0]         first_fault,                     // the cause that came first, same order as faults; one bit
    input  wire  signed [47:0] fault_position,                  // position when the first fault latched [1/65536 period]
    output logic [31:0]        following_limit,                 // largest |target - position| while closed_loop; 0 switches the check off [1/65536 period]
    input  wire  signed [47:0] position,                        // position [1/65536 period]
    input  wire  signed [47:0] target,                          // target of the servo [1/65536 period]
    input  wire  signed [31:0] velocity,                        // velocity [1/65536 period/tick]
    output logic signed [31:0] shift_origin,                    // move the origin: position and target both grow by this many whole periods, in one clk [period]
    output logic               shift_origin_written,            // strobe: shift_origin has just been written, its new value stands
    input  wire                zero_crossing_up,                // strobe, held: going up; write 1 to clear
    input  wire                zero_crossing_down,              // strobe, held: going down; write 1 to clear
    output logic [15:0]        sensing_deglitch,                // a level must be stable this long [clk]
    output logic [7:0]         sensing_outlier_step,            // limit filter 1: largest step between samples, full scale 2^(W-1); 0: off
    output logic [7:0]         sensing_outlier_hold,            // samples in a row that limit filter 1 may hold back
    output logic [15:0]        amplitude_window_low,            // amplitude window; full scale 2^(W-1): low
    output logic [15:0]        amplitude_window_high,           // amplitude window; full scale 2^(W-1): high
    output logic [19:0]        disagreement_limit,              // largest difference of interpolated position and quadrature count; 0: not checked [1/65536 period]
    input  wire  signed [15:0] sample_sin,                      // last sample after limit filter 1: sin
    input  wire  signed [15:0] sample_cos,                      // last sample after limit filter 1: cos
    input  wire  [15:0]        phase_phase,                     // phase and amplitude of the last sample: phase [1/65536 period]
    input  wire  [15:0]        phase_amplitude,                 // phase and amplitude of the last sample: amplitude
    input  wire  signed [31:0] quadrature_count,                // count of the quadrature decoder [1/4 period]
    input  wire                encoder_events_illegal_edge,     // strobe, held: both levels changed at once
    input  wire                encoder_events_overspeed,        // strobe, held: phase moved more than a quarter period from where it was expected
    input  wire                encoder_events_amplitude_low,    // strobe, held: what was wrong with the sensor since it was last cleared; write 1 to clear: amplitude low
    input  wire                encoder_events_amplitude_high,   // strobe, held: what was wrong with the sensor since it was last cleared; write 1 to clear: amplitude high
    input  wire                encoder_events_disagreement,     // strobe, held: interpolated position and quadrature count differ
    input  wire                encoder_events_pulse_too_short,  // strobe, held: decoder_mode 3: a pulse of a, or the gap between two, was too short for the deglitcher: not counted
    output logic [5:0]         encoder_fault_mask,              // which encoder events are a fault; same order as encoder_events
    input  wire                rejected_pulses,                 // strobe, counted: pulses that the deglitcher of a or b held back; writing clears
    input  wire                rejected_samples,                // strobe, counted: samples that limit filter 1 held back; writing clears
    output logic [23:0]        kp,                              // proportional gain on the error [1/65536 command/(period/65536)]
    output logic               kp_written,                      // strobe: kp has just been written, its new value stands
    output logic [23:0]        ki,                              // integral gain, each tick [1/16777216 command/(period/65536)]
    output logic [23:0]        kd,                              // derivative gain on the velocity error [1/65536 command/(period/65536/tick)]
    output logic               kd_written,                      // strobe: kd has just been written, its new value stands
    output logic [23:0]        kv,                              // feed-forward of the target velocity [1/65536 command/(period/65536/tick)]
    output logic               kv_written,                      // strobe: kv has just been written, its new value stands
    output logic [23:0]        ka,                              // feed-forward of the target acceleration [1/256 command/(period/65536/tick2)]
    output logic               ka_written,                      // strobe: ka has just been written, its new value stands
    output logic [14:0]        servo_limits_output,             // largest |command|
    output logic [14:0]        servo_limits_integral,           // largest |integral term|
    output logic [15:0]        dead_band,                       // the integrator rests while |error| is not above this and the profile stands [1/65536 period]
    input  wire  signed [31:0] following_error,                 // target - position, held inside 32 bits [1/65536 period]
    input  wire  signed [15:0] command,                         // command to the drive as the guard lets it pass
    output logic signed [15:0] open_command,                    // command while closed_loop = 0
    output logic [3:0]         filters_in_use,                  // bit n: section n filters, else it passes
    output logic [4:0]         filters_address,                 // of the next coefficient: section * 8 + 0: b0, 1: b1, 2: b2, 3: -a1, 4: -a2
    output logic signed [31:0] filter_coefficient,              // coefficient; writing puts it at filters.address
    output logic               filter_coefficient_written,      // strobe: filter_coefficient has just been written, its new value stands
    output logic signed [63:0] segment_velocity,                // velocity at the start of the segment [2^-40 period/tick]
    output logic signed [63:0] segment_acceleration,            // acceleration at the start of the segment [2^-40 period/tick2]
    output logic signed [31:0] segment_jerk,                    // jerk of the segment [2^-40 period/tick3]
    output logic [23:0]        segment_ticks,                   // duration of the segment; writing queues it [tick]
    output logic               segment_ticks_last,              // 1: the profile ends with this segment, 0: another must follow or it is an underrun
    output logic               segment_ticks_written,           // strobe: segment_ticks has just been written, its new value stands
    output logic [31:0]        stop_deceleration,               // largest acceleration after the strobe brake [2^-32 period/tick2]
    output logic [31:0]        stop_jerk,                       // largest change of the acceleration then; 0: not limited [2^-40 period/tick3]
    output logic [16:0]        feed_override_fraction,          // of full speed, 65536 at most
    output logic               feed_override_pause,             // 1: stand still in the middle of it
    output logic [31:0]        feed_override_slope,             // largest change of the override; 0: at once [2^-32 1/tick]
    output logic [31:0]        feed_override_curve,             // largest change of that; 0: not limited [2^-32 1/tick2]
    output logic [31:0]        start_at                         // time stamp at which an armed profile starts [clk]
);
    logic [15:0] fault_position_high;
    logic [15:0] position_high;
    logic [15:0] target_high;
    logic        zero_crossing_up_held;
    logic        zero_crossing_down_held;
    logic        encoder_events_illegal_edge_held;
    logic        encoder_events_overspeed_held;
    logic        encoder_events_amplitude_low_held;
    logic        encoder_events_amplitude_high_held;
    logic        encoder_events_disagreement_held;
    logic        encoder_events_pulse_too_short_held;
    logic [31:0] rejected_pulses_count;
    logic [31:0] rejected_samples_count;
    logic [31:0] segment_velocity_low;
    logic [31:0] segment_acceleration_low;

    wire get = select && !write;
    wire put = select && write;

    always_ff @(posedge clk) begin
        rdata <= '0;
        if (get) case (word)
            6'h00: rdata <= {28'd0, control_fine, control_homing, control_closed_loop, control_enable};
            6'h02: rdata <= {18'd0, state_fine_saturated, state_armed, state_queue_free, state_saturated, state_moving,
                            state_drive_fault, state_estop, state_limit_high, state_limit_low, state_enabled};
            6'h03: rdata <= {22'd0, faults_step_overrun, faults_profile_underrun, faults_cpu, faults_drive, faults_bus_watchdog,
                            faults_encoder, faults_following_error, faults_estop, faults_limit_high, faults_limit_low};
            6'h04: rdata <= {22'd0, causes_now};
            6'h05: rdata <= {22'd0, first_fault};
            6'h06: rdata <= fault_position[31:0];
            6'h07: rdata <= {{16{fault_position_high[15]}}, fault_position_high};
            6'h08: rdata <= following_limit;
            6'h0A: rdata <= position[31:0];
            6'h0B: rdata <= {{16{position_high[15]}}, position_high};
            6'h0C: rdata <= target[31:0];
            6'h0D: rdata <= {{16{target_high[15]}}, target_high};
            6'h0E: rdata <= velocity;
            6'h0F: rdata <= shift_origin;
            6'h10: rdata <= {30'd0, zero_crossing_down_held, zero_crossing_up_held};
            6'h11: rdata <= {sensing_outlier_hold, sensing_outlier_step, sensing_deglitch};
            6'h12: rdata <= {amplitude_window_high, amplitude_window_low};
            6'h13: rdata <= {12'd0, disagreement_limit};
            6'h14: rdata <= {sample_cos, sample_sin};
            6'h15: rdata <= {phase_amplitude, phase_phase};
            6'h16: rdata <= quadrature_count;
            6'h17: rdata <= {26'd0, encoder_events_pulse_too_short_held, encoder_events_disagreement_held,
                            encoder_events_amplitude_high_held, encoder_events_amplitude_low_held, encoder_events_overspeed_held,
                            encoder_events_illegal_edge_held};
            6'h18: rdata <= {26'd0, encoder_fault_mask};
            6'h19: rdata <= rejected_pulses_count;
            6'h1A: rdata <= rejected_samples_count;
            6'h20: rdata <= {8'd0, kp};
            6'h21: rdata <= {8'd0, ki};
            6'h22: rdata <= {8'd0, kd};
            6'h23: rdata <= {8'd0, kv};
            6'h24: rdata <= {8'd0, ka};
            6'h25: rdata <= {2'd0, servo_limits_integral, servo_limits_output};
            6'h26: rdata <= {16'd0, dead_band};
            6'h27: rdata <= following_error;
            6'h28: rdata <= {{16{command[15]}}, command};
            6'h29: rdata <= {{16{open_command[15]}}, open_command};
            6'h2A: rdata <= {23'd0, filters_address, filters_in_use};
            6'h2B: rdata <= filter_coefficient;
            6'h2C: rdata <= segment_velocity[31:0];
            6'h2D: rdata <= segment_velocity[63:32];
            6'h2E: rdata <= segment_acceleration[31:0];
            6'h2F: rdata <= segment_acceleration[63:32];
            6'h30: rdata <= segment_jerk;
            6'h31: rdata <= {7'd0, segment_ticks_last, segment_ticks};
            6'h32: rdata <= stop_deceleration;
            6'h33: rdata <= stop_jerk;
            6'h34: rdata <= {14'd0, feed_override_pause, feed_override_fraction};
            6'h35: rdata <= feed_override_slope;
            6'h36: rdata <= feed_override_curve;
            6'h37: rdata <= start_at;
            default: rdata <= '0;
        endcase
        if (get && word == 6'h06) fault_position_high <= fault_position[47:32];
        if (get && word == 6'h0A) position_high <= position[47:32];
        if (get && word == 6'h0C) target_high <= target[47:32];

        if (put && word == 6'h00) control_enable <= wdata[0];
        if (put && word == 6'h00) control_closed_loop <= wdata[1];
        if (put && word == 6'h00) control_homing <= wdata[2];
        if (put && word == 6'h00) control_fine <= wdata[3];
        strobes_reset_faults <= put && word == 6'h01 && wdata[0];
        strobes_set_target_to_position <= put && word == 6'h01 && wdata[1];
        strobes_start <= put && word == 6'h01 && wdata[2];
        strobes_controlled_stop <= put && word == 6'h01 && wdata[3];
        strobes_arm <= put && word == 6'h01 && wdata[4];
        if (put && word == 6'h08) following_limit <= wdata;
        shift_origin_written <= put && word == 6'h0F;
        if (put && word == 6'h0F) shift_origin <= wdata;
        zero_crossing_up_held <= zero_crossing_up || (zero_crossing_up_held && !(put && word == 6'h10 && wdata[0]));
        zero_crossing_down_held <= zero_crossing_down || (zero_crossing_down_held && !(put && word == 6'h10 && wdata[1]));
        if (put && word == 6'h11) sensing_deglitch <= wdata[15:0];
        if (SINE != 0 && put && word == 6'h11) sensing_outlier_step <= wdata[23:16];
        if (SINE != 0 && put && word == 6'h11) sensing_outlier_hold <= wdata[31:24];
        if (SINE != 0 && put && word == 6'h12) amplitude_window_low <= wdata[15:0];
        if (SINE != 0 && put && word == 6'h12) amplitude_window_high <= wdata[31:16];
        if (SINE != 0 && put && word == 6'h13) disagreement_limit <= wdata[19:0];
        encoder_events_illegal_edge_held <= encoder_events_illegal_edge || (encoder_events_illegal_edge_held && !(put && word == 6'h17 && wdata[0]));
        encoder_events_overspeed_held <= encoder_events_overspeed || (encoder_events_overspeed_held && !(put && word == 6'h17 && wdata[1]));
        encoder_events_amplitude_low_held <= encoder_events_amplitude_low || (encoder_events_amplitude_low_held && !(put && word == 6'h17 && wdata[2]));
        encoder_events_amplitude_high_held <= encoder_events_amplitude_high || (encoder_events_amplitude_high_held && !(put && word == 6'h17 && wdata[3]));
        encoder_events_disagreement_held <= encoder_events_disagreement || (encoder_events_disagreement_held && !(put && word == 6'h17 && wdata[4]));
        encoder_events_pulse_too_short_held <= encoder_events_pulse_too_short || (encoder_events_pulse_too_short_held && !(put && word == 6'h17 && wdata[5]));
        if (put && word == 6'h18) encoder_fault_mask <= wdata[5:0];
        if (put && word == 6'h19) rejected_pulses_count <= {31'd0, rejected_pulses};
        else if (!(&rejected_pulses_count)) rejected_pulses_count <= rejected_pulses_count + {31'd0, rejected_pulses};
        if (put && word == 6'h1A) rejected_samples_count <= {31'd0, rejected_samples};
        else if (!(&rejected_samples_count)) rejected_samples_count <= rejected_samples_count + {31'd0, rejected_samples};
        kp_written <= put && word == 6'h20;
        if (put && word == 6'h20) kp <= wdata[23:0];
        if (put && word == 6'h21) ki <= wdata[23:0];
        kd_written <= put && word == 6'h22;
        if (put && word == 6'h22) kd <= wdata[23:0];
        kv_written <= put && word == 6'h23;
        if (put && word == 6'h23) kv <= wdata[23:0];
        ka_written <= put && word == 6'h24;
        if (put && word == 6'h24) ka <= wdata[23:0];
        if (put && word == 6'h25) servo_limits_output <= wdata[14:0];
        if (put && word == 6'h25) servo_limits_integral <= wdata[29:15];
        if (put && word == 6'h26) dead_band <= wdata[15:0];
        if (put && word == 6'h29) open_command <= wdata[15:0];
        if (put && word == 6'h2A) filters_in_use <= wdata[3:0];
        if (put && word == 6'h2A) filters_address <= wdata[8:4];
        filter_coefficient_written <= put && word == 6'h2B;
        if (put && word == 6'h2B) filter_coefficient <= wdata;
        if (put && word == 6'h2C) segment_velocity_low <= wdata;
        if (put && word == 6'h2D) segment_velocity <= {wdata, segment_velocity_low};
        if (put && word == 6'h2E) segment_acceleration_low <= wdata;
        if (put && word == 6'h2F) segment_acceleration <= {wdata, segment_acceleration_low};
        if (put && word == 6'h30) segment_jerk <= wdata;
        segment_ticks_written <= put && word == 6'h31;
        if (put && word == 6'h31) segment_ticks <= wdata[23:0];
        if (put && word == 6'h31) segment_ticks_last <= wdata[24];
        if (put && word == 6'h32) stop_deceleration <= wdata;
        if (put && word == 6'h33) stop_jerk <= wdata;
        if (put && word == 6'h34) feed_override_fraction <= wdata[16:0];
        if (put && word == 6'h34) feed_override_pause <= wdata[17];
        if (put && word == 6'h35) feed_override_slope <= wdata;
        if (put && word == 6'h36) feed_override_curve <= wdata;
        if (put && word == 6'h37) start_at <= wdata;
        if (rst) begin
            rdata <= '0;
            control_enable <= 1'b0;
            control_closed_loop <= 1'b0;
            control_homing <= 1'b0;
            control_fine <= 1'b0;
            strobes_reset_faults <= 1'b0;
            strobes_set_target_to_position <= 1'b0;
            strobes_start <= 1'b0;
            strobes_controlled_stop <= 1'b0;
            strobes_arm <= 1'b0;
            fault_position_high <= '0;
            following_limit <= 32'h00000000;
            position_high <= '0;
            target_high <= '0;
            shift_origin_written <= 1'b0;
            shift_origin <= 32'h00000000;
            zero_crossing_up_held <= 1'b0;
            zero_crossing_down_held <= 1'b0;
            sensing_deglitch <= 16'h0010;
            sensing_outlier_step <= 8'h00;
            sensing_outlier_hold <= SINE != 0 ? 8'h03 : '0;
            amplitude_window_low <= 16'h0000;
            amplitude_window_high <= SINE != 0 ? 16'hFFFF : '0;
            disagreement_limit <= 20'h00000;
            encoder_events_illegal_edge_held <= 1'b0;
            encoder_events_overspeed_held <= 1'b0;
            encoder_events_amplitude_low_held <= 1'b0;
            encoder_events_amplitude_high_held <= 1'b0;
            encoder_events_disagreement_held <= 1'b0;
            encoder_events_pulse_too_short_held <= 1'b0;
            encoder_fault_mask <= 6'h00;
            rejected_pulses_count <= '0;
            rejected_samples_count <= '0;
            kp_written <= 1'b0;
            kp <= 24'h000000;
            ki <= 24'h000000;
            kd_written <= 1'b0;
            kd <= 24'h000000;
            kv_written <= 1'b0;
            kv <= 24'h000000;
            ka_written <= 1'b0;
            ka <= 24'h000000;
            servo_limits_output <= 15'h0000;
            servo_limits_integral <= 15'h0000;
            dead_band <= 16'h0000;
            open_command <= 16'h0000;
            filters_in_use <= 4'h0;
            filters_address <= 5'h00;
            filter_coefficient_written <= 1'b0;
            filter_coefficient <= 32'h00000000;
            segment_velocity_low <= '0;
            segment_velocity <= 64'h0000000000000000;
            segment_acceleration_low <= '0;
            segment_acceleration <= 64'h0000000000000000;
            segment_jerk <= 32'h00000000;
            segment_ticks_written <= 1'b0;
            segment_ticks <= 24'h000000;
            segment_ticks_last <= 1'b0;
            stop_deceleration <= 32'hFFFFFFFF;
            stop_jerk <= 32'h00000000;
            feed_override_fraction <= 17'h10000;
            feed_override_pause <= 1'b0;
            feed_override_slope <= 32'h00000000;
            feed_override_curve <= 32'h00000000;
            start_at <= 32'h00000000;
        end
    end
endmodule

`default_nettype wire
