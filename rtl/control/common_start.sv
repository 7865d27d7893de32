// SPDX-License-Identifier: Apache-2.0
// common_start -- start several axes in the same cycle, by a register of the node or by the sync
// pulse of the bus.
//
// latency  0 cycles, combinational
// rate     one start per cycle
// behaviour  A sync pulse that starts an axis also restarts the servo tick, so that the ticks of
//          all nodes coincide from then on.
// model    tb/control/common_start.py, equal for all inputs
// proved   An axis starts only by a request that names it, and every such request starts it.
// proof    depth 2, AXES = 3
`default_nettype none

module common_start #(
    parameter int AXES = 1  // axes of the node, 1 to 8
) (
    input  wire             request,       // strobe: start the axes of request_axes
    input  wire  [     7:0] request_axes,  // bit n: axis n
    input  wire             sync,          // strobe: the sync pulse of the bus
    input  wire  [     7:0] sync_axes,     // bit n: axis n starts with sync
    output logic [AXES-1:0] start,         // strobes: axis n plays its queued segments
    output logic            restart_tick   // strobe: the servo tick begins again
);
    wire [7:0] starting = (request ? request_axes : '0) | (sync ? sync_axes : '0);

    assign start        = starting[AXES-1:0];
    assign restart_tick = sync && |sync_axes;

    wire unused = &{1'b0, starting};

`ifdef FORMAL
    always_comb begin
        for (int n = 0; n < AXES; n++)
        assert (start[n] == ((request && request_axes[n]) || (sync && sync_axes[n])));
        assert (!restart_tick || sync);
        cover (start == '1 && !restart_tick);
        cover (restart_tick);
    end
`endif
endmodule

`default_nettype wire
