// SPDX-License-Identifier: Apache-2.0
// recorded_encoder -- test bench: pairs of recorded levels, each through two deglitchers into a
// decoder, as in an axis.
//
`default_nettype none

module recorded_encoder #(
    parameter int PAIRS = 4  // number of pairs
) (
    input  wire                 clk,
    input  wire                 rst,            // level: all counts become 0
    input  wire  [        15:0] stable_cycles,  // cycles, setting of the deglitchers
    input  wire  [         1:0] mode,           // as in quadrature_decoder
    input  wire  [   PAIRS-1:0] a,              // levels, one per pair
    input  wire  [   PAIRS-1:0] b,              // levels, one per pair
    output wire  [32*PAIRS-1:0] counts,         // counts, 32 bits per pair, pair 0 lowest
    output logic [32*PAIRS-1:0] edges,          // counted edges or pulses of both directions
    output logic [32*PAIRS-1:0] rejections,     // pulses rejected on a and on b
    output logic [   PAIRS-1:0] illegal         // levels: an illegal edge since reset
);
    for (genvar i = 0; i < PAIRS; i++) begin : g_pair
        wire a_filtered, b_filtered, a_rejected, b_rejected, skipped;
        wire ready, stepping, direction;
        wire signed [1:0] step;

        deglitcher u_deglitcher_a (
            .clk,
            .rst,
            .stable_cycles,
            .level   (a[i]),
            .filtered(a_filtered),
            .rejected(a_rejected)
        );
        deglitcher u_deglitcher_b (
            .clk,
            .rst,
            .stable_cycles,
            .level   (b[i]),
            .filtered(b_filtered),
            .rejected(b_rejected)
        );
        quadrature_decoder u_decoder (
            .clk,
            .rst,
            .mode,
            .clear  (1'b0),
            .a      (a_filtered),
            .b      (b_filtered),
            .ready,
            .stepping,
            .count  (counts[32*i+:32]),
            .step,
            .direction,
            .illegal(skipped)
        );
        wire unused = &{1'b0, ready, stepping, direction};

        always_ff @(posedge clk) begin
            edges[32*i +: 32]      <= edges[32*i +: 32] + 32'(step != 0);
            rejections[32*i +: 32] <= rejections[32*i +: 32] + 32'(a_rejected) + 32'(b_rejected);
            illegal[i]             <= illegal[i] | skipped;
            if (rst) begin
                edges[32*i +: 32]      <= '0;
                rejections[32*i +: 32] <= '0;
                illegal[i]             <= 1'b0;
            end
        end
    end
endmodule

`default_nettype wire
