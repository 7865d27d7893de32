// SPDX-License-Identifier: Apache-2.0
// deglitcher -- let a level change only after it has been stable for a set time, and report shorter
// pulses.
//
// latency  `stable_cycles` cycles from level to filtered; 1 cycle for stable_cycles = 0 and during
//          start-up after reset
// rate     pulses of `stable_cycles` cycles and longer pass, shorter ones never do
// source   S0: a monostable longer than a noise spike and shorter than a data pulse; S2: N equal
//          samples in a row
// model    tb/sense/deglitcher.py, equal in every bit of every cycle
// proved   a change passes only after `stable_cycles` equal cycles, then passes at once, and never
//          sooner than that after the preceding change
`default_nettype none

module deglitcher #(
    parameter int W      = 16,  // bits of stable_cycles
    parameter int SETTLE = 4    // cycles after reset in which filtered follows level
) (
    input  wire          clk,
    input  wire          rst,            // level: filtered follows level, nothing is reported
    input  wire  [W-1:0] stable_cycles,  // cycles that level must differ; 0 acts as 1; acts at once
    input  wire          level,          // level, synchronous to clk
    output logic         filtered,       // level: without pulses that are too short
    output logic         rejected        // strobe: level changed back too early
);
    if (W < 1) begin : g_check_w
        W_MUST_BE_AT_LEAST_1 u_error ();
    end
    if (SETTLE < 1) begin : g_check_settle
        SETTLE_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam int S = $clog2(SETTLE + 1);

    logic [S-1:0] settle;  // cycles left of the start-up
    // cycles in a row that level has differed; below stable_cycles, so it cannot overflow
    logic [W-1:0] age;

    wire          differs = level ^ filtered;
    wire          ripe = {1'b0, age} + 1'b1 >= {1'b0, stable_cycles};

    always_ff @(posedge clk) begin
        rejected <= 1'b0;
        if (settle != '0) begin
            settle   <= settle - 1'b1;
            filtered <= level;
        end else if (!differs) begin
            rejected <= age != '0;
            age      <= '0;
        end else if (ripe) begin
            filtered <= level;
            age      <= '0;
        end else begin
            age <= age + 1'b1;
        end
        if (rst) begin
            settle   <= S'(SETTLE);
            age      <= '0;
            rejected <= 1'b0;
            // a block that is reset together with this one never sees a false edge
            filtered <= level;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic       level_q;
    // cycles in a row, up to the last one, in which level was level_q
    logic [W:0] same;
    logic [W:0] unchanged;  // cycles since filtered changed
    always @(posedge clk) begin
        past    <= 1'b1;
        level_q <= level;
        same    <= !past || level != level_q ? 1 : same + !(&same);
        unchanged   <= rst || settle != '0 || (differs && ripe) ? 0 : unchanged + !(&unchanged);
        if (!past) assume (rst);
        if (past) begin
            assert (same != 0);
            assert (age == 0 || (level_q != filtered && same >= {1'b0, age} && settle == 0));
            assert (unchanged >= {1'b0, age});
        end
        if (past && !$past(rst) && $past(settle) == 0) begin
            if (filtered != $past(filtered)) begin
                assert (filtered == level_q);
                assert (same >= {1'b0, $past(stable_cycles)});
                assert ({1'b0, $past(unchanged)} + 1 >= {2'b0, $past(stable_cycles)});
                assert (!rejected);
                cover ($past(stable_cycles) == 5);
            end
            if (filtered != level_q) assert (age != 0 && age < $past(stable_cycles));
            cover (rejected && $past(stable_cycles) == 5 && $past(age) == 4);
        end
    end
`endif
endmodule

`default_nettype wire
