// SPDX-License-Identifier: Apache-2.0
// axis_requests -- combine the requests of the registers with those of the node.
//
// latency  0 cycles, combinational
// rate     one request of each kind per cycle
// model    tb/control/axis_requests.py, equal for all inputs
// proved   The following error is checked whenever a loop is closed, whatever else is requested.
`default_nettype none

module axis_requests (
    input  wire  closed_loop,      // level: the servo commands the drive
    input  wire  fine,             // level: the fine stage holds the position
    input  wire  start,            // strobe: the registers start the queued segments
    input  wire  common_start,     // strobe: the node starts the queued segments
    output logic check_following,  // level: the following error is checked
    output logic play              // strobe: play the queued segments
);
    assign check_following = closed_loop || fine;
    assign play            = start || common_start;

`ifdef FORMAL
    always_comb begin
        if (closed_loop) assert (check_following);
        if (fine) assert (check_following);
        if (!closed_loop && !fine) assert (!check_following);
        cover (check_following && !closed_loop);
    end
`endif
endmodule

`default_nettype wire
