// SPDX-License-Identifier: Apache-2.0
// ps2_pass -- pass everything between a PS/2 keyboard and its host unchanged in both directions,
// and inject sequences.
//
// latency  less than 200 us from the eleventh edge of a byte to the eleventh edge of its copy,
//          beyond the ten bits of the copy
// rate     one byte each way at a time; the clock holds the keyboard until its last byte has been
//          passed on
// limits   A damaged byte is passed on damaged (wrong parity), so its receiver asks for it again. A
//          command that the keyboard does not take has no answer, as without a keyboard.
// source   S4: the main controller is a keyboard of the EDM machine; 14 1D F0 1D F0 14 starts the
//          cut
// model    tb/peripheral/ps2_pass.py, equal in every bit of every cycle
`default_nettype none

module ps2_pass #(
    parameter int CLK_HZ = 50_000_000,  // Hz, clk frequency
    parameter int STAGES = 2            // stages of the synchronisers
) (
    input wire clk,
    input wire rst,
    input wire [15:0] idle_ms,  // ms, silence of keyboard and host before an injection
    // keyboard
    input wire keyboard_clock,  // level of the clock line, asynchronous
    input wire keyboard_data,  // level of the data line, asynchronous
    output logic keyboard_clock_low,  // 1: pull the clock line low
    output logic keyboard_data_low,  // 1: pull the data line low
    // host
    input wire host_clock,  // level of the clock line, asynchronous
    input wire host_data,  // level of the data line, asynchronous
    output logic host_clock_low,  // 1: pull the clock line low
    output logic host_data_low,  // 1: pull the data line low
    // injection
    input wire inject_valid,  // level: a byte waits
    output logic inject_ready,  // with inject_valid: sent in this cycle
    input wire [7:0] inject,  // scan code
    input wire inject_last,  // level: it is the last of its sequence
    output logic injecting,  // level: a sequence is being injected, the keyboard is held
    // events
    output logic typed,  // strobe: the keyboard sent a byte that answers no command
    output logic keyboard_damaged,  // strobe: a byte of the keyboard was damaged
    output logic command_damaged,  // strobe: a command of the host was damaged
    output logic command_unsent,  // strobe: the keyboard did not take a command
    output logic aborted,  // strobe: the host cut a frame short
    output logic glitch,  // strobe: a pulse of less than 1 us on a line
    output logic busy  // level: a frame is on its way on either side
);
    localparam int FILTER = CLK_HZ / 1_000_000;  // cycles: 1 us

    logic [3:0] level, line, rejected;
    logic
        received_valid,
        received_ready,
        received_damaged,
        hold,
        held,
        keyboard_busy,
        command_valid,
        command_ready,
        damaged,
        sent;
    logic
        send_valid, send_ready, send_damaged, host_valid, host_ready, host_byte_damaged, host_busy;
    logic [7:0] received, command, send, host_byte;

    synchroniser #(
        .W     (4),
        .STAGES(STAGES),
        .RESET (15)
    ) u_synchroniser (
        .clk,
        .rst,
        .d({keyboard_clock, keyboard_data, host_clock, host_data}),
        .q(level)
    );

    for (genvar n = 0; n < 4; n++) begin : g_line
        deglitcher #(
            .W(8)
        ) u_deglitcher (
            .clk,
            .rst,
            .stable_cycles(8'(FILTER)),
            .level        (level[n]),
            .filtered     (line[n]),
            .rejected     (rejected[n])
        );
    end

    ps2_host #(
        .CLK_HZ(CLK_HZ)
    ) u_host (
        .clk,
        .rst,
        .hold,
        .clock          (line[3]),
        .data           (line[2]),
        .command_valid,
        .command_ready,
        .command,
        .command_damaged(damaged),
        .received_valid,
        .received_ready,
        .received,
        .received_damaged,
        .sent,
        .unsent         (command_unsent),
        .held,
        .busy           (keyboard_busy),
        .clock_low      (keyboard_clock_low),
        .data_low       (keyboard_data_low)
    );

    ps2_arbiter #(
        .CLK_HZ(CLK_HZ)
    ) u_arbiter (
        .clk,
        .rst,
        .idle_ms,
        .inject_valid,
        .inject_ready,
        .inject,
        .inject_last,
        .injecting,
        .typed,
        .keyboard_valid  (received_valid),
        .keyboard_ready  (received_ready),
        .keyboard        (received),
        .keyboard_damaged(received_damaged),
        .keyboard_busy,
        .keyboard_held   (held),
        .keyboard_hold   (hold),
        .command_valid,
        .command_ready,
        .command,
        .command_damaged (damaged),
        .command_sent    (sent),
        .command_unsent,
        .send_valid,
        .send_ready,
        .send,
        .send_damaged,
        .host_valid,
        .host_ready,
        .host            (host_byte),
        .host_damaged    (host_byte_damaged)
    );

    ps2_device #(
        .CLK_HZ(CLK_HZ)
    ) u_device (
        .clk,
        .rst,
        .clock           (line[1]),
        .data            (line[0]),
        .send_valid,
        .send_ready,
        .send,
        .send_damaged,
        .received_valid  (host_valid),
        .received_ready  (host_ready),
        .received        (host_byte),
        .received_damaged(host_byte_damaged),
        .aborted,
        .busy            (host_busy),
        .clock_low       (host_clock_low),
        .data_low        (host_data_low)
    );

    assign glitch           = |rejected;
    assign busy             = keyboard_busy || host_busy;
    assign keyboard_damaged = received_valid && received_ready && received_damaged;
    assign command_damaged  = host_valid && host_ready && host_byte_damaged;
endmodule

`default_nettype wire
