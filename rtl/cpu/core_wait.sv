// SPDX-License-Identifier: Apache-2.0
// core_wait -- lets the soft core wait at its next register access, for a time or until a word is
// received, whichever comes first.
//
// latency  1 cycle from start to waits; waits lasts `cycles` + 1 cycles, or ends 1 cycle after wake
// rate     a start while waits is high begins the time again
// behaviour  While wake is high, a start has no effect: the soft core cannot miss an event that
//          came just before it began to wait. `cycles` must stay as it is during the wait.
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
    logic [W-1:0] passed;  // cycles of the wait

    always_ff @(posedge clk) begin
        passed <= start ? '0 : passed + 1'b1;
        if (start) waits <= 1'b1;
        else if (passed == cycles) waits <= 1'b0;
        if (rst || wake) waits <= 1'b0;
    end

`ifdef FORMAL
    logic         past = 1'b0;
    logic [W-1:0] since;  // cycles since the last start
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && waits && !$past(start)) assume (cycles == $past(cycles));
        since <= start ? '0 : since + 1'b1;
        if (past) begin
            if ($past(wake) || $past(rst)) assert (!waits);
            if (waits) assert (passed == since);
            if (waits && !$past(start)) assert (passed <= cycles && passed != '0);
            cover (!waits && $past(waits) && !$past(wake) && cycles == 3);
            cover (!waits && $past(waits) && $past(wake));
        end
    end
`endif
endmodule

`default_nettype wire
