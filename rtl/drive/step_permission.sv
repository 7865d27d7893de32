// SPDX-License-Identifier: Apache-2.0
// step_permission -- may the step generator follow its target? Not without the drive, and not into
// a side that the guard blocks.
//
// latency  none: wires and gates
//          rule     a target that goes up is not followed while block_up stands, one that goes down not
//          while block_down does; one that stands still may be followed, so that an axis on a
//          pressed limit switch holds its place and can go away from it
// model    tb/drive/step_permission.py, equal for all inputs
// proved   never followed without the drive or for another kind of drive, nor towards a blocked
//          side; and always otherwise
`default_nettype none

module step_permission (
    input  wire               enable,           // level: the guard allows the drive
    input  wire               by_steps,         // level: the drive is a stepper driver
    input  wire               block_up,         // level: the guard lets nothing go up
    input  wire               block_down,       // level: the guard lets nothing go down
    input  wire signed [31:0] target_velocity,  // 2^-16 period/tick
    output logic              driven,           // level: the drive is on, and it is this one
    output logic              allowed           // level: the target may be followed
);
    wire goes_down = target_velocity < 0;
    wire goes_up = target_velocity > 0;
    wire blocked = goes_down ? block_down : goes_up && block_up;

    assign driven  = enable && by_steps;
    assign allowed = driven && !blocked;

`ifdef FORMAL
    always_comb begin
        assert (!allowed || (enable && by_steps));
        assert (!(allowed && block_up && !target_velocity[31] && target_velocity != 0));
        assert (!(allowed && block_down && target_velocity[31]));
        assert (allowed || !enable || !by_steps || (target_velocity != 0 && (target_velocity[31] ? block_down : block_up)));
        assert (driven == (enable && by_steps));
        cover (allowed && block_up && target_velocity == -1);
        cover (!allowed && driven && target_velocity == 1);
    end
`endif
endmodule

`default_nettype wire
