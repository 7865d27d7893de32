// SPDX-License-Identifier: Apache-2.0
// step_follower -- tell a step generator each tick where to go: the target and a trim, in motor steps, and when to begin anew there.
//
// latency  58 clk from tick to go or anew; target and trim are taken 8 clk after tick, when those of this tick stand
// rate     a tick per 58 clk at least
// anew     the first place after the drive came on, and after the target was moved by other than motion (rebase), is where
//          the generator begins, without a step
// model    tb/drive/step_follower.py, equal in every bit of every cycle
// proved   never go and anew at once; no go with a place that was taken before a rebase or with the drive off
// proof    depth 62
`default_nettype none

module step_follower (
    input  wire                  clk,
    input  wire                  rst,
    input  wire signed [47:0]    ratio,         // 2^-32 step per period, either sign
    input  wire        [3:0]     shift,         // of trim
    input  wire                  enable,        // level: the drive is on
    input  wire                  rebase,        // strobe: target := position, or the origin moves
    input  wire                  tick,          // strobe: servo tick
    input  wire signed [47:0]    target,        // 2^-16 period
    input  wire signed [15:0]    trim,          // 2^(shift - 16) period
    output logic                 go,            // strobe: draw a line to place
    output logic                 anew,          // strobe: begin a line at place
    output logic signed [47:0]   place          // Q32.16 steps
);
    logic [3:0] wait_clk;
    logic       rebased, pending;               // since the place was taken; before

    wire take = wait_clk == 4'd1;
    wire done;
    wire signed [47:0] wanted = target + (48'(trim) <<< shift);

    step_scaler u_scaler (.clk, .rst, .ratio, .valid(take), .position(wanted), .done, .steps(place));

    wire fresh = pending || rebased || rebase || !enable;

    assign go   = done && !fresh;
    assign anew = done && fresh;

    always_ff @(posedge clk) begin
        wait_clk <= tick ? 4'd8 : wait_clk == 4'd0 ? 4'd0 : wait_clk - 1'b1;
        rebased  <= rebase || !enable || (rebased && !take);
        if (take) pending <= rebased;
        if (rst) begin
            wait_clk <= '0;
            rebased  <= 1'b1;
            pending  <= 1'b1;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [6:0] since_tick, since_move;         // clk; since_move: since the target was moved or the drive was off
    always @(posedge clk) begin
        past       <= 1'b1;
        since_tick <= tick || rst ? 7'd1 : since_tick + 7'(since_tick != '1);
        since_move <= rebase || !enable || rst ? 7'd1 : since_move + 7'(since_move != '1);
        if (!past) assume (rst);
        if (past && since_tick < 7'd58) assume (!tick);
        if (past && !$past(rst)) begin
            assert (!(go && anew));
            if (go) assert (enable && !rebase && since_move > 7'd50);
            cover (go && $past(anew, 58));
        end
    end
`endif
endmodule

`default_nettype wire
