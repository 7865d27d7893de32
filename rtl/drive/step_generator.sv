// SPDX-License-Identifier: Apache-2.0
// step_generator -- send steps to a stepper motor driver along straight lines, whose rates come
// from step_lines.
//
// latency   1 cycle from the line passing a whole step to the active edge on the pin, or as soon as
//           the pin timings allow. The line moves by its rate in each cycle from the one after
//           line_start on, until line_idle.
// rate      one line per 2 cycles, one step per 2 cycles
// accuracy  The line is exact in 2^-RATE_F step; the number of steps made is its floor.
// behaviour Four timings apply: high, low, set-up (from direction to active edge) and hold (from
//           trailing edge to direction). A new value counts at once. A driver's data sheet counts
//           the hold time from the active edge, so this one is never shorter. Modes: step
//           and direction; quadrature, with a on step and b on direction, one edge per step, where
//           a leads b going up and a level lasts high + low; up pulses on step and down pulses on
//           direction. When enable falls, a running pulse is finished and the line is no longer
//           followed. When it is high again, the first line with rate_restart begins at a whole
//           step, so that nothing jumps.
// limits    overrun stops the generator when more than 2^(AHEAD_W - 2) steps are still to be made,
//           and at a line with rate_steep.
// model     tb/drive/step_generator.py, equal in every bit of every cycle
// proved    Whatever the inputs do, without rst and as long as the timings do not change: steps
//           moves with pulse and with the pins, in every mode; high, low, set-up and hold are never
//           shorter than set; the pins change at the ends of a pulse and with a turn, otherwise
//           only in the cycle that takes mode and polarity, which is at standstill and while enable
//           is low.
// proof     depth 18, TIME_W = 3, RATE_F = 3, AHEAD_W = 4
`default_nettype none

module step_generator #(
    parameter int TIME_W  = 14,  // bits of the timings
    parameter int RATE_F  = 36,  // bits of a rate below 1 step per cycle
    parameter int AHEAD_W = 10   // bits of the steps that are still to be made
) (
    input  wire                      clk,
    input  wire                      rst,
    input  wire         [TIME_W-1:0] high_cycles,    // cycles, least pulse length; 0 counts as 1
    input  wire         [TIME_W-1:0] low_cycles,     // cycles, least gap; 0 counts as 1
    input  wire         [TIME_W-1:0] setup_cycles,   // cycles, least set-up time; at least 2
    input  wire         [TIME_W-1:0] hold_cycles,    // cycles, least hold time; 0 counts as 1
    input  wire         [       1:0] mode,           // number: 0 step/dir, 1 quadrature, 2 pulses
    input  wire                      step_low,       // level: step is active low
    input  wire                      direction_low,  // level: direction is active low
    input  wire                      enable,         // level: follow the lines
    input  wire                      line_start,     // strobe: a line begins
    input  wire                      line_idle,      // level: the line has ended
    input  wire                      rate_valid,     // strobe: the rate of the next line is new
    input  wire signed  [  RATE_F:0] rate,           // 2^-RATE_F step per cycle, with rate_valid
    input  wire                      rate_restart,   // level: that line begins at a whole step
    input  wire                      rate_steep,     // level: that line is too steep
    output logic                     stopped,        // level: no line is followed until a restart
    output logic                     step,           // level: pin
    output logic                     direction,      // level: pin, high going up
    output logic                     pulse,          // level: a step is made, in every mode
    output logic                     upward,         // level: that step and the next go up
    output logic signed [      31:0] steps,          // steps made since reset; wraps
    output logic                     overrun         // level: stopped until restart or enable low
);
    // mode and polarities are taken at standstill while enable is low. Mode 3 means pulses too.
    if (TIME_W < 2) begin : g_check_time
        TIME_W_MUST_BE_AT_LEAST_2 u_error ();
    end
    if (AHEAD_W < 4) begin : g_check_ahead
        AHEAD_W_MUST_BE_AT_LEAST_4 u_error ();
    end

    localparam logic [1:0] STEP_DIRECTION = 0, QUADRATURE = 1;
    localparam int W = AHEAD_W + RATE_F;

    // the next line, and the one that is drawn
    logic signed [RATE_F:0] next_rate, slope;  // 2^-RATE_F step per cycle
    logic next_restart, next_steep;

    // the pins; ahead is the line's distance from the next step that the pins can make: a step up
    // is due from 0 on, a step down below 0
    logic signed [W-1:0] ahead;  // 2^-RATE_F step
    // turning: direction has changed since the last step
    logic                turning;
    // acted: a step or a turn was made; reverses: the line is behind the last step made
    logic acted, reverses;
    // cycles since the level began; since the hold time began, or the set-up time in a turn; both
    // stop at their limits
    logic [TIME_W-1:0] level_age, direction_age;
    logic [1:0] quarter, wire_mode;  // quarter: phase of a and b
    // rewired: the pins take mode and polarity in this cycle
    logic wire_step_low, wire_direction_low, rewired;

    wire restart = rst || !enable || stopped || (line_start && next_restart);
    wire behind = ahead[W-1];
    wire [AHEAD_W-1:0] whole = ahead[W-1:RATE_F];  // steps, the floor

    // after a step the next one is one step further away, and so it is after a turn
    wire back = upward == acted;
    wire fall_off = slope[RATE_F] ? !acted || back : acted && back;
    wire signed [W-1:0] change = {
        {AHEAD_W - 1{fall_off}}, slope[RATE_F] ^ acted, slope[RATE_F-1:0]
    };

    wire follows = !restart && !overrun && !acted && !rewired;
    // A number counted up from 0 contains all bits of another one for the first time when they are
    // equal. The comparison needs no adder.
    wire level_over = &(level_age | ~(pulse ? high_cycles : low_cycles));
    wire direction_over = &(direction_age | ~(turning ? setup_cycles : hold_cycles));
    wire due = upward != behind;
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
        if (line_start) slope <= next_rate;
        if (line_start || rst) {next_rate, next_restart, next_steep} <= '0;
        if (rate_valid) begin
            next_rate <= rate;
            {next_restart, next_steep} <= {rate_restart, rate_steep};
        end
        if (!enable || (line_start && next_restart)) stopped <= !enable;
        ahead    <= ahead + change;
        acted    <= rise || turns;
        reverses <= !acted && behind == upward && whole != {AHEAD_W{behind}};
        if (!restart && ((line_start && next_steep) || behind != ahead[W-2])) overrun <= 1'b1;
        if (line_idle || restart) slope <= '0;
        if (restart) begin
            ahead    <= '0;
            acted    <= upward;
            reverses <= 1'b0;
        end
        if (!enable || (line_start && next_restart)) overrun <= 1'b0;

        level_age     <= times ? TIME_W'(1) : level_over ? level_age : level_age + 1'b1;
        direction_age <= steadies ? TIME_W'(1)
                         : direction_over ? direction_age : direction_age + 1'b1;
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
            {level_age, direction_age} <= '1;
            {pulse, upward, turning, acted, rewired, quarter, steps, overrun} <= '0;
            {wire_mode, wire_step_low, wire_direction_low, step, direction} <= '0;
            stopped <= 1'b1;
        end
    end

`ifdef FORMAL
    localparam int T = TIME_W;
    logic past = 1'b0;
    // cycles since the level began, the hold time or the set-up time began, the last gap, the last
    // turn
    logic [T:0] stood_for, since, gap_ago, turn_ago;
    logic [1:0] place_q, pulse_q;
    logic [31:0] steps_q;

    function [T:0] later(input [T:0] cycles);
        later = cycles + {{T{1'b0}}, !cycles[T]};
    endfunction

    wire        [4*T-1:0] timings = {high_cycles, low_cycles, setup_cycles, hold_cycles};
    wire        [    1:0] wire_pulse = {step, direction} ^ {wire_step_low, wire_direction_low};
    // quadrature: 00 10 11 01 of a, b are 0 1 2 3
    wire        [    1:0] wire_place = {wire_pulse[0], ^wire_pulse};
    wire signed [   31:0] made = steps - steps_q;
    // pulses that have begun: up, down; active edges of step
    wire                  up_began = wire_pulse[1] && !pulse_q[1];
    wire                  down_began = wire_pulse[0] && !pulse_q[0];
    always @(posedge clk) begin
        past      <= 1'b1;
        place_q   <= wire_place;
        pulse_q   <= wire_pulse;
        steps_q   <= steps;
        stood_for <= times ? 1 : later(stood_for);
        since     <= steadies ? 1 : later(since);
        gap_ago   <= fall ? 1 : later(gap_ago);
        turn_ago  <= turns || rewired ? 1 : later(turn_ago);
        if (rst || !past) {stood_for, since, gap_ago, turn_ago} <= {4{1'b1, {T{1'b0}}}};
        if (!past) assume (rst);
        if (past) assume (timings == $past(timings));
        if (past) begin
            // what the ages mean
            assert (level_age != '0 && stood_for >= {1'b0, level_age});
            assert (direction_age != '0 && since >= {1'b0, direction_age});
            if (!level_over) assert (stood_for == {1'b0, level_age});
            if (!pulse && !direction_over) assert (since == {1'b0, direction_age});
            if (pulse || !turning) assert (turn_ago >= {1'b0, setup_cycles});
            if (turning) assert (!pulse && since == turn_ago && gap_ago >= {1'b0, hold_cycles});
            if (!turning && !pulse) assert (since == gap_ago);
            if (pulse) assert (!turning && (gap_ago >= {1'b0, hold_cycles} || since == gap_ago));
            // the timings
            if (rise) assert (stood_for >= {1'b0, low_cycles} && turn_ago >= {1'b0, setup_cycles});
            if (fall) assert (stood_for >= {1'b0, high_cycles});
            if (turns || rewired) assert (!pulse && (turning || gap_ago >= {1'b0, hold_cycles}));
            // the timed levels are those of the pins
            if (!rewired)
                case (wire_mode)
                    STEP_DIRECTION: assert (wire_pulse == {pulse, upward});
                    QUADRATURE:     assert (wire_place == quarter);
                    default:        assert (wire_pulse == {pulse && upward, pulse && !upward});
                endcase
            if (stopped) assert (!rise && !turns);
        end
        if (past && !$past(rst)) begin
            // steps moves with pulse and upward, and with the pins
            assert (made == (pulse && !$past(pulse) ? (upward ? 1 : -1) : 0));
            if (wire_mode == QUADRATURE && !rewired && !$past(rewired))
                assert (2'(wire_place - place_q) == 2'(made));
            if (wire_mode == STEP_DIRECTION && !rewired && !$past(rewired))
                assert (made == (up_began ? (wire_pulse[0] ? 1 : -1) : 0));
            if (wire_mode[1] && !rewired && !$past(rewired))
                assert (made == 32'(up_began) - 32'(down_began));
            if (!$past(enable)) assert (made == 0 && stopped);
            if ({step, direction} != $past({step, direction}))
                assert ($past(rise || fall || turns || rewired));
            if (rewired) assert ($past(!enable && !pulse && level_over && direction_over));
            cover (steps == 2 && wire_mode == STEP_DIRECTION);
            cover (steps == -2 && wire_mode == QUADRATURE && step_low);
            cover (turns && !upward && steps == -1 && hold_cycles == 2);
            cover (overrun);
        end
    end
`endif
endmodule

`default_nettype wire
