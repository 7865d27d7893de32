// SPDX-License-Identifier: Apache-2.0
// quadrature_decoder -- count the edges of two square waves a quarter period apart, in both
// directions, or pulses by a direction.
//
// latency  1 clk from a, b to count
// rate     one edge per clk
// source   the Gray code of two bits. Each mode counts at fixed borders of the period, the same in
//          both directions, so a reversal over any edge takes back what the edge gave: the two
//          jitter cases that S0 patches by interrupt (over its edges B and C) need no patch
// model    tb/decode/quadrature_decoder.py, equal in every bit of every cycle
// proved   count moves by at most one, only at a single edge and in its direction, never with
//          illegal; without illegal edges count and levels agree for ever, in the x4, x2 and x1
//          modes
// proof    W = 8
`default_nettype none

module quadrature_decoder #(
    parameter int W = 32,  // bits of count
    parameter int SETTLE = 8                // clk after reset in which a, b are only taken: what is in front starts up too
) (
    input wire clk,
    input wire rst,  // count becomes zero, whatever the levels are
    input  wire        [1:0]     mode,      // 0 x4: every edge; 1 x2: edges of a; 2 x1: edges of a while b is 0; 3: a rising, up while b is 0
    input  wire                  clear,     // strobe: count becomes zero at the end of this clk, an edge in this clk included
    input wire a,  // level, synchronous to clk and already filtered
    input wire b,  // level; a leading b counts up
    output logic ready,  // level: edges count from here on
    output logic stepping,  // count takes a step at the end of this clk, if ready
    output logic signed [W-1:0] count,  // 1/4, 1/2 or 1 period by mode, or pulses; wraps
    output logic signed [1:0] step,  // what count moved by in this clk, but for clear: -1, 0, +1
    output logic                 direction,   // direction of the last edge, that of this clk included, counted or not; 1 before the first. Mode 3: b is 0
    output logic                 illegal    // strobe: a and b changed at once (mode 3: b as a rose); not counted, count is wrong from here on
);
    if (W < 2) begin : g_check_w
        W_MUST_BE_AT_LEAST_2 u_error ();
    end
    if (SETTLE < 1) begin : g_check_settle
        SETTLE_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam int S = $clog2(SETTLE + 1);
    localparam logic [1:0] X4 = 0, X1 = 2, PULSES = 3;

    logic [S-1:0] settle;  // clk left of settling
    logic a_q, b_q;
    logic upward;  // direction of the last edge

    wire  edge_a = a ^ a_q;
    wire  edge_b = b ^ b_q;
    wire  up = mode == PULSES ? ~b : a ^ b_q;
    logic of_a;  // an edge of a counts, as the levels are

    always_comb
        case (mode)
            X1:      of_a = ~b;
            PULSES:  of_a = a;
            default: of_a = 1'b1;
        endcase

    wire down = stepping & ~up;

    assign stepping = edge_b ? ~edge_a & mode == X4 : edge_a & of_a;
    assign direction  = mode == PULSES || (edge_a ^ edge_b) ? up : upward;

    always_ff @(posedge clk) begin
        a_q     <= a;
        b_q     <= b;
        upward  <= direction || !ready;
        illegal <= ready & edge_a & edge_b & (mode != PULSES || a);
        step    <= {down, stepping};
        count   <= count + {{W-1{down}}, stepping};
        if (clear || !ready) count <= '0;
        if (!ready) step <= '0;
        ready <= settle == '0 || settle == S'(1);
        if (!ready) settle <= settle - 1'b1;
        if (rst) begin
            settle  <= S'(SETTLE);
            ready <= 1'b0;
            count   <= '0;
            step    <= '0;
            upward  <= 1'b1;
            illegal <= 1'b0;
        end
    end

`ifdef FORMAL
    logic         past = 1'b0;
    logic [  1:0] mode_q;
    // quarters covered, in step with the levels; its low bits are the quarter of the period
    logic [W+1:0] way;
    // border at which count is zero; only what is not a legal edge moves it
    logic [W-1:0] zero;
    wire  [  1:0] place = {b, a ^ b};  // 00 10 11 01 of a, b are 0 1 2 3
    wire  [  1:0] place_q = {b_q, a_q ^ b_q};
    wire  [  1:0] turned = place - place_q;
    wire  [W+1:0] way_now = way + {{W{turned == 3}}, turned};

    // borders passed on the way: between quarters 3 and 0 none but in x4; x2 has those behind 0 and
    // 2, x1 the one behind 0
    function automatic [W-1:0] borders(input [1:0] of_mode, input [W+1:0] of_way);
        logic [W+1:0] passed;
        passed  = of_mode == X4 ? of_way : of_mode == 1 ? (of_way + 1'b1) >> 1 : (of_way + 2'd3) >> 2;
        borders = passed[W-1:0];
    endfunction

    wire [W-1:0] count_now = clear ? '0 : count + {{W - 1{down}}, stepping};
    always @(posedge clk) begin
        past   <= 1'b1;
        mode_q <= mode;
        way    <= rst || !ready ? {{W{1'b0}}, place} : way_now;
        if (rst || !ready) zero <= borders(mode, {{W{1'b0}}, place});
        else if (clear || turned == 2 || mode != mode_q) zero <= borders(mode, way_now) - count_now;
        if (!past) assume (rst);
        if (past) begin
            assert (ready == (settle == '0));
            assert (ready || count == 0);
            assert (place_q == way[1:0]);
            if (mode_q != PULSES) assert (count == borders(mode_q, way) - zero);
        end
        if (past && !$past(rst)) begin
            assert (step != -2);
            assert (count == ($past(clear) ? W'(0) : W'($past(count) + {{W - 2{step[1]}}, step})));
            assert (!(illegal && step != 0));
            if (step != 0) assert ($past(ready) && ($past(a ^ a_q) ^ $past(b ^ b_q)));
            if (step != 0 && mode_q != PULSES) assert ($past(place) == 2'($past(place_q) + step));
            if (step != 0 && mode_q == PULSES) assert ($past(a && !a_q) && step[1] == $past(b));
            if (step != 0) assert (upward == (step == 1));
            cover (count == 3);
            cover (count == -3 && mode == X1);
            cover (illegal);
            cover (step != 0 && $past(clear) && $past(count) == 2 && count == 0);
        end
    end
`endif
endmodule

`default_nettype wire
