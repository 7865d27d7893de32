// SPDX-License-Identifier: Apache-2.0
// event_filter -- let levels change only after N samples of the new level with at most M - N of the
// old one between, and report what died out before.
//
// latency  N samples from a clean edge to filtered; 1 clk in bypass and while it settles after
//          reset
// rate     a sample every skip + 1 clk; pulses of N (skip + 1) clk pass, those of (N - 1) (skip +
//          1) clk never do
// source   S2: N-of-M event filter, N equal samples at a chosen sampling rate. A disturbance is
//          followed from its first sample and forgotten once M - N samples have spoken against it
//          and one more does: stricter than a sliding window of M, and without its memory. With
//          tolerated = 0, skip = 0 it is the deglitcher
// model    tb/sense/event_filter.py, equal in every bit of every cycle
// proved   a change passes only at a sample, and only if N of the last M samples had the new level,
//          none of them from before the last change
// proof    depth 16, W = 3, TOLERATED_W = 2, SKIP_W = 2, SETTLE = 2
`default_nettype none

module event_filter #(
    parameter int LEVELS = 1,  // levels filtered side by side, sampled at once
    parameter int W = 8,  // bits of required
    parameter int TOLERATED_W = 4,  // bits of tolerated
    parameter int SKIP_W = 16,  // bits of skip
    parameter int SETTLE  = 4               // clk after reset in which filtered follows level: synchronisers fill meanwhile
) (
    input wire clk,
    input wire rst,  // filtered follows level, nothing is reported
    input  wire  [SKIP_W-1:0]  skip,        // clk left out between two samples; a new value acts from the next sample on
    input  wire  [W-1:0]       required,      // N; 0 is taken as 1: every sample passes, with skip = 0 a bypass. A new value acts one
    input  wire  [TOLERATED_W-1:0] tolerated,       // M - N; 0: N samples in a row                 clk later, both on new disturbances only
    input wire [LEVELS-1:0] level,  // synchronous to clk
    output logic [LEVELS-1:0] filtered,  // level without its disturbances
    output logic [LEVELS-1:0] rejected  // strobe: a disturbance has died out
);
    if (LEVELS < 1 || W < 1 || TOLERATED_W < 1 || SKIP_W < 1) begin : g_check_w
        WIDTHS_MUST_BE_AT_LEAST_1 u_error ();
    end
    if (SETTLE < 1) begin : g_check_settle
        SETTLE_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam int S = $clog2(SETTLE + 1);

    logic [     S-1:0] settle;  // clk left of settling
    logic              settling;
    logic [SKIP_W-1:0] left;  // clk until the next sample

    // samples before the one that passes; registered, so that required is in no long path
    logic [     W-1:0] last;

    wire               sample = left == '0;

    always_ff @(posedge clk) begin
        last <= required - W'(required != '0);
        left <= sample ? skip : left - 1'b1;
        if (settling) settle <= settle - 1'b1;
        settling <= settle != '0 && settle != S'(1);
        if (rst) begin
            left     <= '0;
            settle   <= S'(SETTLE);
            settling <= 1'b1;
        end
    end

    for (genvar i = 0; i < LEVELS; i++) begin : g_level
        logic [          W-1:0] seen;  // samples of the new level
        // samples of the old level since the first of the new
        logic [TOLERATED_W-1:0] against;

        // a number counted up from 0 first has all bits of another when it is the other: no adder,
        // and never past all ones
        wire                    differs = level[i] ^ filtered[i];
        wire                    ripe = &(seen | ~last);
        wire                    over = &(against | ~tolerated);

        always_ff @(posedge clk) begin
            rejected[i] <= !settling && sample && !differs && over && seen != '0;
            if (settling || (sample && differs && ripe)) filtered[i] <= level[i];
            if (sample) begin
                if (differs) seen <= seen + 1'b1;
                else if (seen != '0) against <= against + 1'b1;
                if (settling || (differs ? ripe : over)) begin
                    seen    <= '0;
                    against <= '0;
                end
            end
            if (rst) begin
                seen        <= '0;
                against     <= '0;
                rejected[i] <= 1'b0;
                // who is reset together with this block never sees a made-up edge
                filtered[i] <= level[i];
            end
        end
    end

`ifdef FORMAL
    localparam int MOST = (1 << W) + (1 << TOLERATED_W);  // samples that a disturbance can last
    logic past = 1'b0;
    logic [W-1:0] needed_q;
    // of level 0: which samples had the new level, the last lowest
    logic [MOST-1:0] history;
    logic [W:0] news[0:MOST];  // how many of the last n had
    wire [MOST-1:0] now = {history[MOST-2:0], g_level[0].differs};
    wire [W:0] seen = {1'b0, g_level[0].seen};
    wire [W:0] lasted = seen + {1'b0, g_level[0].against};
    always_comb begin
        news[0] = '0;
        for (int n = 0; n < MOST; n++) news[n+1] = news[n] + history[n];
    end
    always @(posedge clk) begin
        past    <= 1'b1;
        needed_q <= required;
        if (rst || settling) history <= '0;
        else if (sample) history <= g_level[0].differs && g_level[0].ripe ? '0 : now;
        if (!past) assume (rst);
        // a new value is for new disturbances
        if (past && seen != 0) assume (tolerated == $past(tolerated));
        if (past) begin
            assert (seen == 0 || g_level[0].against <= tolerated);
            assert (settling == (settle != '0));
            assert (last == needed_q - W'(needed_q != '0));
            assert (!settling || seen == 0);
            assert (seen != 0 || g_level[0].against == 0);
            for (int n = 0; n < MOST; n++) if (lasted == n) assert (news[n] == seen);
        end
        if (past && !$past(rst) && !$past(settling) && filtered[0] != $past(filtered[0])) begin
            assert ($past(sample) && $past(level[0]) == filtered[0]);
            assert (!rejected[0]);
            // all among the last `lasted` + 1 samples, by the loop above
            assert ($past(seen) + 1 >= {1'b0, $past(needed_q)});
            assert ($past(lasted) <= $past(seen) + {1'b0, $past(tolerated)});
            cover ($past(needed_q) == 4 && $past(lasted) == 5 && $past(skip) == 1);
        end
        cover (rejected[0] && $past(tolerated) == 1 && $past(seen) == 3);
    end
`endif
endmodule

`default_nettype wire
