// SPDX-License-Identifier: Apache-2.0
// velocity_estimator -- way by time between two steps of the position, held to the way of the last
// tick within one quantum.
//
//   velocity = (place of the last step - place of the last step before the tick before) * tick /
//   (time between the two)
//   held inside way of the last tick -+ quantum, and inside -+ quantum * tick / (time since the
//   last step) where that is
//   more than half a tick
//
// latency  5 clk from tick to velocity and fine; the step it rests on is the last one that was 24
//          to 50 clk old at the tick
// rate     one tick per clk; ticks of 400 clk or more for what the time stamps add
// joint    there is none: one formula and continuous limits. Fast, it is the difference of
//          positions within one quantum; slow, one over the time between two steps; where the steps
//          become rarer than the ticks nothing is switched
// finest   at constant speed right within 2 clk of the time between the two steps, which is about a
//          tick or, when slower, the time of one quantum, and within 2^-19 of their way. No step
//          for 2^TIME_W - 1 clk: the scale stands still
// place    a step downwards enters its cell of one quantum at its upper end: the same edge, crossed
//          to and fro, is one place, so a scale that trembles on an edge has no velocity
// source   Ohmae et al., IEEE Trans. IE-29 (1982) 207, counts by time
// model    tb/position/velocity_estimator.py, equal in every bit of every cycle
// proof    depth 12, TIME_W = 4
// proved   never farther than quantum from the way covered in the tick; what stands still has no
//          velocity, however often its origin moves
`default_nettype none

module velocity_estimator #(
    parameter int TIME_W = 24  // bits of the times between steps and between ticks
) (
    input wire clk,
    input wire rst,  // velocity becomes 0; the next tick only learns the position
    input  wire        [15:0]    quantum,       // 2^-16 period: what the position moves by at once when it moves slowly: 16384 of
                                                // a plain x4 scale, 1 of 16 bits; 0: velocity is
                                                // the way of the tick
    input wire tick,  // strobe: a servo tick ends
    /* verilator lint_off UNUSEDSIGNAL */  // the high bits change with the others
    input wire signed [47:0] position,  // Q32.16 periods, wraps; less than 65536 periods a tick
    input wire shift,  // strobe: position grows by shift_periods in the next clk
    input wire signed [31:0] shift_periods,  // periods
    /* verilator lint_on UNUSEDSIGNAL */
    output logic signed [31:0] velocity,  // 2^-16 period/tick, stops at either end of the range
    output logic signed [39:0] fine  // 2^-24 period/tick, the same before it is rounded
);
    localparam int P = 33, N = TIME_W + 2;  // bits of a place, of a time stamp
    localparam int K = 20;  // bits of tick / time; a bit stays in a bit of acc for each
    localparam signed [33:0] TOP = 34'sd2147483647;

    if (TIME_W < 4) begin : g_check
        TIME_W_MUST_BE_AT_LEAST_4 u_error ();
    end

    // the place on the scale, whatever its origin, and its steps
    logic [P-17:0] origin;  // periods that the origin has moved since reset
    logic signed [P-1:0] here, here_q;  // where the scale is; one clk ago
    logic [1:0] settled;  // here and here_q are places
    logic stepped, down;  // here_q has just moved
    logic       [N-1:0] now;

    wire signed [P-1:0] move = here - here_q;
    wire signed [P-1:0] place = here_q + (down ? $signed({{(P - 16) {1'b0}}, quantum}) : '0);

    // the way of the tick, and the limits around it
    logic               known;  // last is a place
    logic       [  2:0] ticked;  // tick, 1, 2 and 3 clk late
    logic signed [P-1:0] last, way;
    logic signed [31:0] low, high;  // 2^-16 period/tick
    logic              done;

    wire               fits = way[P-1:31] == {(P - 31) {way[31]}};
    wire signed [33:0] held = fits ? {{2{way[31]}}, way[31:0]} : way[P-1] ? -TOP - 34'sd1 : TOP;
    wire signed [33:0] above = held + $signed({18'd0, quantum});
    wire signed [33:0] below = held - $signed({18'd0, quantum});

    // the last step, the one that the next way is measured from, and the times
    // there was a step since reset or since the scale last stood
    logic              anchored;
    logic              fresh;  // the last step has not been looked at
    logic signed [P-1:0] step_position, run_position, base_position;
    logic [N-1:0] step_time, run_time, base_time;
    // clk since the last step, since the last tick; length of a tick
    logic [TIME_W-1:0] quiet, since_tick, period;

    // one division after the other: acc = way * floor(2^K * tick / max(2 * span, tick))
    enum logic [1:0] {
        CHOOSE,
        LOAD,
        DIVIDE,
        STORE
    } state;
    logic bounding;  // a limit is worked out, not a velocity
    // the time is more than half a tick: less says nothing about a limit
    logic slow;
    logic [4:0] bits;
    logic [N:0] divisor;  // first twice the time
    logic [N+1:0] rest;
    logic signed [P-1:0] run_way;
    logic signed [P+K:0] acc;
    logic signed [P+9:0] speed;  // 2^-24 period/tick, of the last step

    wire [N:0] tick_wide = {{(N + 1 - TIME_W) {1'b0}}, period};
    wire [N+2:0] left = {1'b0, rest} - {2'b0, divisor};
    wire longer = divisor > tick_wide;
    wire goes = !left[N+2];
    wire signed [P-1:0] bound = speed < 0 ? -$signed(
        {{(P - 16) {1'b0}}, quantum}
    ) : $signed(
        {{(P - 16) {1'b0}}, quantum}
    );
    /* verilator lint_off UNUSEDSIGNAL */  // rounding drops the low bits
    wire signed [40:0] rounding = {fine[39], fine} + 41'sd128;
    /* verilator lint_on UNUSEDSIGNAL */
    wire signed [P+9:0] quotient = acc[P+K:K-9];  // rounded down
    wire faster = speed < 0 ? speed < quotient : speed > quotient;
    wire signed [P+9:0] low_fine = {{(P - 30) {low[31]}}, low, 8'd0};
    wire signed [P+9:0] high_fine = {{(P - 30) {high[31]}}, high, 8'd0};

    always_ff @(posedge clk) begin
        if (shift) origin <= origin + shift_periods[P-17:0];
        here    <= {position[P-1:16] - origin, position[15:0]};
        here_q  <= here;
        settled <= {settled[0], 1'b1};
        stepped <= settled[1] && move != '0;
        down    <= move < 0;
        now     <= now + 1'b1;

        ticked <= {ticked[1:0], tick};
        if (ticked[0]) begin
            way   <= known ? here - last : '0;
            last  <= here;
            known <= 1'b1;
        end
        if (ticked[1]) begin
            high <= above > TOP ? TOP[31:0] : above[31:0];
            low  <= below < -TOP - 34'sd1 ? 32'h80000000 : below[31:0];
        end
        done <= ticked[2];
        if (ticked[2])
            fine <= speed > high_fine ? high_fine[39:0] : speed < low_fine ? low_fine[39:0] : speed[39:0];
        if (done) velocity <= rounding[39:8];

        quiet      <= stepped ? '0 : quiet == '1 ? quiet : quiet + 1'b1;
        since_tick <= ticked[0] ? '0 : since_tick == '1 ? since_tick : since_tick + 1'b1;
        if (ticked[0]) begin
            period     <= since_tick == '1 ? since_tick : since_tick + 1'b1;
            base_position <= run_position;
            base_time  <= run_time;
        end

        case (state)
            CHOOSE:
            if (anchored) begin
                state    <= LOAD;
                bounding <= !fresh;
                fresh    <= 1'b0;
                run_way  <= fresh ? step_position - base_position : bound;
                divisor  <= {fresh ? step_time - base_time : {2'b0, quiet}, 1'b0};
                if (fresh) begin
                    run_position <= step_position;
                    run_time  <= step_time;
                end
            end
            LOAD: begin
                state   <= DIVIDE;
                bits    <= 5'(K);
                acc     <= '0;
                rest    <= {1'b0, tick_wide};
                slow    <= longer;
                if (!longer) divisor <= tick_wide;
            end
            DIVIDE: begin
                acc  <= (acc <<< 1) + (goes ? {{(K+1){run_way[P-1]}}, run_way} : '0);
                rest <= {goes ? left[N:0] : rest[N:0], 1'b0};
                bits <= bits - 1'b1;
                if (bits == '0) state <= STORE;
            end
            default: begin
                state <= CHOOSE;
                if (!bounding) speed <= quotient;
                else if (quiet == '1) speed <= '0;
                else if (slow && faster) speed <= quotient;
            end
        endcase

        if (stepped) begin
            step_position <= place;
            step_time  <= now;
            fresh      <= 1'b1;
            anchored   <= 1'b1;
            if (!anchored || quiet == '1) begin  // the first since the scale stood: from here on
                state      <= CHOOSE;
                fresh      <= 1'b0;
                run_position  <= place;
                run_time   <= now;
                base_position <= place;
                base_time  <= now;
                speed      <= '0;
            end
        end
        if (rst) begin
            origin     <= '0;
            settled    <= '0;
            stepped    <= 1'b0;
            now        <= '0;
            ticked     <= '0;
            done       <= 1'b0;
            known      <= 1'b0;
            anchored   <= 1'b0;
            fresh      <= 1'b0;
            since_tick <= '0;
            period     <= '0;
            quiet      <= '0;
            state      <= CHOOSE;
            speed      <= '0;
            fine       <= '0;
            velocity   <= '0;
        end
    end

`ifdef FORMAL
    (* anyconst *)logic still;  // nothing moves but the origin
    logic past = 1'b0;
    // the way of the tick that fine, velocity belongs to
    logic signed [31:0] asked, asked_q;
    logic [15:0] allowed, allowed_q;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && still)
            assume (position == $past(
                position
            ) + ($past(
                shift && !rst
            ) ? $signed(
                {$past(shift_periods), 16'b0}
            ) : 48'sd0));
        if (ticked[1]) begin
            asked   <= held[31:0];
            allowed <= quantum;
        end
        if (done) begin
            asked_q   <= fine_asked;
            allowed_q <= fine_allowed;
        end
        if (ticked[2]) begin
            fine_asked   <= asked;
            fine_allowed <= allowed;
        end
        if (rst) begin
            fine_asked   <= '0;
            fine_allowed <= '0;
            asked_q      <= '0;
            allowed_q    <= '0;
        end
        if (past) begin
            if (ticked[2])
                assert (34'(high) <= 34'(asked) + $signed(
                    {18'd0, allowed}
                ) && 34'(low) >= 34'(asked) - $signed(
                    {18'd0, allowed}
                ) && high >= asked && low <= asked);
            assert (34'(velocity) <= 34'(asked_q) + $signed(
                {18'd0, allowed_q}
            ) && 34'(velocity) >= 34'(asked_q) - $signed(
                {18'd0, allowed_q}
            ));
            assert (fine <= $signed({fine_top, 8'd0}) && fine >= $signed({fine_bottom, 8'd0}));
        end
        if (past && still && !$past(rst)) begin
            assert (settled == 0 || here == $signed({position[P-1:16] - origin, position[15:0]}));
            if (settled[1]) assert (here_q == here);
            assert (!stepped && !anchored && !fresh && speed == 0 && state == CHOOSE);
            if (known) assert (last == here && settled != 0);
            if (ticked[1]) assert (way == 0);
            if (ticked[2]) assert (asked == 0 && low <= 0 && high >= 0);
            assert (fine == 0 && velocity == 0);
        end
        cover (past && still && known && ticked[0] && position > 48'sd65536 && $past(position) < 0);
        cover (past && velocity != asked_q && asked_q > 0 && allowed_q == 100);
    end
    logic signed [31:0] fine_asked;
    logic        [15:0] fine_allowed;
    wire signed  [33:0] fine_above = 34'(fine_asked) + $signed({18'd0, fine_allowed});
    wire signed  [33:0] fine_below = 34'(fine_asked) - $signed({18'd0, fine_allowed});
    wire signed  [31:0] fine_top = fine_above > TOP ? TOP[31:0] : fine_above[31:0];
    wire signed  [31:0] fine_bottom = fine_below < -TOP - 34'sd1 ? 32'h80000000 : fine_below[31:0];
`endif
endmodule

`default_nettype wire
