// SPDX-License-Identifier: Apache-2.0
// step_lines -- draw a straight line from target to target for the step generators of all axes: a
// common beginning and length, and a rate for each axis, computed by one divider.
//
// latency   RATE_F + 4 cycles from a target to its rate, and as many for each axis before it. The
//           line to a target begins with the first line_start after that.
// rate      one tick per `period` cycles; a tick that comes sooner waits for the end of the lines,
//           unless no axis follows them. One target of each axis per line; of two, the later one
//           counts.
// accuracy  A line ends less than period * 2^-RATE_F step above its target, and the next one begins
//           there, so that no tick loses anything.
// method    rate = floor((distance * 2^(RATE_F - 16) + remainder) / period), where the remainder
//           of the division is saved for the next line. It begins as period - 1, which rounds up: a
//           line that leads up to a whole step is never late. Restoring division, a bit per cycle.
// behaviour The first line after `stopped`, and one to a target with restart_in, has the rate 0 and
//           begins and ends at the whole step below the target (rate_restart). A target that is a
//           step per cycle or more away has no rate (rate_steep).
// limits    period may change only while no axis moves. AXES * (RATE_F + 4) cycles must be less
//           than what is left of a tick when the last target comes.
// model     tb/drive/step_lines.py, equal in every bit of every cycle
// proved    Lines begin at least `period` cycles apart, unless no axis follows them. A rate that
//           was given is never replaced before a line has begun with it.
// proof     depth 12, AXES = 2, PERIOD_W = 3, RATE_F = 20
`default_nettype none

module step_lines #(
    parameter int AXES     = 1,   // axes, 1 to 8
    parameter int PERIOD_W = 18,  // bits of period, at most RATE_F - 16
    parameter int RATE_F   = 36   // bits of a rate below 1 step per cycle
) (
    input  wire                        clk,
    input  wire                        rst,
    input  wire         [PERIOD_W-1:0] period,        // cycles per tick; 0: no lines
    input  wire                        tick,          // strobe: begin the next lines
    // targets
    input  wire                        valid,         // strobe: target is new
    input  wire         [         2:0] axis,          // number of its axis
    input  wire         [        47:0] target,        // 2^-16 step, signed, wraps
    input  wire                        restart_in,    // level: with valid, begin there
    input  wire         [    AXES-1:0] stopped,       // levels: the step generator needs a restart
    // lines
    output logic                       line_start,    // strobe: the lines begin
    output logic                       line_idle,     // level: the lines have ended
    output logic        [    AXES-1:0] rate_valid,    // strobes: the rate of the next line is new
    output logic signed [    RATE_F:0] rate,          // 2^-RATE_F step per cycle, with rate_valid
    output logic                       rate_restart,  // level: that line begins at a whole step
    output logic                       rate_steep     // level: that line is too steep
);
    if (AXES < 1 || AXES > 8) begin : g_check_axes
        AXES_MUST_BE_FROM_1_TO_8 u_error ();
    end
    if (PERIOD_W < 2 || RATE_F < PERIOD_W + 16) begin : g_check_rate
        RATE_F_MUST_BE_AT_LEAST_PERIOD_W_PLUS_16 u_error ();
    end

    localparam int P = PERIOD_W;
    localparam int BITS = RATE_F + 1;  // of a quotient
    localparam int A = AXES > 1 ? $clog2(AXES) : 1;

    // the common line
    logic [P-1:0] left;  // cycles left of the lines, less one; of no effect while no axis follows
    logic         waiting;  // a tick waits for their end

    wire          ended = left == '0 || &stopped;

    assign line_start = (tick || waiting) && ended && period != '0;
    assign line_idle  = ended && !line_start;

    // of each axis: the last target; the end of its last line, and the rest of that division
    logic [ 47:0] targets[0:2**A-1];
    logic [ 47:0] ends   [0:2**A-1];
    logic [P-1:0] rests  [0:2**A-1];
    // there is a new target; it needs a restart; a rate waits for the beginning of its line
    logic [AXES-1:0] fresh, restarts, given;

    enum logic [1:0] {
        SEEK,
        LOAD,
        DIVIDE,
        GIVE
    } state;
    logic [A-1:0] seen;  // number of the axis whose turn it is
    logic [5:0] bits_left;  // of the quotient, less one
    logic signed [47:0] distance;  // 2^-16 step
    logic [P-1:0] remainder;
    // bits of the dividend that are still to come, followed by those of the quotient
    logic [BITS-1:0] digits;

    wire [A-1:0] of = AXES > 1 ? axis[A-1:0] : '0;
    wire [A-1:0] n = AXES > 1 ? seen : '0;  // axis that is served
    wire take = state == SEEK && fresh[n] && !given[n];
    wire begins = restarts[n] || stopped[n] || period == '0;
    wire [47:0] end_n = begins ? {targets[n][47:16], 16'd0} : targets[n];
    // a distance of a step per cycle downward is 0; more than that is negative
    wire signed [48:0] dividend = 49'(distance) + $signed(49'({period, 16'd0}));
    wire too_far = dividend < 0 || dividend[47:17] >= 31'(period);
    wire [P:0] shifted = {remainder, digits[BITS-1]};
    wire [P+1:0] less = {1'b0, shifted} - {2'b00, period};
    wire fits = !less[P+1];

    assign rate = {!digits[BITS-1], digits[BITS-2:0]};
    always_comb begin
        rate_valid = '0;
        rate_valid[n] = state == GIVE;
    end

    always_ff @(posedge clk) begin
        waiting <= (tick || waiting) && !line_start;
        if (line_start) left <= period - 1'b1;
        else if (left != '0) left <= left - 1'b1;

        if (valid) targets[of] <= target;
        if (take) ends[n] <= end_n;
        if (state == GIVE && !rate_steep) rests[n] <= rate_restart ? period - 1'b1 : remainder;

        given <= (given & ~{AXES{line_start}}) | rate_valid;
        if (take) fresh[n] <= 1'b0;
        if (take) restarts[n] <= 1'b0;
        if (valid) begin
            fresh[of]    <= 1'b1;
            restarts[of] <= restart_in || (restarts[of] && !(take && of == n));
        end

        case (state)
            SEEK: begin
                distance     <= begins ? 48'sd0 : $signed(targets[n] - ends[n]);
                rate_restart <= begins;
                if (take) state <= LOAD;
                else seen <= n == A'(AXES - 1) ? '0 : n + 1'b1;
            end
            LOAD: begin
                rate_steep <= too_far && !rate_restart;
                remainder  <= dividend[17+:P];
                digits     <= {dividend[16:0], (RATE_F - 16)'(rests[n])};
                bits_left  <= 6'(BITS - 1);
                state      <= DIVIDE;
                if (too_far || rate_restart) begin
                    digits <= {1'b1, {RATE_F{1'b0}}};
                    state  <= GIVE;
                end
            end
            DIVIDE: begin
                remainder <= fits ? less[P-1:0] : shifted[P-1:0];
                digits    <= {digits[BITS-2:0], fits};
                bits_left <= bits_left - 1'b1;
                if (bits_left == '0) state <= GIVE;
            end
            default: state <= SEEK;
        endcase
        if (rst) begin
            {left, waiting, given, seen} <= '0;
            fresh    <= '0;
            restarts <= '0;
            state    <= SEEK;
        end
    end

    wire unused = &{1'b0, axis, less[P]};

`ifdef FORMAL
    logic            past = 1'b0;
    logic [     P:0] since = '1;  // cycles since lines began
    logic [AXES-1:0] held;  // a rate was given, and no line has begun with it
    always @(posedge clk) begin
        past  <= 1'b1;
        since <= rst ? '1 : line_start ? 1 : since + !(&since);
        held  <= rst ? '0 : (held & ~{AXES{line_start}}) | rate_valid;
        if (!past) assume (rst);
        if (past) begin
            assume (period == $past(period) && axis < AXES);
            assert (since >= {1'b0, period} - {1'b0, left});
            if (line_start && !(&stopped)) assert (since >= {1'b0, period});
            assert (held == given);
            assert ((rate_valid & held) == '0);
            assert (n < AXES);
            if (state != SEEK) assert (!given[n]);
            if (state == DIVIDE) assert (remainder < period);
            cover (line_start && period == 3 && given == 3);
            cover (line_start && waiting);
        end
    end
`endif
endmodule

`default_nettype wire
