// SPDX-License-Identifier: Apache-2.0
// step_follower -- scale the target position and a trim to motor steps once per servo tick, and
// tell the step generator to go there or to restart there.
//
// latency   57 cycles from tick to go or restart. Target and trim are taken in the 8th cycle after
//           tick, when the values of this tick are valid.
// rate      at most one tick per 57 cycles
// behaviour The generator restarts, without making a step, at the first position after the drive
//           came on, and after something other than motion moved the target (rebase).
// model     tb/drive/step_follower.py, equal in every bit of every cycle
// proved    go and restart never come together. After a rebase, or while the drive is off, no go
//           comes before a restart.
// proof     depth 125
`default_nettype none

module step_follower (
    input  wire                clk,
    input  wire                rst,
    input  wire signed  [47:0] ratio,    // 2^-32 step per period, either sign
    input  wire         [ 3:0] shift,    // bits by which trim is shifted left
    input  wire                enable,   // level: the drive is on
    input  wire                rebase,   // strobe: target := position, or the origin moves
    input  wire                tick,     // strobe: servo tick
    input  wire signed  [47:0] target,   // 2^-16 period
    input  wire signed  [15:0] trim,     // 2^(shift - 16) period
    output logic               go,       // strobe: draw a line to position
    output logic               restart,  // strobe: begin a line at position
    output logic signed [47:0] position  // 2^-16 step
);
    logic [3:0] wait_cycles;
    // the target was rebased since the position was taken; before it was taken
    logic rebased, pending;

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
        rebased     <= rebase || !enable || (rebased && !take);
        pending     <= (take && rebased) || (pending && !done);
        if (rst) begin
            wait_cycles <= '0;
            rebased     <= 1'b1;
            pending     <= 1'b1;
        end
    end

`ifdef FORMAL
    // the target was moved, or the drive was off, since the last restart
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
