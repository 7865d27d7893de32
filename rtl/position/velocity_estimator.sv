// SPDX-License-Identifier: Apache-2.0
// velocity_estimator -- estimate the velocity as distance by time between two steps of the
// position, kept within one quantum of the distance of the last tick.
//
//   velocity = (position of the last step - position of the last step before the tick before)
//   * tick / (time between the two steps)
//   limited to (distance of the last tick) -+ quantum, and to -+ quantum * tick / (time since the
//   last step) where that time is more than half a tick
//
// latency  5 cycles from tick to velocity and fine; the step used is the last one that was 24 to
//          50 cycles old at the tick
// rate     one tick per cycle; the time stamps improve the result if ticks are 400 cycles or more
//          apart
// accuracy At constant speed the error is below 2 cycles of the time between the two steps, plus
//          2^-19 of the distance between them. That time is about one tick or, at lower speed, the
//          time of one quantum. After 2^TIME_W - 1 cycles without a step the velocity is 0.
// method   There is no switch-over between two methods: one formula with continuous limits covers
//          all speeds. At high speed it is the difference of positions within one quantum, at low
//          speed one quantum over the time between two steps. A step downwards enters its quantum
//          at the upper end, so the same edge has the same position in both directions, and a
//          scale that trembles on an edge has no velocity.
// source   Ohmae et al., IEEE Trans. IE-29 (1982) 207, count times
// model    tb/position/velocity_estimator.py, equal in every bit of every cycle
// proved   velocity is never more than quantum from the distance covered in the tick; a scale at
//          rest has velocity 0, however often its origin moves
// proof    depth 12, TIME_W = 4
//
// The position must move by less than 65536 periods per tick. quantum is the smallest change of the
// position at low speed: 16384 for a plain x4 scale, 1 for a 16-bit phase. With 0 the velocity is
// the distance of the tick.
`default_nettype none

module velocity_estimator #(
    parameter int TIME_W = 24  // bits of the times between steps and between ticks
) (
    input  wire                clk,
    input  wire                rst,            // level: velocity 0; the next tick is the first
    input  wire         [15:0] quantum,        // 2^-16 period: smallest change of the position
    input  wire                tick,           // strobe: a servo tick ends
    /* verilator lint_off UNUSEDSIGNAL */  // the high bits never change alone
    input  wire signed  [47:0] position,       // Q32.16 periods, wraps
    input  wire                shift,          // strobe: shift_periods is added in the next cycle
    input  wire signed  [31:0] shift_periods,  // periods
    /* verilator lint_on UNUSEDSIGNAL */
    output logic signed [31:0] velocity,       // 2^-16 period/tick, saturates
    output logic signed [39:0] fine            // 2^-24 period/tick, the same before rounding
);
    localparam int P = 33, N = TIME_W + 2;  // bits of a position, bits of a time stamp
    localparam int K = 20;  // fraction bits of the quotient tick / time
    localparam signed [33:0] TOP = 34'sd2147483647;

    if (TIME_W < 4) begin : g_check
        TIME_W_MUST_BE_AT_LEAST_4 u_error ();
    end

    // the position on the scale, independent of the origin, and its steps
    logic [P-17:0] origin;  // periods that the origin has moved since reset
    logic signed [P-1:0] here, here_q;  // the position; the same one cycle ago
    logic [1:0] here_valid;  // bit 0: here is valid; bit 1: here_q is valid
    logic stepped, down;  // stepped: here_q has just moved; down: downwards
    logic       [N-1:0] now;

    wire signed [P-1:0] move = here - here_q;
    wire signed [P-1:0] one_quantum = $signed({{(P - 16) {1'b0}}, quantum});
    wire signed [P-1:0] step_from = down ? here_q + one_quantum : here_q;

    // the distance of the tick, and the limits around it
    logic               known;  // last is valid
    logic       [  2:0] ticked;  // tick, 1, 2 and 3 cycles later
    logic signed [P-1:0] last, distance;
    logic signed [31:0] low, high;  // 2^-16 period/tick
    logic              done;

    wire               fits = distance[P-1:31] == {(P - 31) {distance[31]}};
    wire signed [33:0] nearest = distance[P-1] ? -TOP - 34'sd1 : TOP;  // end of the range
    wire signed [33:0] held = fits ? {{2{distance[31]}}, distance[31:0]} : nearest;
    wire signed [33:0] above = held + $signed({18'd0, quantum});
    wire signed [33:0] below = held - $signed({18'd0, quantum});

    // the last step, the step that the next distance is measured from, and their times
    // there was a step since reset or since the velocity became 0
    logic              anchored;
    logic              fresh;  // the last step has not been used yet
    logic signed [P-1:0] step_position, run_position, base_position;
    logic [N-1:0] step_time, run_time, base_time;
    // cycles since the last step, since the last tick; cycles of a tick
    logic [TIME_W-1:0] quiet, since_tick, period;

    // divisions in turn: acc = distance * floor(2^K * tick / max(2 * time, tick))
    enum logic [1:0] {
        CHOOSE,
        LOAD,
        DIVIDE,
        STORE
    } state;
    logic bounding;  // the quotient is a limit, not a velocity
    // the time is more than half a tick; a shorter one gives no limit
    logic slow;
    logic [4:0] bits;
    logic [N:0] divisor;  // twice the time, at least the tick
    logic [N+1:0] remainder;
    logic signed [P-1:0] run_distance;
    logic signed [P+K:0] acc;
    logic signed [P+9:0] speed;  // 2^-24 period/tick, of the last step

    wire [N:0] tick_wide = {{(N + 1 - TIME_W) {1'b0}}, period};
    wire [N+2:0] left = {1'b0, remainder} - {2'b0, divisor};
    wire longer = divisor > tick_wide;
    wire goes = !left[N+2];
    wire signed [P-1:0] bound = speed < 0 ? -one_quantum : one_quantum;
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
        here_valid <= {here_valid[0], 1'b1};
        stepped <= here_valid[1] && move != '0;
        down    <= move < 0;
        now     <= now + 1'b1;

        ticked <= {ticked[1:0], tick};
        if (ticked[0]) begin
            distance   <= known ? here - last : '0;
            last  <= here;
            known <= 1'b1;
        end
        if (ticked[1]) begin
            high <= above > TOP ? TOP[31:0] : above[31:0];
            low  <= below < -TOP - 34'sd1 ? 32'h80000000 : below[31:0];
        end
        done <= ticked[2];
        if (ticked[2]) begin
            if (speed > high_fine) fine <= high_fine[39:0];
            else if (speed < low_fine) fine <= low_fine[39:0];
            else fine <= speed[39:0];
        end
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
                run_distance  <= fresh ? step_position - base_position : bound;
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
                remainder    <= {1'b0, tick_wide};
                slow    <= longer;
                if (!longer) divisor <= tick_wide;
            end
            DIVIDE: begin
                acc  <= (acc <<< 1) + (goes ? {{(K+1){run_distance[P-1]}}, run_distance} : '0);
                remainder <= {goes ? left[N:0] : remainder[N:0], 1'b0};
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
            step_position <= step_from;
            step_time  <= now;
            fresh      <= 1'b1;
            anchored   <= 1'b1;
            // the first step after a standstill: measure from here
            if (!anchored || quiet == '1) begin
                state      <= CHOOSE;
                fresh      <= 1'b0;
                run_position  <= step_from;
                run_time   <= now;
                base_position <= step_from;
                base_time  <= now;
                speed      <= '0;
            end
        end
        if (rst) begin
            origin     <= '0;
            here_valid    <= '0;
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
    (* anyconst *)logic               still;  // only the origin moves
    wire signed [ 47:0] by = shift && !rst ? $signed({shift_periods, 16'b0}) : 48'sd0;
    wire signed [ 47:0] next_position = position + by;
    wire signed [P-1:0] on_scale = {position[P-1:16] - origin, position[15:0]};
    logic               past = 1'b0;
    // the distance of the tick that fine and velocity belong to
    logic signed [31:0] travelled, travelled_q;
    logic [15:0] allowed, allowed_q;
    wire signed [33:0] allowed_wide = $signed({18'd0, allowed});
    wire signed [33:0] allowed_q_wide = $signed({18'd0, allowed_q});
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && still) assume (position == $past(next_position));
        if (ticked[1]) begin
            travelled   <= held[31:0];
            allowed <= quantum;
        end
        if (done) begin
            travelled_q   <= fine_travelled;
            allowed_q <= fine_allowed;
        end
        if (ticked[2]) begin
            fine_travelled   <= travelled;
            fine_allowed <= allowed;
        end
        if (rst) begin
            fine_travelled   <= '0;
            fine_allowed <= '0;
            travelled_q      <= '0;
            allowed_q    <= '0;
        end
        if (past) begin
            if (ticked[2]) begin
                assert (34'(high) <= 34'(travelled) + allowed_wide && high >= travelled);
                assert (34'(low) >= 34'(travelled) - allowed_wide && low <= travelled);
            end
            assert (34'(velocity) <= 34'(travelled_q) + allowed_q_wide);
            assert (34'(velocity) >= 34'(travelled_q) - allowed_q_wide);
            assert (fine <= $signed({fine_top, 8'd0}) && fine >= $signed({fine_bottom, 8'd0}));
        end
        if (past && still && !$past(rst)) begin
            assert (here_valid == 0 || here == on_scale);
            if (here_valid[1]) assert (here_q == here);
            assert (!stepped && !anchored && !fresh && speed == 0 && state == CHOOSE);
            if (known) assert (last == here && here_valid != 0);
            if (ticked[1]) assert (distance == 0);
            if (ticked[2]) assert (travelled == 0 && low <= 0 && high >= 0);
            assert (fine == 0 && velocity == 0);
        end
        cover (past && still && known && ticked[0] && position > 48'sd65536 && $past(position) < 0);
        cover (past && velocity != travelled_q && travelled_q > 0 && allowed_q == 100);
    end
    logic signed [31:0] fine_travelled;
    logic        [15:0] fine_allowed;
    wire signed  [33:0] fine_above = 34'(fine_travelled) + $signed({18'd0, fine_allowed});
    wire signed  [33:0] fine_below = 34'(fine_travelled) - $signed({18'd0, fine_allowed});
    wire signed  [31:0] fine_top = fine_above > TOP ? TOP[31:0] : fine_above[31:0];
    wire signed  [31:0] fine_bottom = fine_below < -TOP - 34'sd1 ? 32'h80000000 : fine_below[31:0];
`endif
endmodule

`default_nettype wire
