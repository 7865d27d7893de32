// SPDX-License-Identifier: Apache-2.0
// step_line -- hold the motor steps of a servo tick until the next one, and report then to the step
// generator whether to draw a line to them or to restart there.
//
// latency   0 cycles from tick to go or restart: the line begins one tick after the tick whose
//           target it leads to
// rate      one target per tick
// behaviour All axes of a node draw their lines at the same time, and each line has the length of a
//           tick. The generator restarts, without making a step, at the first target after the
//           drive came on, and at a target that is given with restart_in. target_up and target_down
//           belong to the line that is being drawn.
// model     tb/drive/step_line.py, equal in every bit of every cycle
// proved    go and restart never come together, and neither before a target was given. After the
//           drive was off, no go comes before the target of a later tick.
// proof     depth 6
`default_nettype none

module step_line (
    input  wire                clk,
    input  wire                rst,
    input  wire                enable,      // level: the drive is on
    input  wire                tick,        // strobe: servo tick
    // the target of this tick
    input  wire                valid,       // strobe: it is new
    input  wire                restart_in,  // level: restart there
    input  wire signed  [47:0] target_in,   // 2^-16 step
    input  wire                up_in,       // level: the target of the axis moves up
    input  wire                down_in,     // level: the target of the axis moves down
    // the line
    output logic               go,          // strobe: draw a line to target
    output logic               restart,     // strobe: begin a line at target
    output logic signed [47:0] target,      // 2^-16 step
    output logic               target_up,   // level: the line leads up
    output logic               target_down  // level: the line leads down
);
    // there is a target; it is not the end of a line; the drive was off since the tick
    logic given, fresh, lost;

    assign go      = tick && given && enable && !fresh;
    assign restart = tick && given && (!enable || fresh);

    always_ff @(posedge clk) begin
        given <= given || valid;
        lost  <= !enable || (lost && !tick);
        fresh <= !enable || (valid ? restart_in || lost : fresh);
        if (valid) target <= target_in;
        if (tick) {target_down, target_up} <= {down_in, up_in};
        if (rst) begin
            {given, target, target_up, target_down} <= '0;
            {fresh, lost} <= '1;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [1:0] off = 2'b11;  // the drive was off: since the tick, and then until a target came
    always @(posedge clk) begin
        past <= 1'b1;
        off  <= rst || !enable ? 2'b11 : {off[1] && (off[0] || !valid), off[0] && !tick};
        if (!past) assume (rst);
        if (past) begin
            assert (off[0] == lost && (!off[1] || fresh));
            assert (!(go && restart));
            assert (!(go && (off[1] || !given)));
            if (!$past(rst) && !$past(valid)) assert (target == $past(target));
            cover (go && $past(restart, 2));
        end
    end
`endif
endmodule

`default_nettype wire
