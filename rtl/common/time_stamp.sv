// SPDX-License-Identifier: Apache-2.0
// time_stamp -- count the clk since reset.
//
// latency  0 in the first clk after reset, then one more each clk
// rate     every clk
// source   the one time of a node: every latched event refers to it
// model    tb/common/time_stamp.py, equal in every bit of every cycle
`default_nettype none

module time_stamp #(
    parameter int W = 64  // bits of the count
) (
    input  wire          clk,
    input  wire          rst,  // the count starts again from 0
    output logic [W-1:0] now   // clk, wraps
);
    always_ff @(posedge clk) begin
        now <= now + 1'b1;
        if (rst) now <= '0;
    end
endmodule

`default_nettype wire
