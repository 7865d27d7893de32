// SPDX-License-Identifier: Apache-2.0
// synchroniser -- bring asynchronous levels, or levels of another clock, into the domain of clk.
//
// latency  STAGES cycles from d to q
// rate     one level of each bit per cycle
// source   a chain of STAGES flip-flops: 2 are enough below 100 MHz, use 3 from 100 MHz up
// limits   The bits are independent: bits of one word that change together may arrive one cycle
//          apart.
// model    tb/common/synchroniser.py, equal in every bit of every cycle
// proved   q equals d of STAGES cycles ago; until the first level taken after reset arrives, q is
//          RESET
// proof    W = 2, STAGES = 3, RESET = 1
`default_nettype none

module synchroniser #(
    parameter int W      = 1,  // number of independent levels
    parameter int STAGES = 2,  // flip-flops in each chain, at least 2
    parameter int RESET  = 0   // value of q during reset and until the first level arrives
) (
    input  wire          clk,
    input  wire          rst,  // level: q becomes RESET
    input  wire  [W-1:0] d,    // levels, asynchronous
    output logic [W-1:0] q     // levels, synchronous to clk
);
    if (STAGES < 2) begin : g_check
        STAGES_MUST_BE_AT_LEAST_2 u_error ();
    end

    (* async_reg = "true" *) logic [W*STAGES-1:0] stages;

    assign q = stages[W*STAGES-1-:W];

    always_ff @(posedge clk) begin
        stages <= {stages[W*(STAGES-1)-1:0], d};
        if (rst) stages <= {STAGES{W'(RESET)}};
    end

`ifdef FORMAL
    logic              past = 1'b0;
    // bit n: stage n holds a level taken after reset
    logic [STAGES-1:0] taken;
    always @(posedge clk) begin
        past  <= 1'b1;
        taken <= rst ? '0 : {taken[STAGES-2:0], 1'b1};
        if (!past) assume (rst);
        if (past) begin
            for (int n = 0; n < STAGES; n++) if (!taken[n]) assert (stages[W*n+:W] == W'(RESET));
            if (taken[STAGES-1]) begin
                assert (q == $past(d, STAGES));
            end else begin
                assert (q == W'(RESET));
            end
            cover (taken[STAGES-1] && q == 2 && $past(q) == 1);
        end
    end
`endif
endmodule

`default_nettype wire
