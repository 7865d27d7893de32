// SPDX-License-Identifier: Apache-2.0
// step_generator -- draw a straight line from target to target and output it as steps for a stepper
// motor driver.
//
// latency   1 cycle from the line passing a whole step to the active edge on the pin, or as soon as
//           the pin timings allow. A tick takes target; k cycles later the line is at start +
//           (target - start) k / period, for k = 1 … period.
// rate      one tick per `period` cycles; a tick that comes sooner waits for the end of the line
//           and takes target then. At most one step per 2 cycles is made.
// accuracy  Bresenham's line in units of 2^-16 / period step, so that no tick loses anything: the
//           number of steps made is the floor of the line.
// behaviour Four timings apply as they were set when they began: high, low, set-up (from direction
//           to active edge) and hold (from trailing edge to direction). A driver's data sheet
//           counts the hold time from the active edge, so this one is never shorter. Modes: step
//           and direction; quadrature, with a on step and b on direction, one edge per step, where
//           a leads b going up and a level lasts high + low; up pulses on step and down pulses on
//           direction. When enable falls, a running pulse is finished and the target is no longer
//           followed. When it rises again, the line begins at the floor of the last target, so that
//           nothing jumps.
// limits    overrun stops the generator when more than 2^(PERIOD_W + AHEAD_W - 2) / period steps
//           are still to be made, or when target is more than 2^PERIOD_W steps from the end of the
//           last line.
// model     tb/drive/step_generator.py, equal in every bit of every cycle
// proved    Whatever the inputs do, without rst: steps moves with the pins, in every mode; high,
//           low, set-up and hold are never shorter than set; the pins change at the ends of a pulse
//           and with a turn, otherwise only in the cycle that takes mode and polarity, which is at
//           standstill and while enable is low.
// proof     depth 14, PERIOD_W = 3, TIME_W = 3, AHEAD_W = 3
`default_nettype none

module step_generator #(
    parameter int PERIOD_W = 18,  // bits of period
    parameter int TIME_W   = 14,  // bits of the timings
    parameter int AHEAD_W  = 6    // extra bits for the steps that are still to be made
) (
    input  wire                        clk,
    input  wire                        rst,
    input  wire         [PERIOD_W-1:0] period,         // cycles per tick; 0: follow nothing
    input  wire         [  TIME_W-1:0] high_cycles,    // cycles, least pulse length; 0 counts as 1
    input  wire         [  TIME_W-1:0] low_cycles,     // cycles, least gap; 0 counts as 1
    input  wire         [  TIME_W-1:0] setup_cycles,   // cycles, least set-up time; at least 2
    input  wire         [  TIME_W-1:0] hold_cycles,    // cycles, least hold time; 0 counts as 1
    input  wire         [         1:0] mode,           // number: 0 step/dir, 1 quadrature, 2 pulses
    input  wire                        step_low,       // level: step is active low
    input  wire                        direction_low,  // level: direction is active low
    input  wire                        enable,         // level: follow target
    input  wire                        load,           // strobe: begin the line at floor(target)
    input  wire                        tick,           // strobe: draw a line to target
    input  wire signed  [        47:0] target,         // 2^-16 step, wraps
    output logic                       step,           // level: pin
    output logic                       direction,      // level: pin, high going up
    output logic signed [        31:0] steps,          // steps made since reset; wraps
    output logic                       overrun         // level: stopped until load or enable low
);
    // period is taken while the target is not followed; mode and polarities are taken at standstill
    // while enable is low. Mode 3 means pulses too.
    if (PERIOD_W < 2 || PERIOD_W > 30) begin : g_check_period
        PERIOD_W_MUST_BE_FROM_2_TO_30 u_error ();
    end
    if (TIME_W < 2) begin : g_check_time
        TIME_W_MUST_BE_AT_LEAST_2 u_error ();
    end
    if (AHEAD_W < 3) begin : g_check_ahead
        AHEAD_W_MUST_BE_AT_LEAST_3 u_error ();
    end

    localparam logic [1:0] STEP_DIRECTION = 0, QUADRATURE = 1;
    localparam int P = PERIOD_W;
    localparam int W = PERIOD_W + AHEAD_W;

    // the line
    logic        [ P-1:0] line_cycles;  // length of a line
    logic        [ P-1:0] spent;  // position in this line, from -line_cycles - 1 to -2
    // stored inverted, which saves one cell per bit in front of the adder
    logic        [  47:0] line_end_n;
    // 2^-16 step per line, which is 2^-16 / line_cycles step per cycle
    logic signed [  47:0] slope;
    logic                 waiting;  // a tick waits for the end of the line

    // the pins; ahead is the line's distance from the next step that the pins can make: a step up
    // is due from 0 on, a step down below 0
    logic signed [W+15:0] ahead;  // 2^-16 / line_cycles step
    // turning: direction has changed since the last step
    logic pulse, upward, turning;
    // acted: a step or a turn was made; reverses: the line is behind the last step made
    logic acted, reverses;
    // timers that stop at -2: of the level; of direction's hold time, or its set-up time in a turn
    logic [TIME_W-1:0] level_timer, direction_timer;
    logic [1:0] quarter, wire_mode;  // quarter: phase of a and b
    // rewired: the pins take mode and polarity in this cycle
    logic wire_step_low, wire_direction_low, rewired;

    wire restart = rst || load || !enable || line_cycles == '0;
    wire ended = &spent[P-1:1];
    wire start = (tick || waiting) && ended;
    wire steep = slope[47:P+16] != {(32 - P) {slope[47]}};

    // after a step the next one is one step further away, and so it is after a turn
    wire back = upward == acted;
    wire signed [W-1:0] whole = W'($signed({1'b0, line_cycles}));
    wire signed [W-1:0] moved = ahead[W+15:16] + (whole ^ {W{back}}) + W'(back);
    wire signed [W-1:0] now = acted ? moved : ahead[W+15:16];

    wire follows = !restart && !overrun && !acted && !rewired;
    wire level_over = &level_timer[TIME_W-1:1];
    wire direction_over = &direction_timer[TIME_W-1:1];
    wire due = upward != ahead[W+15];
    wire rise = follows && !pulse && level_over && due && (direction_over || !turning);
    wire fall = pulse && level_over;
    wire turns = follows && !pulse && direction_over && reverses && !due;
    wire standstill = !enable && !pulse && level_over && direction_over;
    wire [3:0] wiring = {mode, step_low, direction_low};
    wire rewires = standstill && wiring != {wire_mode, wire_step_low, wire_direction_low};

    wire pulse_next = rise || (pulse && !fall);
    wire upward_next = upward ^ turns;
    wire [1:0] quarter_next = quarter + {rise && !upward, rise};
    wire times = rise || fall || rewired;
    wire steadies = fall || turns || rewired;

    // what the pins show if both are active high
    logic [1:0] active;
    always_comb begin
        case (wire_mode)
            STEP_DIRECTION: active = {pulse_next, upward_next};
            QUADRATURE:     active = {^quarter_next, quarter_next[1]};
            default:        active = {pulse_next && upward_next, pulse_next && !upward_next};
        endcase
    end

    always_ff @(posedge clk) begin
        waiting <= (tick || waiting) && !start;
        if (start || !ended) spent <= start ? ~line_cycles : spent + {P{start}} + 1'b1;
        if (start) slope <= target + $signed(line_end_n) + 48'sd1;
        else if (ended) slope <= '0;
        if (start) line_end_n <= ~target;
        ahead    <= {now, ahead[15:0]} + (W+16)'(slope);
        acted    <= rise || turns;
        reverses <= !acted && moved[W-1] == upward;
        if (steep || ahead[W+15] != ahead[W+14]) overrun <= 1'b1;
        if (restart) begin
            line_cycles <= period;
            spent       <= '1;
            slope       <= '0;
            line_end_n  <= ~{target[47:16], 16'd0};
            waiting     <= 1'b0;
            ahead       <= '0;
            acted       <= upward;
            reverses    <= 1'b0;
            overrun     <= 1'b0;
        end

        if (times || !level_over)
            level_timer <= times ? ~(rise ? high_cycles : low_cycles)
                           : level_timer + {TIME_W{times}} + 1'b1;
        if (steadies || !direction_over)
            direction_timer <= steadies ? ~(fall ? hold_cycles : setup_cycles)
                               : direction_timer + {TIME_W{steadies}} + 1'b1;
        pulse   <= pulse_next;
        upward  <= upward_next;
        turning <= turns || rewired || (turning && !rise);
        quarter <= quarter_next;
        steps   <= steps + {{31{rise && !upward}}, rise};
        rewired <= rewires;
        if (rewires)
            {wire_mode, wire_step_low, wire_direction_low} <= {mode, step_low, direction_low};
        {step, direction} <= active ^ {wire_step_low, wire_direction_low};
        if (rst) begin
            line_cycles <= '0;
            {level_timer, direction_timer} <= '1;
            {pulse, upward, turning, acted, rewired, quarter, steps} <= '0;
            {wire_mode, wire_step_low, wire_direction_low, step, direction} <= '0;
        end
    end
`ifdef FORMAL
    localparam int T = TIME_W;
    logic past = 1'b0;
    // cycles since the level timer began, the direction timer began, the last gap, the last turn
    logic [T:0] stood_for, since, gap_ago, turn_ago;
    // timings as they were set: of the level timer, of the direction timer, hold, set-up
    logic [T-1:0] asked, settling, held, set_up;
    logic [1:0] place_q, pulse_q;
    logic [31:0] steps_q;

    function [T:0] later(input [T:0] cycles);
        later = cycles + {{T{1'b0}}, !cycles[T]};
    endfunction

    wire [1:0] wire_pulse = {step, direction} ^ {wire_step_low, wire_direction_low};
    // quadrature: 00 10 11 01 of a, b are 0 1 2 3
    wire [1:0] wire_place = {wire_pulse[0], ^wire_pulse};
    wire signed [31:0] made = steps - steps_q;
    // pulses that have begun: up, down; active edges of step
    wire up_began = wire_pulse[1] && !pulse_q[1];
    wire down_began = wire_pulse[0] && !pulse_q[0];
    wire in_hold = settling == held && since == gap_ago;
    wire [T:0] level_left = {1'b0, T'(~level_timer)}, direction_left = {1'b0, T'(~direction_timer)};
    always @(posedge clk) begin
        past      <= 1'b1;
        place_q   <= wire_place;
        pulse_q   <= wire_pulse;
        steps_q   <= steps;
        stood_for <= times ? 1 : later(stood_for);
        since     <= steadies ? 1 : later(since);
        gap_ago   <= fall ? 1 : later(gap_ago);
        turn_ago  <= turns || rewired ? 1 : later(turn_ago);
        if (times) asked <= rise ? high_cycles : low_cycles;
        if (steadies) settling <= fall ? hold_cycles : setup_cycles;
        if (fall) held <= hold_cycles;
        if (turns || rewired) set_up <= setup_cycles;
        if (rst || !past) begin
            {stood_for, since, gap_ago, turn_ago} <= {4{1'b1, {T{1'b0}}}};
            {asked, settling, held, set_up} <= '0;
        end
        if (!past) assume (rst);
        if (past) begin
            // what the timers mean
            if (level_over) begin
                assert (stood_for >= {1'b0, asked} && stood_for != 0);
            end else begin
                assert (level_left + stood_for == {1'b0, asked} + 1'b1);
            end
            if (direction_over) begin
                assert (since >= {1'b0, settling} && since != 0);
            end else begin
                assert (direction_left + since == {1'b0, settling} + 1'b1);
            end
            if (pulse || !turning) assert (turn_ago >= {1'b0, set_up});
            if (turning) assert (!pulse && since == turn_ago && settling == set_up);
            if (turning) assert (gap_ago >= {1'b0, held});
            if (!turning && !pulse) assert (in_hold);
            if (pulse) assert (!turning && gap_ago >= {1'b0, held} || in_hold);
            // the timings
            if (rise) assert (stood_for >= {1'b0, asked} && turn_ago >= {1'b0, set_up});
            if (fall) assert (stood_for >= {1'b0, asked});
            if (turns || rewired) assert (!pulse && (turning || gap_ago >= {1'b0, held}));
            // the timed levels are those of the pins
            if (!rewired)
                case (wire_mode)
                    STEP_DIRECTION: assert (wire_pulse == {pulse, upward});
                    QUADRATURE:     assert (wire_place == quarter);
                    default:        assert (wire_pulse == {pulse && upward, pulse && !upward});
                endcase
            if (!overrun) assert (!steep || $past(start));
        end
        if (past && !$past(rst)) begin
            // steps moves with the pins
            if (wire_mode == QUADRATURE && !rewired && !$past(rewired))
                assert (2'(wire_place - place_q) == 2'(made));
            if (wire_mode == STEP_DIRECTION && !rewired && !$past(rewired))
                assert (made == (up_began ? (wire_pulse[0] ? 1 : -1) : 0));
            if (wire_mode[1] && !rewired && !$past(rewired))
                assert (made == 32'(up_began) - 32'(down_began));
            if (!$past(enable)) assert (made == 0);
            if ({step, direction} != $past({step, direction}))
                assert ($past(rise || fall || turns || rewired));
            if (rewired) assert ($past(!enable && !pulse && level_over && direction_over));
            cover (steps == 2 && wire_mode == STEP_DIRECTION);
            cover (steps == -2 && wire_mode == QUADRATURE && step_low);
            cover (turns && !upward && steps == -1 && held == 2);
            cover (overrun);
        end
    end
`endif
endmodule

`default_nettype wire
