// SPDX-License-Identifier: Apache-2.0
// quadrature_decoder -- count every edge of two square waves a quarter period apart, in both directions.
//
// latency  1 clk from a, b to count        rate  one edge per clk
// source   the Gray code of two bits; a reversal over any edge takes back what the edge gave, so the two jitter cases
//          that S0 patches by interrupt (over its edges B and C) need no patch
// model    tb/decode/quadrature_decoder.py, equal in every bit of every cycle
// proved   count moves by at most one, only at a single edge and in its direction, never with illegal; without illegal
//          edges count and levels agree modulo one period for ever
`default_nettype none

module quadrature_decoder #(
    parameter int W      = 32,              // bits of count
    parameter int SETTLE = 8                // clk after reset in which a, b are only taken: what is in front starts up too
) (
    input  wire                  clk,
    input  wire                  rst,       // count becomes zero, whatever the levels are
    input  wire                  a,         // level, synchronous to clk and already filtered
    input  wire                  b,         // level; a leading b counts up
    output logic signed [W-1:0]  count,     // 1/4 period, wraps
    output logic signed [1:0]    step,      // what count moved by in this clk: -1, 0, +1
    output logic                 illegal    // strobe: a and b changed at once; not counted, count is off by two from here on
);
    if (W < 2)      begin : g_check_w W_MUST_BE_AT_LEAST_2 u_error (); end
    if (SETTLE < 1) begin : g_check_settle SETTLE_MUST_BE_AT_LEAST_1 u_error (); end

    localparam int S = $clog2(SETTLE + 1);

    logic [S-1:0] settle;                   // clk left of settling
    logic         a_q, b_q;

    wire settled = settle == '0;
    wire edge_a  = settled & (a ^ a_q);
    wire edge_b  = settled & (b ^ b_q);
    wire up      = a ^ b_q;

    always_ff @(posedge clk) begin
        a_q     <= a;
        b_q     <= b;
        step    <= {(edge_a ^ edge_b) & ~up, edge_a ^ edge_b};
        illegal <= edge_a & edge_b;
        if (edge_a ^ edge_b) count <= up ? count + 1'b1 : count - 1'b1;
        if (!settled) settle <= settle - 1'b1;
        if (rst) begin
            settle  <= S'(SETTLE);
            count   <= '0;
            step    <= '0;
            illegal <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [1:0] origin;                     // where in the period count is zero; a skipped state moves it by half a period
    wire  [1:0] place   = {b, a ^ b};       // quarter of the period: 00 10 11 01 of a, b are 0 1 2 3
    wire  [1:0] place_q = {b_q, a_q ^ b_q};
    always @(posedge clk) begin
        past   <= 1'b1;
        origin <= rst || !settled ? place : origin + {edge_a & edge_b, 1'b0};
        if (!past) assume (rst);
        if (past) begin
            assert (settled || count == 0);
            assert (count[1:0] == 2'(place_q - origin));
        end
        if (past && !$past(rst)) begin
            assert (step != -2);
            assert (count == W'($past(count) + step));
            assert (!(illegal && step != 0));
            if (step != 0) assert ($past(settled) && ($past(a ^ a_q) ^ $past(b ^ b_q)));
            if (step != 0) assert ($past(place) == 2'($past(place_q) + step));
            cover (count == 3);
            cover (count == -3);
            cover (illegal);
        end
    end
`endif
endmodule

`default_nettype wire
