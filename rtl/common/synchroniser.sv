// SPDX-License-Identifier: Apache-2.0
// synchroniser -- bring levels of another clock, or of none, into clk.
//
// latency  STAGES clk
// rate     each bit by itself: bits of one word may arrive
//          one clk apart
// source   a row of flops; 2 stages below 100 MHz, 3 from there up
// model    tb/common/synchroniser.py, equal in every bit of every cycle
// proved   q is d of STAGES clk before, and RESET until a level taken after reset has come through
// proof    W = 2, STAGES = 3, RESET = 1
`default_nettype none

module synchroniser #(
    parameter int W      = 1,  // independent levels
    parameter int STAGES = 2,  // flops in a row
    parameter int RESET  = 0   // q during and just after reset
) (
    input  wire          clk,
    input  wire          rst,
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
    // q of 0, 1, … clk from now comes of a level, not of reset
    logic [STAGES-1:0] taken;
    always @(posedge clk) begin
        past  <= 1'b1;
        taken <= rst ? '0 : {taken[STAGES-2:0], 1'b1};
        if (!past) assume (rst);
        if (past) begin
            for (int n = 0; n < STAGES; n++) if (!taken[n]) assert (stages[W*n+:W] == W'(RESET));
            if (taken[STAGES-1])
                assert (q == $past(d, STAGES));
                else assert (q == W'(RESET));
            cover (taken[STAGES-1] && q == 2 && $past(q) == 1);
        end
    end
`endif
endmodule

`default_nettype wire
