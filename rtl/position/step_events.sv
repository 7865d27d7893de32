// SPDX-License-Identifier: Apache-2.0
// step_events -- report each step of a scale, one cycle before the position makes it.
//
// latency  DELAY cycles from valid to stepped
// rate     one step per cycle
// model    tb/position/step_events.py, equal in every bit of every cycle
`default_nettype none

module step_events #(
    parameter int DELAY = 0  // cycles by which the position is later than the step: 0 or 1
) (
    input  wire               clk,
    input  wire               rst,
    input  wire               valid,    // strobe: step is new
    input  wire signed [16:0] step,     // 2^-16 period
    output logic              stepped,  // strobe: the position moves in the next cycle
    output logic              downward  // level: with stepped, it goes down
);
    wire moves = valid && step != '0;

    if (DELAY == 0) begin : g_now
        assign {stepped, downward} = {moves, step[16]};
        wire unused = &{1'b0, clk, rst};
    end else begin : g_later
        always_ff @(posedge clk) begin
            stepped  <= moves && !rst;
            downward <= step[16];
        end
    end
endmodule

`default_nettype wire
