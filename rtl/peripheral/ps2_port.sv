// SPDX-License-Identifier: Apache-2.0
// ps2_port -- PS/2 pass-through between a keyboard and its host, with a queue of scan codes to
// inject; if it is not built, its pins release the lines.
//
// latency  see ps2_pass
// rate     one scan code at a time, 32 in the queue
// source   S4: the main controller is a keyboard of the EDM machine
// model    the models of its blocks; tested together by tb/peripheral/test_peripherals.py
`default_nettype none

module ps2_port #(
    parameter int CLK_HZ = 50_000_000,  // Hz, clk frequency
    parameter int BUILT  = 1            // 0: no logic, all outputs are idle
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         keyboard_clock,      // level of the keyboard's clock line
    input  wire         keyboard_data,       // level of the keyboard's data line
    output logic        keyboard_clock_low,  // 1: pull the keyboard's clock line low
    output logic        keyboard_data_low,   // 1: pull the keyboard's data line low
    input  wire         host_clock,          // level of the host's clock line
    input  wire         host_data,           // level of the host's data line
    output logic        host_clock_low,      // 1: pull the host's clock line low
    output logic        host_data_low,       // 1: pull the host's data line low
    input  wire  [15:0] idle_ms,             // ms, silence before an injection
    input  wire         push,                // strobe: queue a scan code
    input  wire  [ 7:0] inject,              // scan code
    input  wire         inject_last,         // level: it is the last of its sequence
    input  wire         drop,                // strobe: remove what is queued
    output logic [ 5:0] free,                // scan codes that can be queued, 32 at most
    output logic        injecting,           // level: a sequence is being injected
    output logic        busy,                // level: a frame is on its way on either side
    output logic        typed,               // strobe: a byte that answers no command
    output logic        keyboard_damaged,    // strobe: a byte of the keyboard was damaged
    output logic        command_damaged,     // strobe: a command of the host was damaged
    output logic        command_unsent,      // strobe: the keyboard did not take a command
    output logic        aborted,             // strobe: the host cut a frame short
    output logic        glitch               // strobe: a pulse of less than 1 us on a line
);
    if (BUILT == 0) begin : g_idle
        assign {keyboard_clock_low, keyboard_data_low, host_clock_low, host_data_low} = '0;
        assign {free, injecting, busy, typed, glitch} = '0;
        assign {keyboard_damaged, command_damaged, command_unsent, aborted} = '0;
        wire unused_pins = &{1'b0, keyboard_clock, keyboard_data, host_clock, host_data};
        wire unused = &{1'b0, clk, rst, idle_ms, push, inject, inject_last, drop};
    end else begin : g_built
        wire valid, ready, last;
        wire [7:0] code;

        ps2_inject_queue #(
            .DEPTH(32)
        ) u_queue (
            .clk,
            .rst,
            .push,
            .in     (inject),
            .in_last(inject_last),
            .drop,
            .valid,
            .ready,
            .out    (code),
            .last,
            .injecting,
            .free
        );
        ps2_pass #(
            .CLK_HZ(CLK_HZ)
        ) u_pass (
            .clk,
            .rst,
            .idle_ms,
            .keyboard_clock,
            .keyboard_data,
            .keyboard_clock_low,
            .keyboard_data_low,
            .host_clock,
            .host_data,
            .host_clock_low,
            .host_data_low,
            .inject_valid(valid),
            .inject_ready(ready),
            .inject      (code),
            .inject_last (last),
            .injecting,
            .typed,
            .keyboard_damaged,
            .command_damaged,
            .command_unsent,
            .aborted,
            .glitch,
            .busy
        );
    end
endmodule

`default_nettype wire
