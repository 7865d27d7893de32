// SPDX-License-Identifier: Apache-2.0
// step_generator -- draw a straight line from target to target and put it on the wire as steps for
// a stepper driver.
//
// latency  a tick takes target; k clk later the line is at start + (target - start) k / period, for
//          k = 1 … period. A whole step that it passes there is an active edge on the pin 1 clk
//          later, or as soon as the timings allow
// rate     one tick per `period` clk; one that comes sooner waits for the end of the line, and
//          takes target then. A step per 2 clk at most
// exact    Bresenham's line in units of 2^-16 / period step, which no tick loses: the wire is at
//          the floor of the line
// timings  high, low, set-up (direction to active edge) and hold (trailing edge to direction), as
//          they were set when they began. A driver's data sheet counts hold from the active edge:
//          this is never shorter
// modes    step and direction; quadrature: a on step, b on direction, an edge a step, a leads b
//          going up, levels stand for high + low; pulses: those going up on step, those going down
//          on direction
// enable   low: the pulse in hand is finished and target no longer followed. High again: the line
//          begins at the floor of the last target, so nothing jumps
// overrun  the wire owes more than 2^(PERIOD_W + AHEAD_W - 2) / period steps, or target was more
//          than 2^PERIOD_W steps from the end of the line before: the generator stands
// model    tb/drive/step_generator.py, equal in every bit of every cycle
// proved   whatever the inputs do, but for rst: steps moves with the pins, in every mode; high,
//          low, set-up and hold are never shorter than set; the pins change at the ends of a pulse
//          and with a turn, else only in the clk that takes mode and polarity, which is at rest and
//          out of enable
// proof    depth 14, PERIOD_W = 3, TIME_W = 3, AHEAD_W = 3
`default_nettype none

module step_generator #(
    parameter int PERIOD_W = 18,  // bits of period
    parameter int TIME_W   = 14,  // bits of the timings
    parameter int AHEAD_W  = 6    // bits more for the way that the line is ahead of the wire
) (
    input wire clk,
    input wire rst,  // the pins low at once
    input  wire        [PERIOD_W-1:0] period,       // clk from tick to tick; taken while not following; 0: not following
    input wire [TIME_W-1:0] high_cycles,  // least length of a pulse; 0 counts as 1, here and below
    input wire [TIME_W-1:0] low_cycles,  // least length of a gap
    input  wire        [TIME_W-1:0]   setup_cycles,    // least time from a change of direction to an active edge, at least 2
    input  wire        [TIME_W-1:0]   hold_cycles,     // least time from a trailing edge to a change of direction
    input  wire        [1:0]          mode,         // 0 step and direction; 1 quadrature; 2, 3 pulses; taken at rest while enable is low
    input wire step_low,  // step is active low; taken like mode
    input wire direction_low,  // direction is low going up (pulses: active low); taken like mode
    input wire enable,  // 1: follow target
    input wire load,  // strobe: begin the line restart at the floor of target
    input wire tick,  // strobe: draw a line to target
    input wire signed [47:0] target,  // Q32.16 steps, wraps
    output logic step,  // pin
    output logic direction,  // pin, high going up
    output logic signed [31:0]        steps,        // active edges on the wire since reset, those going down negative; wraps
    output logic overrun  // level, until load or enable low
);
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
    logic        [ P-1:0] line_clk;  // clk of a line
    logic        [ P-1:0] spent;  // clk of this line, from -line_clk - 1 to -2
    // inverted once here, not by a cell a bit in front of the adder
    logic        [  47:0] line_end_n;
    // 2^-16 step per line, which is 2^-16 / line_clk step per clk
    logic signed [  47:0] slope;
    logic                 waiting;  // a tick waits for the end of the line

    // the wire; ahead: where the line is, seen from the next step that the wire can make: due at 0
    // going up, below it going down
    logic signed [W+15:0] ahead;  // 2^-16 / line_clk step
    // turning: direction has changed since the last step
    logic pulse, upward, turning;
    // acted: a step or a turn; strays: the line is behind the step before
    logic acted, strays;
    // -2 when over: of the level; of direction's hold, and of its set-up when turning
    logic [TIME_W-1:0] stand, settle;
    logic [1:0] quarter, wire_mode;  // quarter: of the period of a and b
    // rewired: the pins take mode and polarity in this clk
    logic wire_step_low, wire_direction_low, rewired;

    wire restart = load || !enable || line_clk == '0;
    wire ended = &spent[P-1:1];
    wire start = (tick || waiting) && ended;
    wire steep = slope[47:P+16] != {(32 - P) {slope[47]}};

    // a step up: the next is one further; a turn: likewise
    wire back = upward == acted;
    wire signed [W-1:0] whole = W'($signed({1'b0, line_clk}));
    wire signed [W-1:0] moved = ahead[W+15:16] + (whole ^ {W{back}}) + W'(back);
    wire signed [W-1:0] now = acted ? moved : ahead[W+15:16];

    wire follows = !restart && !overrun && !acted && !rewired;
    wire stood = &stand[TIME_W-1:1];
    wire settled = &settle[TIME_W-1:1];
    wire due = upward != ahead[W+15];
    wire rise = follows && !pulse && stood && due && (settled || !turning);
    wire fall = pulse && stood;
    wire turns = follows && !pulse && settled && strays && !due;
    wire rest = !enable && !pulse && stood && settled;
    wire rewires = rest && {mode, step_low, direction_low} != {wire_mode, wire_step_low, wire_direction_low};

    wire pulse_next = rise || (pulse && !fall);
    wire upward_next = upward ^ turns;
    wire [1:0] quarter_next = quarter + {rise && !upward, rise};
    wire times = rise || fall || rewired;
    wire steadies = fall || turns || rewired;

    always_ff @(posedge clk) begin
        waiting <= (tick || waiting) && !start;
        if (start || !ended) spent <= start ? ~line_clk : spent + {P{start}} + 1'b1;
        if (start) slope <= target + $signed(line_end_n) + 48'sd1;
        else if (ended) slope <= '0;
        if (start) line_end_n <= ~target;
        ahead   <= {now, ahead[15:0]} + (W+16)'(slope);
        acted   <= rise || turns;
        strays  <= !acted && moved[W-1] == upward;
        if (steep || ahead[W+15] != ahead[W+14]) overrun <= 1'b1;
        if (restart) begin
            line_clk <= period;
            spent    <= '1;
            slope    <= '0;
            line_end_n <= ~{target[47:16], 16'd0};
            waiting  <= 1'b0;
            ahead    <= '0;
            acted    <= upward;
            strays   <= 1'b0;
            overrun  <= 1'b0;
        end

        if (times || !stood)
            stand <= times ? ~(rise ? high_cycles : low_cycles) : stand + {TIME_W{times}} + 1'b1;
        if (steadies || !settled)
            settle <= steadies ? ~(fall ? hold_cycles : setup_cycles) : settle + {TIME_W{steadies}} + 1'b1;
        pulse   <= pulse_next;
        upward  <= upward_next;
        turning <= turns || rewired || (turning && !rise);
        quarter <= quarter_next;
        steps   <= steps + {{31{rise && !upward}}, rise};
        rewired <= rewires;
        if (rewires)
            {wire_mode, wire_step_low, wire_direction_low} <= {mode, step_low, direction_low};
        case (wire_mode)
            STEP_DIRECTION: {step, direction} <= {pulse_next, upward_next} ^ {wire_step_low, wire_direction_low};
            QUADRATURE:     {step, direction} <= {^quarter_next, quarter_next[1]} ^ {wire_step_low, wire_direction_low};
            default:        {step, direction} <= {pulse_next && upward_next, pulse_next && !upward_next} ^ {wire_step_low, wire_direction_low};
        endcase
        if (rst) begin
            line_clk <= '0;
            {stand, settle} <= '1;
            {pulse, upward, turning, acted, rewired, quarter, steps}                 <= '0;
            {wire_mode, wire_step_low, wire_direction_low, step, direction} <= '0;
        end
    end
`ifdef FORMAL
    localparam int T = TIME_W;
    logic past = 1'b0;
    // clk that the level stands; since the timer settle began; saturate
    logic [T:0] stood_for, since, gap_ago, turn_ago;
    // timings as they were set: of stand, of settle, hold, set-up
    logic [T-1:0] asked, settling, held, set_up;

    function [T:0] later(input [T:0] clks);
        later = clks + {{T{1'b0}}, !clks[T]};
    endfunction

    wire [1:0] wire_pulse = {step, direction} ^ {wire_step_low, wire_direction_low};
    // quadrature: 00 10 11 01 of a, b are 0 1 2 3
    wire [1:0] wire_place = {wire_pulse[0], ^wire_pulse};
    always @(posedge clk) begin
        past      <= 1'b1;
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
            assert (stood   ? stood_for >= {1'b0, asked} && stood_for != 0 : {1'b0, T'(~stand)} + stood_for == {1'b0, asked} + 1'b1);
            assert (settled ? since >= {1'b0, settling} && since != 0 : {1'b0, T'(~settle)} + since == {1'b0, settling} + 1'b1);
            if (pulse || !turning) assert (turn_ago >= {1'b0, set_up});
            if (turning)
                assert (!pulse && since == turn_ago && settling == set_up && gap_ago >= {1'b0, held});
                else if (!pulse) assert (settling == held && since == gap_ago);
            if (pulse)
                assert (!turning && gap_ago >= {1'b0, held} || settling == held && since == gap_ago);
            // the timings
            if (rise) assert (stood_for >= {1'b0, asked} && turn_ago >= {1'b0, set_up});
            if (fall) assert (stood_for >= {1'b0, asked});
            if (turns || rewired) assert (!pulse && (turning || gap_ago >= {1'b0, held}));
            // the pins are what is timed
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
                assert (2'(wire_place - $past(wire_place)) == 2'(steps - $past(steps)));
            if (wire_mode == STEP_DIRECTION && !rewired && !$past(rewired))
                assert (steps - $past(
                    steps
                ) == (wire_pulse[1] && !$past(
                    wire_pulse[1]
                ) ? (wire_pulse[0] ? 1 : -1) : 0));
            if (wire_mode[1] && !rewired && !$past(rewired))
                assert (steps - $past(
                    steps
                ) == 32'(wire_pulse[1] && !$past(
                    wire_pulse[1]
                )) - 32'(wire_pulse[0] && !$past(
                    wire_pulse[0]
                )));
            if (!$past(enable)) assert (steps == $past(steps));
            if ({step, direction} != $past({step, direction}))
                assert ($past(rise || fall || turns || rewired));
            if (rewired) assert ($past(!enable && !pulse && stood && settled));
            cover (steps == 2 && wire_mode == STEP_DIRECTION);
            cover (steps == -2 && wire_mode == QUADRATURE && step_low);
            cover (turns && !upward && steps == -1 && held == 2);
            cover (overrun);
        end
    end
`endif
endmodule

`default_nettype wire
