// SPDX-License-Identifier: Apache-2.0
// motion -- move all axes of a node: pass their settings, their requests and their streamed
// set-points to the motion engine, and draw lines of motor steps from its targets.
//
// latency  see engine_bus, motion_engine, set_point_player and step_lines
// rate     see engine_bus, motion_engine, set_point_player and step_lines
// behaviour  Without HAS_VELOCITY there is no engine, without HAS_SET_POINTS no player of
//          set-points, and without HAS_STEPPER there are no lines of motor steps: what they would
//          report is 0.
// source   S0, S2, S3: one servo and one profile for each axis; here one datapath serves all axes
// model    the models of its blocks; tested together by tb/system
`default_nettype none

module motion #(
    parameter int AXES           = 1,  // axes of the node, 1 to 8
    parameter int FILTERS        = 0,  // filters of each servo, 0 to 4
    parameter int TICK_CYCLES    = 0,  // cycles between two ticks; 0: not checked
    parameter int HAS_VELOCITY   = 1,  // 1: build the engine
    parameter int HAS_SET_POINTS = 0,  // axes that can follow set-points; a mask, needs the engine
    parameter int HAS_STEPPER    = 1   // 1: build the lines of motor steps; needs the engine
) (
    input wire clk,
    input wire rst,
    // time
    input wire tick,  // strobe: servo tick
    input wire [17:0] tick_period,  // cycles between two ticks
    input wire [31:0] now,  // cycles, time stamp, wraps
    // register memory
    input wire stores,  // strobe: a word is stored
    input wire [13:0] stored_at,  // word of the register map
    input wire [31:0] stored_value,  // bits of its settings, sign-extended
    input wire [31:0] wdata_low,  // low word of a value of 64 bits
    output logic hold,  // level: no first value may be stored
    output logic waits,  // level: the soft core must wait
    // the axes, bit n or the bits from 48 n on: axis n
    input wire [48*AXES-1:0] position,  // 2^-16 period
    input wire [AXES-1:0] step_made,  // strobes: position moves in the next cycle
    input wire [AXES-1:0] step_down,  // levels: with step_made, it goes down
    input wire [AXES-1:0] moves,  // levels: position will jump
    input wire [AXES-1:0] moved,  // strobes: position jumps by moved_by in the next cycle
    input wire [48*AXES-1:0] moved_by,  // 2^-16 period, signed
    input wire [AXES-1:0] block_up,  // levels: no positive command passes
    input wire [AXES-1:0] block_down,  // levels: no negative command passes
    input wire [AXES-1:0] closed_loop,  // levels: the servo commands the drive
    input wire [24*AXES-1:0] take_up,  // 2^-16 period, by which the motor is before the table
    input wire [AXES-1:0] enabled,  // levels: the drive is on
    // requests, bit n: axis n
    input wire [AXES-1:0] play,  // strobes: play the queued segments
    input wire [AXES-1:0] arm,  // strobes: play them at start_at
    input wire [AXES-1:0] controlled_stop,  // strobes: stop, and empty the queue
    input wire [AXES-1:0] hold_target,  // strobes: target := position
    output logic [AXES-1:0] request_waits,  // levels: a request is not done yet
    input wire [AXES-1:0] pending,  // levels: a request is not done and shown
    // streamed set-points, for the registers
    output logic [31:0] tick_count,  // servo ticks since reset
    output logic [32*AXES-1:0] stream_states,  // state of the stream of each axis
    output logic [32*AXES-1:0] stream_counts,  // counts of set-points of each axis
    // results, as in motion_engine
    output logic result_valid,  // strobe: result is new
    output logic integral_valid,  // strobe: result is the integral
    output logic [2:0] result_axis,  // number of its axis
    output logic [2:0] result_kind,  // number of what it is
    output logic [47:0] result,  // value, signed
    output logic result_flag,  // level: its flag
    // schedule
    output logic servo_overrun,  // strobe: a tick came before the last one was served
    output logic [15:0] cycles,  // cycles that a tick needs at most
    // lines of motor steps
    output logic line_start,  // strobe: the lines begin
    output logic line_idle,  // level: the lines have ended
    output logic [AXES-1:0] rate_valid,  // strobes: the rate of the next line is new
    output logic signed [36:0] rate,  // 2^-36 motor step per cycle, with rate_valid
    output logic rate_restart,  // level: that line begins at a whole step
    output logic rate_steep,  // level: that line is too steep
    input wire [AXES-1:0] line_stopped  // levels: no line is followed until a restart
);
    localparam [2:0] STEPS = 3'd6;  // kind of result, as in tables/engine_microcode.py

    if (HAS_VELOCITY != 0) begin : g_engine
        wire ready, setting_write, setting_waits;
        wire        [ 2:0] setting_axis;
        wire        [ 6:0] setting_word;
        wire        [ 1:0] setting_filter;
        wire signed [63:0] setting;
        wire [AXES-1:0] gains_changed, push;
        wire signed [47:0] shift_by;
        wire               busy;
        wire [AXES-1:0] streamed, stream_start, stream_stop;
        wire piece_valid, piece_taken, settled;
        wire        [ 2:0] piece_axis;
        wire        [ 1:0] piece_part;
        wire signed [63:0] piece_word;

        if (HAS_SET_POINTS % (1 << AXES) != 0) begin : g_set_points
            set_point_player #(
                .AXES(AXES),
                .MASK(HAS_SET_POINTS)
            ) u_player (
                .clk,
                .rst,
                .tick,
                // register memory
                .stores,
                .stored_at,
                .stored_value,
                .wdata_low,
                // the axes
                .enabled,
                .stops (controlled_stop | hold_target),
                // results
                .result_valid,
                .result_axis,
                .result_kind,
                .result,
                // pieces
                .streamed,
                .piece_valid,
                .piece_axis,
                .piece_part,
                .piece_word,
                .piece_taken,
                .settled,
                // requests
                .start (stream_start),
                .stop  (stream_stop),
                // registers
                .tick_count,
                .states(stream_states),
                .counts(stream_counts)
            );
        end else begin : g_no_set_points
            assign {streamed, stream_start, stream_stop} = '0;
            assign {piece_valid, piece_axis, piece_part, piece_word} = '0;
            assign {tick_count, stream_states, stream_counts} = '0;

            wire unused = &{1'b0, enabled, piece_taken, settled};
        end

        engine_bus #(
            .AXES   (AXES),
            .FILTERS(FILTERS)
        ) u_bus (
            .clk,
            .rst,
            // register memory
            .stores,
            .address  (stored_at),
            .value    (stored_value),
            .value_low(wdata_low),
            .hold,
            .waits,
            // pieces
            .streamed,
            .piece_valid,
            .piece_axis,
            .piece_part,
            .piece_word,
            .piece_taken,
            .settled,
            // settings
            .ready,
            .setting_waits,
            .setting_write,
            .setting_axis,
            .setting_word,
            .setting_filter,
            .setting,
            // requests
            .gains_changed,
            .push,
            .pending,
            .moves,
            .moved,
            .moved_by,
            .shift_by
        );
        motion_engine #(
            .AXES       (AXES),
            .FILTERS    (FILTERS),
            .TICK_CYCLES(TICK_CYCLES)
        ) u_engine (
            .clk,
            .rst,
            .tick,
            .now,
            // settings
            .setting_write,
            .setting_axis,
            .setting_word,
            .setting_filter,
            .setting,
            .setting_waits,
            // the axes
            .position,
            .stepped               (step_made),
            .downward              (step_down),
            .block_up,
            .block_down,
            .closed_loop,
            .take_up,
            // requests
            .start                 (play | stream_start),
            .arm,
            .controlled_stop       (controlled_stop | stream_stop),
            .set_target_to_position(hold_target),
            .push,
            .gains_changed,
            .shift                 (moved),
            .shift_by,
            .waits                 (request_waits),
            // results
            .result_valid,
            .integral_valid,
            .result_axis,
            .result_kind,
            .result,
            .result_flag,
            // schedule
            .ready,
            .busy,
            .overrun               (servo_overrun),
            .cycles
        );

        wire unused = &{1'b0, busy};
    end else begin : g_no_engine
        assign {hold, waits, request_waits} = '0;
        assign {result_valid, integral_valid, result_axis, result_kind, result, result_flag} = '0;
        assign {servo_overrun, cycles} = '0;
        assign {tick_count, stream_states, stream_counts} = '0;

        wire unused_time = &{1'b0, clk, rst, tick, now};
        wire unused_registers = &{1'b0, stores, stored_at, stored_value, wdata_low};
        wire unused_axes = &{
            1'b0, position, step_made, step_down, moves, moved, moved_by, block_up, block_down,
            closed_loop, take_up
        };
        wire unused_requests = &{1'b0, play, arm, controlled_stop, hold_target, pending, enabled};
    end
    if (HAS_STEPPER != 0) begin : g_lines
        step_lines #(
            .AXES(AXES)
        ) u_lines (
            .clk,
            .rst,
            .period    (tick_period),
            .tick,
            // targets
            .valid     (result_valid && result_kind == STEPS),
            .axis      (result_axis),
            .target    (result),
            .restart_in(result_flag),
            .stopped   (line_stopped),
            // lines
            .line_start,
            .line_idle,
            .rate_valid,
            .rate,
            .rate_restart,
            .rate_steep
        );
    end else begin : g_no_lines
        assign {line_start, line_idle, rate_valid, rate, rate_restart, rate_steep} = '0;
        wire unused = &{1'b0, tick_period, line_stopped};
    end
endmodule

`default_nettype wire
