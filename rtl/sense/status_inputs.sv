// SPDX-License-Identifier: Apache-2.0
// status_inputs -- read slow levels of another machine, such as its lamps by opto-coupler: remove
// contact bounce and report each change.
//
// latency  time_ms to time_ms + 1 ms, and 2 cycles, from the last bounce to level, rose and fell
// rate     one change per time_ms and 1 cycle
// source   S4: the EDM machine reports by contacts whether it cuts and whether there is a fault
// limits   a level that is present at reset is no change
// model    tb/sense/status_inputs.py, equal in every bit of every cycle
// proved   rose and fell report every change of level, once each, and nothing else; a level
//          changes only after the input was stable without a break
// proof    depth 24, CLK_HZ = 3000, W = 1
`default_nettype none

module status_inputs #(
    parameter int CLK_HZ = 50_000_000,  // Hz: frequency of clk
    parameter int W      = 2            // number of levels
) (
    input  wire          clk,
    input  wire          rst,      // level: `level` follows the inputs
    input  wire  [ 15:0] time_ms,  // ms that an input must be stable
    input  wire  [W-1:0] inputs,   // levels, asynchronous
    output logic [W-1:0] level,    // levels, free of bounce
    output logic [W-1:0] rose,     // strobes: the level became 1
    output logic [W-1:0] fell      // strobes: the level became 0
);
    if (CLK_HZ < 1000) begin : g_check
        CLK_HZ_MUST_BE_AT_LEAST_1000 u_error ();
    end

    localparam int SETTLE = 4;  // cycles after reset in which level follows: the synchroniser fills
    localparam int MS = CLK_HZ / 1000;
    localparam int P = MS > 1 ? $clog2(MS) : 1;

    logic [W-1:0] now, level_q;
    logic [  2:0] settle;  // cycles left of the start-up, one more for level_q
    logic [P-1:0] part;  // cycles of this ms so far

    wire          settling = settle > 3'd1;
    wire          ms = part == P'(MS - 1);

    synchroniser #(
        .W(W)
    ) u_inputs (
        .clk,
        .rst,
        .d(inputs),
        .q(now)
    );

    assign rose = settle == '0 ? level & ~level_q : '0;
    assign fell = settle == '0 ? ~level & level_q : '0;

    always_ff @(posedge clk) begin
        level_q <= level;
        settle  <= settle - 3'(settle != '0);
        part    <= ms ? '0 : part + 1'b1;
        if (rst) begin
            settle <= 3'(SETTLE + 1);
            part   <= '0;
        end
    end

    for (genvar n = 0; n < W; n++) begin : g_input
        logic [15:0] stable;  // ms boundaries since the input has differed without a break

        wire         differs = now[n] != level[n];
        wire         ripe = ms && stable >= time_ms;

        always_ff @(posedge clk) begin
            stable <= !differs || ripe ? '0 : stable + 16'(ms);
            if (differs && ripe) level[n] <= now[n];
            if (rst || settling) begin
                stable    <= '0;
                level[n] <= now[n];
            end
        end
    end

`ifdef FORMAL
    logic        past = 1'b0;
    // cycles in a row in which input 0 has differed from its level
    logic [15:0] unbroken;
    wire  [31:0] stable = 32'(g_input[0].stable);
    always @(posedge clk) begin
        past     <= 1'b1;
        unbroken <= rst || settling || now[0] == level[0] ? '0 : unbroken + 16'(!(&unbroken));
        if (!past) assume (rst);
        // unbroken does not saturate
        if (past) assume (time_ms == $past(time_ms) && time_ms < 16'd1000);
        if (past) begin
            assert (settle <= 3'(SETTLE + 1) && part < P'(MS));
            assert (stable <= 32'(time_ms));
            if (stable != 0) assert (32'(unbroken) >= (stable - 1) * MS + 32'(part) + 1);
        end
        if (past && !$past(rst)) begin
            assert (rose[0] == (settle == '0 && level[0] && !$past(level[0])));
            assert (fell[0] == (settle == '0 && !level[0] && $past(level[0])));
            if (!$past(settling) && level[0] != $past(level[0]))
                assert (32'($past(unbroken)) >= 32'(time_ms) * MS);
            cover (rose[0] && time_ms == 16'd2);
            cover (fell[0] && time_ms == 16'd1);
        end
    end
`endif
endmodule

`default_nettype wire
