// SPDX-License-Identifier: Apache-2.0
// quadrature_decoder -- count the edges of two square waves a quarter period apart, in both
// directions, or pulses with a direction level.
//
// latency  1 cycle from a, b to count
// rate     one edge per cycle
// behaviour Each mode counts at fixed borders of the period, the same in both directions: mode 0
//          (x4) at every edge, mode 1 (x2) at the edges of a, mode 2 (x1) at the edges of a while
//          b is 0, mode 3 at the rising edges of a, up while b is 0 and down while b is 1. A
//          reversal at any edge therefore takes back what the edge added. direction is the
//          direction of the last edge, counted or not, the edge of this cycle included; before the
//          first edge it is 1, and in mode 3 it is 1 while b is 0. An illegal edge (in mode 3: b
//          changes while a rises) is not counted, so the count is wrong from then on.
// source   the two-bit Gray code. S0 corrects two jitter cases by interrupts (at its edges B and
//          C); here they need no correction.
// model    tb/decode/quadrature_decoder.py, equal in every bit of every cycle
// proved   count moves by at most one, only at a single edge and in its direction, and never
//          together with illegal; in the x4, x2 and x1 modes count and levels always agree if there
//          is no illegal edge
// proof    W = 8
`default_nettype none

module quadrature_decoder #(
    parameter int W      = 32,  // bits of count
    parameter int SETTLE = 8    // cycles after reset in which edges are ignored
) (
    input  wire                 clk,
    input  wire                 rst,        // level: count becomes 0, whatever the levels are
    input  wire         [  1:0] mode,       // 0 x4, 1 x2, 2 x1, 3 pulses and direction
    input  wire                 clear,      // strobe: count becomes 0, and drops this edge
    input  wire                 a,          // level: filtered channel A, synchronous to clk
    input  wire                 b,          // level: filtered channel B; up if b leads
    output logic                ready,      // level: edges are counted
    output logic                stepping,   // level: count steps at the end of this cycle, if ready
    output logic signed [W-1:0] count,      // 1/4, 1/2 or 1 period by mode, or pulses; wraps
    output logic signed [  1:0] step,       // counts gained in this cycle without clear: -1, 0, +1
    output logic                direction,  // level: 1 up, 0 down
    output logic                illegal     // strobe: a and b changed at once
);
    if (W < 2) begin : g_check_w
        W_MUST_BE_AT_LEAST_2 u_error ();
    end
    if (SETTLE < 1) begin : g_check_settle
        SETTLE_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam int S = $clog2(SETTLE + 1);
    localparam logic [1:0] X4 = 0, X1 = 2, PULSES = 3;

    logic [S-1:0] settle;  // cycles left until ready
    logic a_q, b_q;
    logic upward;  // direction of the last edge

    wire  edge_a = a ^ a_q;
    wire  edge_b = b ^ b_q;
    wire  up = mode == PULSES ? ~b : a ^ b_q;
    logic of_a;  // an edge of a counts at the present levels

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
    // quarters travelled; the low bits are the quarter within the period
    logic [W+1:0] travelled;
    // border at which count is zero; legal edges never move it
    logic [W-1:0] zero;
    wire  [  1:0] quarter = {b, a ^ b};  // a, b of 00 10 11 01 give 0 1 2 3
    wire  [  1:0] quarter_q = {b_q, a_q ^ b_q};
    wire  [  1:0] turned = quarter - quarter_q;
    wire  [W+1:0] travelled_now = travelled + {{W{turned == 3}}, turned};

    // Borders passed while travelling: x4 counts all, x2 those after quarters 0 and 2, x1 the one
    // after quarter 0.
    function automatic [W-1:0] borders(input [1:0] of_mode, input [W+1:0] of_travelled);
        logic [W+1:0] passed;
        case (of_mode)
            X4:      passed = of_travelled;
            2'd1:    passed = (of_travelled + 1'b1) >> 1;
            default: passed = (of_travelled + 2'd3) >> 2;
        endcase
        borders = passed[W-1:0];
    endfunction

    wire [W-1:0] count_now = clear ? '0 : count + {{W - 1{down}}, stepping};
    always @(posedge clk) begin
        past   <= 1'b1;
        mode_q <= mode;
        travelled    <= rst || !ready ? {{W{1'b0}}, quarter} : travelled_now;
        if (rst || !ready) zero <= borders(mode, {{W{1'b0}}, quarter});
        else if (clear || turned == 2 || mode != mode_q)
            zero <= borders(mode, travelled_now) - count_now;
        if (!past) assume (rst);
        if (past) begin
            assert (ready == (settle == '0));
            assert (ready || count == 0);
            assert (quarter_q == travelled[1:0]);
            if (mode_q != PULSES) assert (count == borders(mode_q, travelled) - zero);
        end
        if (past && !$past(rst)) begin
            assert (step != -2);
            assert (count == ($past(clear) ? W'(0) : W'($past(count) + {{W - 2{step[1]}}, step})));
            assert (!(illegal && step != 0));
            if (step != 0) assert ($past(ready) && ($past(a ^ a_q) ^ $past(b ^ b_q)));
            if (step != 0 && mode_q != PULSES)
                assert ($past(quarter) == 2'($past(quarter_q) + step));
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
