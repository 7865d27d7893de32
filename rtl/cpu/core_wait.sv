// SPDX-License-Identifier: Apache-2.0
// core_wait -- lets the soft core wait at its next register access, for a time or until a word is
// received, whichever comes first.
//
// latency  1 cycle from start to waits; waits lasts `cycles` cycles, or ends 1 cycle after wake
// rate     a start while waits is high begins the time again
// behaviour  While wake is high, a start has no effect, and neither has one with `cycles` = 0: the
//          soft core cannot miss an event that came just before it began to wait.
// model    tb/cpu/core_wait.py, equal in every bit of every cycle
// proved   waits is low in the cycle after wake or rst, and never high for longer than the time of
//          the last start.
// proof    depth 12, W = 3
`default_nettype none

module core_wait #(
    parameter int W = 24  // bits of cycles
) (
    input  wire          clk,
    input  wire          rst,
    input  wire          start,   // strobe: the soft core has nothing to do
    input  wire  [W-1:0] cycles,  // cycles that it waits
    input  wire          wake,    // level: there is something for it to do
    output logic         waits    // level: the soft core gets no access to the registers
);
    logic [W-1:0] left;  // cycles of the wait that are left

    always_ff @(posedge clk) begin
        left <= left - 1'b1;
        if (left == W'(1)) waits <= 1'b0;
        if (start) begin
            left  <= cycles;
            waits <= |cycles;
        end
        if (rst || wake) waits <= 1'b0;
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic [W-1:0] since, longest;  // cycles since the last start; and their largest number
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (start) begin
            since   <= '0;
            longest <= cycles;
        end else if (!(&since)) since <= since + 1'b1;
        if (past) begin
            if ($past(wake) || $past(rst)) assert (!waits);
            if (waits) assert (since < longest && left == longest - since);
            cover (!waits && $past(waits) && !$past(wake) && longest == 3);
            cover (!waits && $past(waits) && $past(wake));
        end
    end
`endif
endmodule

`default_nettype wire
