// SPDX-License-Identifier: Apache-2.0
// position_compare -- make a pulse at each of the points start + k * step, k = 0, 1, 2, …, passed
// in the direction of step.
//
// latency  3 cycles from valid to pulse
// rate     one position per cycle; one pulse per pulse_length + gap_length cycles
// behaviour The comparator is armed from the cycle after arm until `count` points are passed, or
//          until disarm. The first point counts only after a position before it has been seen, so
//          points behind the start cause no burst of pulses. A point is passed when a position
//          reaches it or goes beyond. Only the next point is compared, and with the farthest
//          position so far: moving back and forth over a point passes it once, and a step over many
//          points passes them all. Points that are reached during a pulse or its gap are passed
//          one by one, in order and without omission, as soon as it has ended: such pulses are
//          exactly gap_length apart, and each of them is reported by late. With step = 0 there is
//          one point, passed upwards. A shift of the origin leaves the points where they are on
//          the scale; start refers to the origin in the cycle after arm. armed falls one cycle
//          after passed has counted the last point.
// model    tb/position/position_compare.py, equal in every bit of every cycle
// proved   the numbers of pulses and of points passed are always equal; a pulse begins only when
//          the farthest position has reached its point, and at once unless another pulse or gap is
//          running; every pulse has its length and at least its gap after it, whatever the lengths
//          are and whenever they change: the lengths in force are those at the start of the pulse
//          and at the start of its gap
// proof    depth 16
`default_nettype none

module position_compare (
    input  wire               clk,
    input  wire               rst,            // level: disarmed, pulse is low
    input  wire signed [47:0] start,          // Q32.16 periods, the first point; taken by arm
    input  wire signed [47:0] step,           // Q32.16 periods, signed; taken by arm
    input  wire        [31:0] count,          // points; 0: no end; taken by arm
    input  wire        [23:0] pulse_length,   // cycles; 0 acts as 1
    input  wire        [23:0] gap_length,     // cycles that pulse is low, at least; 0 acts as 1
    input  wire               arm,            // strobe: begin with the first point
    input  wire               disarm,         // strobe: no more points after this pulse
    input  wire               valid,          // strobe: position is new
    input  wire signed [47:0] position,       // Q32.16 periods
    input  wire               shift,          // strobe: shift_periods is added in the next cycle
    input  wire signed [31:0] shift_periods,  // periods
    output logic              armed,          // level: there are points to come
    output logic              pulse,          // level: the output pulse
    output logic              late,           // strobe, with the start of a delayed pulse
    output logic       [31:0] passed          // points passed since arm, wraps
);
    logic        [31:0] origin;  // periods that the origin has moved since arm
    logic               arrived;  // `here` is new
    logic signed [47:0] here;  // the position, with the origin at arm, like reach and point
    // seen: reach is a position since arm; ready: it was a position before the first point
    logic seen, ready;
    // the last position; while a point is due, the farthest one
    logic signed [47:0] reach;
    logic signed [47:0] point, stride;  // the next point; distance between points
    logic down, single;  // down: stride is negative; single: it is 0
    logic [31:0] points;  // count, at arm
    logic stepped, wrapped;  // stepped: passed is new; wrapped: it has begun again at 0
    // resting: the gap after a pulse; waited: the point had to wait for it
    logic resting, waited;
    logic [23:0] timer;  // cycles left of the pulse or gap, this one included; 0 acts as 1

    /* verilator lint_off UNUSEDSIGNAL */  // of a distance only its sign counts
    // less 1 going down, so that its sign differs from `down` where the point is reached
    wire  [48:0] beyond = {reach, 1'b0} - {point, down};
    wire  [48:0] farther = {here, 1'b0} - {reach, down};
    /* verilator lint_on UNUSEDSIGNAL */
    wire         reached = beyond[48] == down;
    wire         due = armed && ready && reached;
    wire         running = (pulse || resting) && timer[23:1] != '0;  // not its last cycle
    wire         busy = pulse || running;
    wire         begins = due && !busy && !arm && !disarm;
    wire  [32:0] passed_next = {1'b0, passed} + 33'd1;
    wire         done = stepped && (single || {wrapped, passed} == {1'b0, points});

    always_ff @(posedge clk) begin
        if (shift) origin <= origin + shift_periods;
        arrived <= valid && !arm;
        here    <= {position[47:16] - origin, position[15:0]};

        if (arrived && (farther[48] == down || !(ready && reached))) reach <= here;
        seen  <= seen || arrived;
        ready <= ready || (seen && !reached);

        late    <= begins && waited;
        waited  <= due && busy;
        stepped <= begins;
        if (begins) begin
            point <= point + stride;
            passed <= passed_next[31:0];
            wrapped <= wrapped || passed_next[32];
        end
        if (done) armed <= 1'b0;

        timer <= running ? timer - 1'b1 : pulse ? gap_length : pulse_length;
        if (!running) begin
            pulse   <= begins;
            resting <= pulse;
        end

        if (arm) begin
            origin  <= '0;
            seen    <= 1'b0;
            ready   <= 1'b0;
            armed   <= 1'b1;
            point   <= start;
            stride  <= step;
            down    <= step[47];
            single  <= step == '0;
            points  <= count;
            wrapped <= 1'b0;
            passed  <= '0;
            waited  <= 1'b0;
        end
        if (disarm) armed <= 1'b0;
        if (rst) begin
            arrived <= 1'b0;
            seen    <= 1'b0;
            ready   <= 1'b0;
            armed   <= 1'b0;
            waited  <= 1'b0;
            late    <= 1'b0;
            stepped <= 1'b0;
            passed  <= '0;
            pulse   <= 1'b0;
            resting <= 1'b0;
        end
    end

`ifdef FORMAL
    logic        past = 1'b0;
    logic        high;  // pulse in the preceding cycle
    logic [31:0] pulses;  // pulses begun since arm
    // cycles that pulse has been high or low before this one; low_for saturates
    logic [23:0] high_for, low_for;
    // lengths in force at the start of the pulse and of its gap; 0 acts as 1
    logic [23:0] pulse_taken, gap_taken;
    wire [23:0] left = timer == 0 ? 24'd1 : timer;  // cycles left, this one included
    wire        rises = pulse && !high;
    wire [31:0] pulses_now = pulses + 32'(rises);
    always @(posedge clk) begin
        past     <= 1'b1;
        high     <= pulse && !rst;
        pulses   <= rst || arm ? 0 : pulses_now;
        high_for <= rst || !pulse ? 0 : high_for + 1'b1;
        low_for  <= rst ? '1 : pulse ? 0 : low_for + !(&low_for);
        if (!past) assume (rst);
        if (begins) pulse_taken <= pulse_length + 24'(pulse_length == 0);
        if (rst) gap_taken <= 1;
        else if (pulse && timer <= 1) gap_taken <= gap_length + 24'(gap_length == 0);
        if (past) begin
            assert (pulses_now == passed);
            assert (!(pulse && resting));
            assert (gap_taken != 0 && (!pulse || pulse_taken != 0));
            if (high && !pulse) assert (high_for == pulse_taken);
            if (rises) assert (low_for >= gap_taken);
            if (pulse) begin
                assert (left <= pulse_taken && high_for == pulse_taken - left);
                assert (high == (high_for != 0));
            end else if (resting) begin
                assert (left <= gap_taken && low_for == gap_taken - left);
            end else begin
                assert (low_for >= gap_taken);
            end
        end
        if (past && !$past(rst)) begin
            if (rises) begin
                // the point of the pulse had been reached
                assert ($past(armed) && $past(ready) && $past(reached));
                assert (point == $past(point) + $past(stride) && passed == $past(passed) + 1);
            end
            if ($past(due) && !$past(busy) && !$past(arm) && !$past(disarm)) assert (rises);
            // a position that has reached its point is followed by farther ones only
            if ($past(ready && reached) && reach != $past(reach)) begin
                assert ($past(down) != !(48'(reach - $past(reach)) >> 47));
            end
            cover (rises && late && passed == 2 && down);
            cover (rises && low_for == 4 && gap_taken == 4 && late);
            cover (high && !pulse && pulse_taken == 5);
            cover (!armed && passed == 2 && !pulse && !$past(disarm) && !$past(arm));
        end
    end
`endif
endmodule

`default_nettype wire
