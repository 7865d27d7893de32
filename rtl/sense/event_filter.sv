// SPDX-License-Identifier: Apache-2.0
// event_filter -- let levels change only after N samples of the new level with at most M - N of the
// old level in between, and report the disturbances that are removed.
//
// latency  N samples from a clean edge to filtered; 1 cycle in bypass (N of 0 or 1 without skip)
//          and during start-up after reset
// rate     one sample per skip + 1 cycles; pulses of N (skip + 1) cycles pass, those of (N - 1)
//          (skip + 1) cycles never do
// behaviour A disturbance is followed from its first sample, and forgotten at the sample of the old
//          level that exceeds M - N. This is stricter than a sliding window of M samples and needs
//          no memory. With tolerated = 0 and skip = 0 the filter equals the deglitcher. A new
//          value of skip acts at once, a new value of required one cycle later; required and
//          tolerated act on new disturbances only.
// source   S2: N-of-M event filter, N equal samples at a chosen sampling rate
// model    tb/sense/event_filter.py, equal in every bit of every cycle
// proved   a change passes only at a sample, and only if N of the last M samples had the new
//          level, none of them from before the preceding change
// proof    depth 16, W = 3, TOLERATED_W = 2, SKIP_W = 2, SETTLE = 2
`default_nettype none

module event_filter #(
    parameter int LEVELS      = 1,   // number of levels, sampled together
    parameter int W           = 8,   // bits of required
    parameter int TOLERATED_W = 4,   // bits of tolerated
    parameter int SKIP_W      = 16,  // bits of skip
    parameter int SETTLE      = 4    // cycles after reset in which filtered follows level
) (
    input  wire                    clk,
    input  wire                    rst,        // level: filtered follows level, nothing is reported
    input  wire  [     SKIP_W-1:0] skip,       // cycles left out between two samples
    input  wire  [          W-1:0] required,   // samples N; 0 acts as 1: every sample passes
    input  wire  [TOLERATED_W-1:0] tolerated,  // samples M - N; 0: N samples in a row
    input  wire  [     LEVELS-1:0] level,      // levels, synchronous to clk
    output logic [     LEVELS-1:0] filtered,   // levels: without disturbances
    output logic [     LEVELS-1:0] rejected    // strobes: a disturbance was removed
);
    if (LEVELS < 1 || W < 1 || TOLERATED_W < 1 || SKIP_W < 1) begin : g_check_w
        WIDTHS_MUST_BE_AT_LEAST_1 u_error ();
    end
    if (SETTLE < 1) begin : g_check_settle
        SETTLE_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam int S = $clog2(SETTLE + 1);

    logic [     S-1:0] settle;  // cycles left of the start-up
    logic              settling;
    logic [SKIP_W-1:0] skipped;  // cycles since the last sample, less one

    // required - 1; registered to keep required out of long paths
    logic [     W-1:0] last;

    // A number counted up from 0 contains all bits of another one for the first time when they are
    // equal. The comparison needs no adder, and the counters never overflow.
    wire               due = &(skipped | ~skip);
    wire  [LEVELS-1:0] active;  // a sample of the level can change something
    wire               sample = due && active != '0;

    always_ff @(posedge clk) begin
        last <= required - W'(required != '0);
        skipped <= due ? '0 : skipped + 1'b1;
        if (settling) settle <= settle - 1'b1;
        settling <= settle != '0 && settle != S'(1);
        if (rst) begin
            skipped  <= '0;
            settle   <= S'(SETTLE);
            settling <= 1'b1;
        end
    end

    for (genvar i = 0; i < LEVELS; i++) begin : g_level
        logic [          W-1:0] seen;  // samples of the new level
        // samples of the old level since the first of the new
        logic [TOLERATED_W-1:0] against;

        wire                    differs = level[i] ^ filtered[i];
        wire                    ripe = &(seen | ~last);
        wire                    over = &(against | ~tolerated);
        wire                    ends = sample && (differs ? ripe : over);

        assign active[i] = differs || seen != '0;

        always_ff @(posedge clk) begin
            rejected[i] <= !settling && ends && !differs && seen != '0;
            if (settling || (ends && differs)) filtered[i] <= level[i];
            if (sample && differs) seen <= seen + 1'b1;
            if (sample && !differs && active[i]) against <= against + 1'b1;
            if (settling || ends) begin
                seen    <= '0;
                against <= '0;
            end
            if (rst) begin
                seen        <= '0;
                against     <= '0;
                rejected[i] <= 1'b0;
                // a block that is reset together with this one never sees a false edge
                filtered[i] <= level[i];
            end
        end
    end

`ifdef FORMAL
    localparam int MOST = (1 << W) + (1 << TOLERATED_W);  // samples that a disturbance can last
    logic past = 1'b0;
    logic [W-1:0] needed_q;
    // level 0: which samples had the new level; the last one is bit 0
    logic [MOST-1:0] history;
    logic [W:0] news[0:MOST];  // how many of the last n samples had the new level
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
        else if (due) history <= g_level[0].differs && g_level[0].ripe ? '0 : now;
        if (!past) assume (rst);
        // a new value acts on new disturbances only
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
            // by the loop above, they are all among the last `lasted` + 1 samples
            assert ($past(seen) + 1 >= {1'b0, $past(needed_q)});
            assert ($past(lasted) <= $past(seen) + {1'b0, $past(tolerated)});
            cover ($past(needed_q) == 4 && $past(lasted) == 5 && $past(skip) == 1);
        end
        cover (rejected[0] && $past(tolerated) == 1 && $past(seen) == 3);
    end
`endif
endmodule

`default_nettype wire
