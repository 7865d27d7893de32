// SPDX-License-Identifier: Apache-2.0
// step_permission -- decide whether the step generator may follow its target: only with the drive
// on, and never towards a side that the drive-enable interlock blocks.
//
// latency   0 cycles: combinational
// behaviour A target that moves up is not followed while block_up is high, one that moves down is
//           not followed while block_down is high. A target at standstill may be followed, so that
//           an axis on a pressed limit switch holds its position and can move away from the switch.
// model     tb/drive/step_permission.py, equal for all inputs
// proved    The target is never followed while the drive is off or is of another kind, nor towards
//           a blocked side; otherwise it is always followed.
`default_nettype none

module step_permission (
    input  wire  enable,       // level: the interlock enables the drive
    input  wire  by_steps,     // level: the drive is a stepper driver
    input  wire  block_up,     // level: the interlock blocks upward motion
    input  wire  block_down,   // level: the interlock blocks downward motion
    input  wire  target_up,    // level: the target moves up
    input  wire  target_down,  // level: the target moves down
    output logic allowed       // level: the target may be followed
);
    wire blocked = (target_down && block_down) || (target_up && block_up);

    assign allowed = enable && by_steps && !blocked;

`ifdef FORMAL
    wire driven = enable && by_steps;
    always_comb begin
        assert (!allowed || (enable && by_steps));
        assert (!(allowed && block_up && target_up));
        assert (!(allowed && block_down && target_down));
        if (driven && !target_up && !target_down) assert (allowed);
        if (driven && !block_up && !block_down) assert (allowed);
        cover (allowed && block_up && target_down);
        cover (!allowed && driven && target_up);
    end
`endif
endmodule

`default_nettype wire
