// SPDX-License-Identifier: Apache-2.0
// heartbeat_watchdog -- report when no heartbeat has come for too long while a drive is on.
//
// latency   time_ms * (CLK_HZ / 1000) + 1 cycles from the last kick, or the rise of armed if later,
//           to expired; expired falls 1 cycle after a kick or after the fall of armed.
// behaviour It watches the master on the RS-485 bus, where each good frame is a kick, and the soft
//           core, whose firmware kicks once per round of its main loop.
// model     tb/interlock/heartbeat_watchdog.py, equal in every bit of every cycle
// proved    expired rises only while armed, and only without a kick in the cycle before. It stays
//           high until a kick comes or armed falls.
`default_nettype none

module heartbeat_watchdog #(
    parameter int CLK_HZ = 4_000_000  // Hz, frequency of clk; a multiple of 1000
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [15:0] time_ms,  // ms, longest silence; 0: no limit; a new value counts at once
    input  wire         kick,     // strobe: heartbeat
    input  wire         armed,    // level: a drive is enabled
    output logic        expired   // level: no kick for time_ms
);
    if (CLK_HZ < 1000 || CLK_HZ % 1000 != 0) begin : g_check
        CLK_HZ_MUST_BE_A_MULTIPLE_OF_1000 u_error ();
    end

    localparam int CLK_MS = CLK_HZ / 1000;
    localparam int P = CLK_MS > 1 ? $clog2(CLK_MS) : 1;

    logic [P-1:0] part;  // cycles of the running millisecond
    logic [ 15:0] silent;  // ms without a kick, stops at its largest value

    wire          whole = part == P'(CLK_MS - 1);
    wire          over = silent >= time_ms && time_ms != '0;
    wire          full = silent == '1;

    always_ff @(posedge clk) begin
        if (kick || !armed || rst) begin
            part    <= '0;
            silent  <= '0;
            expired <= 1'b0;
        end else begin
            if (!over && !full) part <= whole ? '0 : part + 1'b1;
            if (!over && !full && whole) silent <= silent + 1'b1;
            if (over) expired <= 1'b1;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            if (expired) assert ($past(armed) && !$past(kick));
            if ($past(expired) && $past(armed) && !$past(kick) && !$past(rst)) assert (expired);
            if (expired && !$past(expired))
                assert ($past(time_ms) != 0 && $past(silent) >= $past(time_ms));
            cover (part == 3 && $past(kick, 4));
        end
    end
`endif
endmodule

`default_nettype wire
