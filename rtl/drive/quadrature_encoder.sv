// SPDX-License-Identifier: Apache-2.0
// quadrature_encoder -- turn a target position into the A, B and Z signals of an incremental
// encoder, one edge at a time.
//
// latency   2 cycles from target to the edge, if `minimum_edge_separation` allows the edge.
// rate      one edge per `minimum_edge_separation` cycles. A target that is further away, in either
//           direction, is caught up with at that rate.
// behaviour The position settles at the target rounded to the nearest count; a half is rounded up.
//           `hysteresis` widens the band around it in which nothing moves to 1/2 + hysteresis to
//           each side: a target that trembles by less than twice the hysteresis makes no edge but
//           the first one. z is high while position is home_position plus any number of
//           counts_per_turn, once home has come; z changes together with the edge. A home strobe is
//           taken in the first cycle without an edge.
// source    S1: A, B and Z are sent on as if the relay were the encoder
// model     tb/drive/quadrature_encoder.py, equal in every bit of every cycle
// proved    a and b never change in the same cycle. No edge comes sooner than
//           `minimum_edge_separation` after the one before. Pins and position always agree. A
//           target that moves no faster than the minimum edge separation is followed within 1/2 +
//           hysteresis + 1 count.
// proof     W = 6, F = 2, SEPARATION_W = 3
`default_nettype none

module quadrature_encoder #(
    parameter int W            = 32,  // bits of position
    parameter int F            = 16,  // fraction bits of target
    parameter int SEPARATION_W = 16   // bits of minimum_edge_separation
) (
    input  wire                           clk,
    input  wire                           rst,
    input  wire        [SEPARATION_W-1:0] minimum_edge_separation,  // cycles; 0 counts as 1
    input  wire        [           F-1:0] hysteresis,               // 2^-F count
    input  wire        [           W-1:0] counts_per_turn,          // counts; 0: z stays low
    input  wire                           load,                     // level: jump to home_position
    input  wire signed [         W+F-1:0] target,                   // 2^-F count; wraps
    input  wire                           home,                     // strobe: home_position is new
    input  wire        [           W-1:0] home_position,            // count at which z is high
    output logic                          a,                        // level: pin; leads b going up
    output logic                          b,                        // level: pin
    output logic                          z,                        // level: pin, index pulse
    output logic       [           W-1:0] position,                 // count that a and b show
    output logic                          behind                    // level: lag over 4 counts
);
    // home_position is less than a turn away. load changes position without making edges, so it is
    // allowed only while the receiver ignores a and b. behind shows the distance 2 cycles before.
    if (W < 4) begin : g_check_w
        W_MUST_BE_AT_LEAST_4 u_error ();
    end
    if (F < 1) begin : g_check_f
        F_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam logic [W-1:0] ONE = W'(1);
    localparam logic [W+F-1:0] HALF = (W + F)'(1) << (F - 1);

    // the highest position at which to step up, the lowest at which not to step down
    logic [W-1:0] reach_up, reach_down;
    logic aimed;  // reach_up and reach_down are valid
    logic [W-1:2] ahead_q, back_q;  // delayed by one cycle, for behind
    logic                    aimed_q;
    logic [SEPARATION_W-1:0] left;  // cycles until an edge is allowed
    logic [           W-1:0] from_mark;  // counts from the reference mark up
    logic [           W-1:0] highest;  // largest value of from_mark
    // from_mark is known; home has come and is not taken yet
    logic mark_known, waiting;
    logic [  W-1:0] home_q;

    wire  [  W-1:0] ahead = reach_up - position;
    wire  [  W-1:0] back = reach_down - position;
    wire            free = left == '0 && aimed && !load;
    wire            up = free && !ahead[W-1];
    wire            down = free && ahead[W-1] && back[W-1];
    wire  [W+F-1:0] band = HALF + {{W{1'b0}}, hysteresis};
    wire  [  W-1:0] lower = W'((target - band) >> F);
    wire  [  W-1:0] upper = W'((target + band) >> F);
    wire  [  W-1:0] from = position - home_q;
    wire            take = waiting && !up && !down;
    wire            far_below = !ahead_q[W-1] && |ahead_q[W-2:2];
    wire            far_above = back_q[W-1] && !(&back_q[W-2:2]);

    assign b = position[1];
    assign a = position[1] ^ position[0];
    assign z = mark_known && from_mark == '0 && counts_per_turn != '0;

    always_ff @(posedge clk) begin
        reach_up   <= lower;
        reach_down <= upper;
        aimed      <= !load;
        aimed_q    <= aimed;
        ahead_q    <= ahead[W-1:2];
        back_q     <= back[W-1:2];
        behind     <= aimed_q && (far_below || far_above);

        if (up || down) left <= minimum_edge_separation == '0 ? '0 : minimum_edge_separation - 1'b1;
        else if (left != '0) left <= left - 1'b1;

        if (load) position <= home_position;
        else if (up) position <= position + ONE;
        else if (down) position <= position - ONE;

        if (take) from_mark <= from[W-1] ? from + counts_per_turn : from;
        else if (up) from_mark <= from_mark == highest ? '0 : from_mark + ONE;
        else if (down) from_mark <= from_mark == '0 ? highest : from_mark - ONE;

        highest    <= counts_per_turn - ONE;
        mark_known <= mark_known || take;
        waiting    <= home || (waiting && !take);
        if (home) home_q <= home_position;
        if (rst) begin
            position   <= '0;
            aimed      <= 1'b0;
            aimed_q    <= 1'b0;
            behind     <= 1'b0;
            left       <= '0;
            mark_known <= 1'b0;
            waiting    <= 1'b0;
        end
    end

`ifdef FORMAL
    logic                    past = 1'b0;
    // position was loaded in the cycle before
    logic                    loaded;
    logic [SEPARATION_W-1:0] since_edge;  // cycles since the last edge
    logic [           W-1:0] position_q;
    wire  [           W-1:0] step_made = position - position_q;
    always @(posedge clk) begin
        past       <= 1'b1;
        loaded     <= rst || load;
        position_q <= position;
        since_edge <= rst || load ? '1 : up || down ? '0 : since_edge + !(&since_edge);
        if (!past) assume (rst);
        if (past) begin
            assert ({b, a ^ b} == position[1:0]);
        end
        if (past && !$past(rst) && !$past(load)) begin
            assert (!(a != $past(a) && b != $past(b)));
            assert (step_made == '0 || step_made == ONE || step_made == '1);
            if (step_made != '0) assert ((a != $past(a)) ^ (b != $past(b)));
            if (z && !$past(z)) assert (from_mark == 0 && mark_known);
            cover (z && a != $past(a));
            cover (behind);
        end
    end

    // while minimum_edge_separation stays the same, no edge comes too soon
    logic [SEPARATION_W-1:0] agreed;
    logic                    steady;
    wire  [SEPARATION_W-1:0] least = agreed == '0 ? '0 : agreed - 1'b1;
    always @(posedge clk) begin
        steady <= rst ? 1'b1 : steady && minimum_edge_separation == agreed;
        if (rst) agreed <= minimum_edge_separation;
        if (past && steady) begin
            assert (left <= least);
            assert (since_edge == '1 || {1'b0, left} + {1'b0, since_edge} >= {1'b0, least});
            if (up || down) assert (since_edge >= least);
        end
    end

    // A target that moves one count at a time, and no sooner than the minimum edge separation, is
    // never lost.
    logic calm;  // it has moved so since the start; hysteresis is constant
    logic [SEPARATION_W:0] quiet;  // cycles since it moved
    logic [F-1:0] hysteresis_q;
    logic [W+F-1:0] target_q;
    wire signed [W+F-1:0] moved = target - target_q;
    wire signed [W+F-1:0] away = target_q - {position, {F{1'b0}}};
    wire signed [W+F-1:0] reach = {{W{1'b0}}, hysteresis_q} + HALF;
    wire signed [W+F-1:0] unit = HALF << 1;
    wire still = moved == 0;
    wire constant = minimum_edge_separation == agreed && hysteresis == hysteresis_q;
    wire slow = moved <= unit && moved >= -unit && quiet >= {1'b0, least};
    always @(posedge clk) begin
        target_q     <= target;
        hysteresis_q <= hysteresis;
        if (rst || load) quiet <= '1;
        else quiet <= still ? quiet + !(&quiet) : '0;
        if (rst) calm <= 1'b0;
        else if (load) calm <= target == {home_position, {F{1'b0}}} && steady;
        else calm <= calm && steady && constant && (still || slow);
        if (past && calm) begin
            assert (loaded || aimed);
            if (!loaded) begin
                assert (reach_up == W'((target_q - reach) >> F));
                assert (reach_down == W'((target_q + reach) >> F));
            end
            assert (away < reach + unit && away >= -reach - unit);
            if (away >= reach || away < -reach)
                assert ({1'b0, quiet} + {2'b0, left} <= {2'b0, least});
            cover (quiet == 0 && away > reach && position == 5);
        end
    end
`endif
endmodule

`default_nettype wire
