// SPDX-License-Identifier: Apache-2.0
// tick_divider -- make a strobe every `period` cycles.
//
// latency  `period` cycles from reset or restart to the first tick
// rate     exactly one tick per `period` cycles
// behaviour A shorter period takes effect at once: a tick follows in the next cycle if it is
//          already due.
// model    tb/common/tick_divider.py, equal in every bit of every cycle
// proved   two ticks, or a restart and a tick, are never closer together than the shortest period
//          that was set between them; there is no tick while period is 0
`default_nettype none

module tick_divider #(
    parameter int W = 24  // bits of period
) (
    input  wire          clk,
    input  wire          rst,      // level: a new period begins
    input  wire  [W-1:0] period,   // cycles between two ticks; 0: no ticks
    input  wire          restart,  // strobe: a new period begins; suppresses a tick that is due now
    output logic         tick      // strobe: a period has ended
);
    localparam bit [W-1:0] ONE = 1;

    logic [W-1:0] elapsed;  // cycles since the last tick, with this one

    wire          on = |period;
    wire          due = elapsed >= period;

    always_ff @(posedge clk) begin
        tick    <= on && due && !restart;
        elapsed <= due || restart ? ONE : elapsed + 1'b1;
        if (rst) begin
            tick    <= 1'b0;
            elapsed <= ONE;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    // cycles since the last tick; shortest period set in that time
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
            assert (elapsed != '0);
            if (!tick) assert (elapsed - 1'b1 <= since);
            if (tick) assert (since >= shortest || shortest == 0);
            cover (tick && $past(tick));
            cover (tick && shortest == 5);
            cover (tick && $past(restart, 3));
        end
    end
`endif
endmodule

`default_nettype wire
