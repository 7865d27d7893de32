// SPDX-License-Identifier: Apache-2.0
// tick_divider -- a strobe every `period` clk.
//
// latency  the first tick comes `period` clk after reset or restart
// rate     one tick each `period`
//          clk, exactly
// model    tb/common/tick_divider.py, equal in every bit of every cycle
// proved   two ticks are never nearer than the shortest period in force between them, nor to a
//          restart; no tick while period is 0
`default_nettype none

module tick_divider #(
    parameter int W = 24  // bits of period
) (
    input wire clk,
    input wire rst,
    input wire [W-1:0] period,  // clk; 0: no ticks. A shorter one counts at once
    input wire restart,  // strobe: a period begins here; a tick that is due now is left out
    output logic tick  // strobe
);
    logic [W-1:0] elapsed;  // clk since the last tick

    wire          on = |period;
    wire          due = elapsed >= period - 1'b1;

    always_ff @(posedge clk) begin
        tick    <= on && due && !restart;
        elapsed <= on && !due && !restart ? elapsed + 1'b1 : '0;
        if (rst) begin
            tick    <= 1'b0;
            elapsed <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    // clk since the last tick, least period seen in that time
    logic [W-1:0] since, shortest;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst || tick || restart) begin
            since    <= W'(!restart);
            shortest <= period;
        end else begin
            if (!(&since)) since <= since + 1'b1;
            if (period < shortest) shortest <= period;
        end
        if (rst) since <= '0;
        if (past && !$past(rst)) begin
            assert (!(tick && $past(period) == 0));
            if (!tick) assert (elapsed <= since);
            if (tick) assert (since >= shortest || shortest == 0);
            cover (tick && $past(tick));
            cover (tick && shortest == 5);
            cover (tick && $past(restart, 3));
        end
    end
`endif
endmodule

`default_nettype wire
