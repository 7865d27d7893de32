// SPDX-License-Identifier: Apache-2.0
// i2c_port -- I2C master with a queue of commands and a queue of results; if it is not built, its
// pins release the bus.
//
// latency  see i2c_master
// rate     one command at a time, 128 in the queue
// behaviour  Each command gives one result, in their order. Pulses of less than 50 ns on the lines
//          are filtered.
// source   S4: the main controller has a panel and an EEPROM on I2C
// model    the models of its blocks; tested together by tb/peripheral/test_peripherals.py
`default_nettype none

module i2c_port #(
    parameter int CLK_HZ = 50_000_000,  // Hz, clk frequency
    parameter int BUILT  = 1            // 0: no logic, all outputs are idle
) (
    input  wire        clk,
    input  wire        rst,
    input  wire        scl_pin,         // level of the clock line
    input  wire        sda_pin,         // level of the data line
    output logic       scl_low,         // 1: pull the clock line low
    output logic       sda_low,         // 1: pull the data line low
    input  wire        push,            // strobe: queue a command
    input  wire  [2:0] command,         // as in i2c_master
    input  wire  [7:0] data,            // byte of a write
    input  wire        acknowledge,     // of a read: more bytes follow
    output logic [7:0] free,            // commands that can be queued, 128 at most
    output logic       busy,            // level: a command is in work or waits
    output logic       owned,           // level: the bus is ours, from start to stop
    output logic       scl,             // level of the clock line, filtered
    output logic       sda,             // level of the data line, filtered
    input  wire        result_pop,      // strobe: take the oldest result
    output logic       result_present,  // level: a result waits
    output logic [1:0] result,          // as in i2c_master
    output logic [7:0] result_data      // byte of a read
);
    if (BUILT == 0) begin : g_idle
        assign {scl_low, sda_low} = '0;
        assign {free, busy, owned, scl, sda, result_present, result, result_data} = '0;
        wire unused = &{
            1'b0, clk, rst, scl_pin, sda_pin, push, command, data, acknowledge, result_pop
        };
    end else begin : g_built
        localparam int SPIKE = CLK_HZ / 20_000_000;  // cycles: 50 ns

        wire scl_level, sda_level, scl_rejected, sda_rejected, overrun, answer_overrun;
        wire present, command_ready, done, next_acknowledge;
        wire [2:0] next_command;
        wire [1:0] done_result;
        wire [7:0] next_data, read_data, answer_free;

        synchroniser #(
            .W    (2),
            .RESET(3)
        ) u_lines (
            .clk,
            .rst,
            .d({scl_pin, sda_pin}),
            .q({scl_level, sda_level})
        );
        deglitcher #(
            .W(4)
        ) u_scl (
            .clk,
            .rst,
            .stable_cycles(4'(SPIKE)),
            .level        (scl_level),
            .filtered     (scl),
            .rejected     (scl_rejected)
        );
        deglitcher #(
            .W(4)
        ) u_sda (
            .clk,
            .rst,
            .stable_cycles(4'(SPIKE)),
            .level        (sda_level),
            .filtered     (sda),
            .rejected     (sda_rejected)
        );
        sync_fifo #(
            .W    (12),
            .DEPTH(128)
        ) u_commands (
            .clk,
            .rst,
            .push,
            .in ({acknowledge, command, data}),
            .pop(command_ready),
            .present,
            .out({next_acknowledge, next_command, next_data}),
            .free,
            .overrun
        );
        i2c_master #(
            .CLK_HZ(CLK_HZ)
        ) u_master (
            .clk,
            .rst,
            .scl,
            .sda,
            .command_valid(present),
            .command_ready,
            .command      (next_command),
            .write_data   (next_data),
            .acknowledge  (next_acknowledge),
            .done,
            .result       (done_result),
            .read_data,
            .owned,
            .scl_low,
            .sda_low
        );
        sync_fifo #(
            .W    (10),
            .DEPTH(128)
        ) u_results (
            .clk,
            .rst,
            .push   (done),
            .in     ({done_result, read_data}),
            .pop    (result_pop),
            .present(result_present),
            .out    ({result, result_data}),
            .free   (answer_free),
            .overrun(answer_overrun)
        );

        assign busy = push || !free[7] || !command_ready || done;

        wire unused = &{1'b0, scl_rejected, sda_rejected, overrun, answer_overrun, answer_free};
    end
endmodule

`default_nettype wire
