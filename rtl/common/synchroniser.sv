// SPDX-License-Identifier: Apache-2.0
// synchroniser -- bring levels of another clock, or of none, into clk.
//
// latency  STAGES clk                      rate  each bit by itself: bits of one word may arrive one clk apart
// source   a row of flops; 2 stages below 100 MHz, 3 from there up
// model    tb/common/synchroniser.py, equal in every bit of every cycle
`default_nettype none

module synchroniser #(
    parameter int W = 1,                        // independent levels
    parameter int STAGES = 2,                   // flops in a row
    parameter int RESET = 0                     // q during and just after reset
) (
    input  wire                  clk,
    input  wire                  rst,
    input  wire        [W-1:0]   d,             // levels, asynchronous
    output logic       [W-1:0]   q              // levels, synchronous to clk
);
    if (STAGES < 2) begin : g_check STAGES_MUST_BE_AT_LEAST_2 u_error (); end

    (* async_reg = "true" *) logic [W*STAGES-1:0] stages;

    assign q = stages[W*STAGES-1 -: W];

    always_ff @(posedge clk) begin
        stages <= {stages[W*(STAGES-1)-1:0], d};
        if (rst) stages <= {STAGES{W'(RESET)}};
    end
endmodule

`default_nettype wire
