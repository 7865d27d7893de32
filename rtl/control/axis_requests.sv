// SPDX-License-Identifier: Apache-2.0
// axis_requests -- joins the requests of the registers with those of the node and of the feedback
// channel.
//
// latency  0 cycles, combinational
// rate     one request of each kind per cycle
// model    tb/control/axis_requests.py, equal for all inputs
// proved   The following error is checked whenever a loop is closed, whatever else is requested.
`default_nettype none

module axis_requests (
    input  wire  closed_loop,             // level: the servo commands the drive
    input  wire  fine,                    // level: the fine stage holds the position
    input  wire  start,                   // strobe: the registers start the queued segments
    input  wire  common_start,            // strobe: the node starts the queued segments
    input  wire  set_target_to_position,  // strobe: target := position
    input  wire  moved,                   // strobe: the origin moves
    input  wire  kp_written,              // strobe: kp is new
    input  wire  kd_written,              // strobe: kd is new
    input  wire  kv_written,              // strobe: kv is new
    input  wire  ka_written,              // strobe: ka is new
    output logic check_following,         // level: the following error is checked
    output logic play,                    // strobe: play the queued segments
    output logic rebase,                  // strobe: the target jumps, the drive must not follow
    output logic gains_changed            // strobe: a gain of the servo is new
);
    assign check_following = closed_loop || fine;
    assign play            = start || common_start;
    assign rebase          = set_target_to_position || moved;
    assign gains_changed   = kp_written || kd_written || kv_written || ka_written;

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
