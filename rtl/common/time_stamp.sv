// SPDX-License-Identifier: Apache-2.0
// time_stamp -- count the cycles since reset.
//
// latency  0 cycles: the count is 0 in the first cycle after reset, and 1 more in each further
//          cycle
// rate     one count per cycle
// source   This is the only clock of a node: every latched event carries its value.
// model    tb/common/time_stamp.py, equal in every bit of every cycle
`default_nettype none

module time_stamp #(
    parameter int W = 64  // bits of the count
) (
    input  wire          clk,
    input  wire          rst,  // level: the count is 0
    output logic [W-1:0] now   // cycles since reset, wraps
);
    always_ff @(posedge clk) begin
        now <= now + 1'b1;
        if (rst) now <= '0;
    end
endmodule

`default_nettype wire
