// SPDX-License-Identifier: Apache-2.0
// approach_law -- bring a value to zero with limited slope and limited change of slope: what the slope does at this step.
//
// latency  combinational
// rate     one decision per step
// law      the slope is a whole number of `change`; `area` is what it still adds while it falls to zero from here:
//          change + 2 change + ... + slope. It grows while the value left is enough for the larger area, falls when it
//          is less than the area, else it stays. What is left at the end is less than one `change`, and is the last step.
//          So it reaches the largest whole number of changes inside the limit
// source   the time-optimal control of two integrators, made discrete so that it ends at zero without chatter
// model    tb/control/approach_law.py
`default_nettype none

module approach_law #(
    parameter int W = 64
) (
    input  wire        [W-1:0]   change,                        // largest change of the slope per step
    input  wire        [W-1:0]   limit,                         // of the slope, at least `change`
    input  wire signed [W-1:0]   value,
    input  wire        [W-1:0]   slope,                         // size
    input  wire                  upward,                        // the slope raises the value; of no meaning at slope zero
    input  wire        [W-1:0]   area,
    output logic                 turn,                          // the slope, being zero, takes the direction `upward_now`
    output logic                 upward_now,
    output logic                 last,                          // the value becomes zero with this step
    output logic                 grow,                          // slope += change
    output logic                 fall                           // slope -= change
);
    if (W < 4) begin : g_check W_MUST_BE_AT_LEAST_4 u_error (); end

    assign turn       = slope == '0;
    assign upward_now = turn ? value[W-1] : upward;

    // what is left for the slope to take away; negative when it drives the value away from zero
    wire signed [W:0]   left  = upward_now ? -$signed({value[W-1], value}) : $signed({value[W-1], value});
    wire        [W+1:0] more  = {2'b0, area} + {2'b0, slope} + {2'b0, change};
    wire                short_of_area = left < $signed({1'b0, area});
    wire                enough        = !left[W] && {2'b0, left[W-1:0]} >= more;

    assign last = turn && {1'b0, change} > $unsigned(left);
    assign fall = !turn && (short_of_area || slope > limit);
    assign grow = !last && !fall && enough && {1'b0, slope} + {1'b0, change} <= {1'b0, limit};

`ifdef FORMAL
    always_comb begin
        assert (!(grow && fall));
        assert (!(last && (grow || fall)));
        assert (!(fall && slope == '0));
        if (grow) assert ({1'b0, slope} + {1'b0, change} <= {1'b0, limit});
        cover (grow);
        cover (fall);
        cover (last && value != '0);
    end
`endif
endmodule

`default_nettype wire
