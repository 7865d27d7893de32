// SPDX-License-Identifier: Apache-2.0
// step_follower -- tell a step generator each tick where to go: the target and a trim, in motor
// steps, and when to begin restart there.
//
// latency  57 clk from tick to go or restart; target and trim are taken in the 8th clk after tick,
//          when those of this tick stand
// rate     a tick per 57 clk at most
//          restart     the first position after the drive came on, and after the target was moved by other
//             than motion (rebase), is where
//          the generator begins, without a step
// model    tb/drive/step_follower.py, equal in every bit of every cycle
// proved   never go and restart at once; after a rebase, or with the drive off, no go before an
//          restart
// proof    depth 125
`default_nettype none

module step_follower (
    input  wire                clk,
    input  wire                rst,
    input  wire signed  [47:0] ratio,    // 2^-32 step per period, either sign
    input  wire         [ 3:0] shift,    // of trim
    input  wire                enable,   // level: the drive is on
    input  wire                rebase,   // strobe: target := position, or the origin moves
    input  wire                tick,     // strobe: servo tick
    input  wire signed  [47:0] target,   // 2^-16 period
    input  wire signed  [15:0] trim,     // 2^(shift - 16) period
    output logic               go,       // strobe: draw a line to position
    output logic               restart,  // strobe: begin a line at position
    output logic signed [47:0] position  // Q32.16 steps
);
    logic [3:0] wait_cycles;
    logic rebased, pending;  // since the position was taken; before

    wire               take = wait_cycles == 4'd1;
    wire               done;
    wire signed [47:0] required = target + (48'(trim) <<< shift);

    step_scaler u_scaler (
        .clk,
        .rst,
        .ratio,
        .valid   (take),
        .position(required),
        .done,
        .steps   (position)
    );

    wire fresh = pending || rebased || rebase || !enable;

    assign go   = done && !fresh;
    assign restart = done && fresh;

    always_ff @(posedge clk) begin
        wait_cycles <= tick ? 4'd8 : wait_cycles == 4'd0 ? 4'd0 : wait_cycles - 1'b1;
        rebased  <= rebase || !enable || (rebased && !take);
        pending  <= (take && rebased) || (pending && !done);
        if (rst) begin
            wait_cycles <= '0;
            rebased  <= 1'b1;
            pending  <= 1'b1;
        end
    end

`ifdef FORMAL
    // target was moved, or the drive was off, since a position was begun at
    logic past = 1'b0, moved = 1'b1;
    always @(posedge clk) begin
        past  <= 1'b1;
        moved <= rst || rebase || !enable || (moved && !restart);
        if (!past) assume (rst);
        if (past) begin
            assert (!(go && restart));
            if (rst || rebase || !enable || moved) assert (rst || !go);
            assert (!moved || rebased || pending);
            cover (go && $past(restart, 60));
        end
    end
`endif
endmodule

`default_nettype wire
