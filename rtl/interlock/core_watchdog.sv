// SPDX-License-Identifier: Apache-2.0
// core_watchdog -- report that the soft core has stopped or hangs, while a drive of the node is on.
//
// latency  0 cycles from trap to stopped; SILENCE_MS * (CLK_HZ / 1000) + 1 cycles from the last
//          kick
// rate     one kick per cycle
// behaviour  The default of SILENCE_MS gives the firmware 20 ms and 1 200 000 cycles for each
//          round, so a slow clock is not mistaken for a fault.
// model    tb/interlock/core_watchdog.py, equal in every bit of every cycle
// proved   Whenever the core traps, stopped is high. Without a trap it is high only while a drive
//          is on. armed is high exactly while a drive is on.
// proof    depth 12, CLK_HZ = 1000, AXES = 2, SILENCE_MS = 3
`default_nettype none

module core_watchdog #(
    parameter int CLK_HZ     = 4_000_000,                   // Hz, clk frequency, a multiple of 1000
    parameter int AXES       = 1,                           // axes of the node, 1 to 8
    parameter int SILENCE_MS = 20 + 1_200_000_000 / CLK_HZ  // ms, longest time between two kicks
) (
    input  wire             clk,
    input  wire             rst,
    input  wire             trap,          // level: the soft core has stopped
    input  wire             kick,          // strobe: heartbeat of the firmware
    input  wire  [AXES-1:0] drive_enable,  // levels: the drive of axis n is on
    output logic            armed,         // level: a drive is on
    output logic            stopped        // level: the soft core has stopped or hangs
);
    if (SILENCE_MS < 1 || SILENCE_MS > 65535) begin : g_check
        SILENCE_MS_MUST_BE_FROM_1_TO_65535 u_error ();
    end

    wire silent;

    heartbeat_watchdog #(
        .CLK_HZ(CLK_HZ)
    ) u_heartbeat (
        .clk,
        .rst,
        .time_ms(16'(SILENCE_MS)),
        .kick,
        .armed,
        .expired(silent)
    );

    assign armed   = |drive_enable;
    assign stopped = trap || silent;

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (trap) assert (stopped);
        assert (armed == (drive_enable != '0));
        if (past && stopped && !trap) assert ($past(armed) && !$past(kick));
        cover (past && stopped && !trap);
    end
`endif
endmodule

`default_nettype wire
