// SPDX-License-Identifier: Apache-2.0
// switch_filter -- let the levels of switches change only after they have been stable for a time
// that a common strobe measures.
//
// latency  PERIODS - 1 to PERIODS periods of `sample` and 1 cycle from a level to filtered; 1 cycle
//          during start-up after reset
// rate     each level may change every PERIODS periods of `sample`
// behaviour A level passes with the `sample` with which it has differed for PERIODS of them. It is
//          watched in every cycle: a return to the old level, however short, begins the time again.
// source   S0: a monostable longer than the bounce of a contact
// model    tb/sense/switch_filter.py, equal in every bit of every cycle
// proved   a change passes only with `sample`, after the level has kept its new value since the
//          PERIODS-th last `sample`, and then it always passes
// proof    W = 1, PERIODS = 3
`default_nettype none

module switch_filter #(
    parameter int W       = 2,  // number of switches
    parameter int PERIODS = 8,  // periods of sample that a level must be stable
    parameter int SETTLE  = 4   // cycles after reset in which filtered follows level
) (
    input  wire          clk,
    input  wire          rst,      // level: filtered follows level
    input  wire          sample,   // strobe: a period of the time has passed
    input  wire  [W-1:0] level,    // levels, synchronous to clk
    output logic [W-1:0] filtered  // levels: without bounce
);
    if (PERIODS < 2 || PERIODS > 256) begin : g_check_periods
        PERIODS_MUST_BE_FROM_2_TO_256 u_error ();
    end
    if (SETTLE < 1) begin : g_check_settle
        SETTLE_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam int P = $clog2(PERIODS);
    localparam int S = $clog2(SETTLE + 1);

    logic [S-1:0] settle;  // cycles left of the start-up
    logic         settling;

    always_ff @(posedge clk) begin
        if (settling) settle <= settle - 1'b1;
        settling <= settle != '0 && settle != S'(1);
        if (rst) begin
            settle   <= S'(SETTLE);
            settling <= 1'b1;
        end
    end

    for (genvar n = 0; n < W; n++) begin : g_switch
        logic [P-1:0] age;  // samples in a row with which the level differed

        wire          differs = level[n] ^ filtered[n];
        wire          ripe = sample && age == P'(PERIODS - 1);

        always_ff @(posedge clk) begin
            if (sample) age <= age + 1'b1;
            if (!differs || ripe || settling || rst) age <= '0;
            if (ripe || settling || rst) filtered[n] <= level[n];
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    // samples in a row, up to the last one, with which level 0 had its present value
    logic [P:0] same;
    logic       level_q;
    wire  [P:0] earlier = level[0] == level_q ? same : '0;
    always @(posedge clk) begin
        past    <= 1'b1;
        level_q <= level[0];
        same    <= earlier + {{P{1'b0}}, sample && earlier != '1};
        if (!past) same <= '0;
        if (!past) assume (rst);
        if (past) begin
            assert (settling == (settle != '0));
            assert (g_switch[0].age < PERIODS);
            if (settling) assert (level_q == filtered[0]);
            if (level_q == filtered[0]) begin
                assert (g_switch[0].age == 0);
            end else begin
                assert (same == {1'b0, g_switch[0].age});
            end
            if (same >= PERIODS) assert (filtered[0] == level_q);
        end
        if (past && !$past(rst) && !$past(settling) && filtered[0] != $past(filtered[0])) begin
            assert ($past(sample) && filtered[0] == level_q && same == PERIODS);
            cover (filtered[0]);
        end
    end
`endif
endmodule

`default_nettype wire
