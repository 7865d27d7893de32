// SPDX-License-Identifier: Apache-2.0
// rs485_port -- a node's end of the multi-drop line: receiver, address filter, frame check, queues,
// transmitter, behind a register block.
//
// latency  see the room link
// rate     see there
// source   S0: one master, many slaves on one pair of wires, the 9th bit syncs command bytes
// model    the models of its blocks; proved in motion by tb/serial/test_rs485_port.py
`default_nettype none

module rs485_port #(
    parameter int CLK_HZ = 4_000_000
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [ 3:0] address,             // on the line
    input  wire         select,              // register bus
    input  wire         write,
    input  wire  [ 5:0] word,                // 32-bit word of the block
    input  wire  [31:0] wdata,
    output logic [31:0] rdata,
    input  wire         armed,               // level: a drive is enabled
    output logic        watchdog_expired,
    output logic        sync,                // strobe: the same moment for all nodes of the line
    output logic [ 7:0] sync_axes,           // that start then
    input  wire         rs485_rx,            // pins: idles high
    output logic        rs485_tx,
    output logic        rs485_driver_enable
);
    wire rx, received, ninth, framing_error, start_glitch, receiving, filtered, filtered_command;
    wire checked, command, good, frame_good, frame_bad, present, overrun, receive_read;
    wire [7:0] received_data, filtered_data, data, receive_free;
    wire [9:0] receive;
    wire               line_break, to_send, send_ready, send_command, sending, driver_requested, tx, transmit_expired, transmit_command, transmit_written,
                       transmit_overrun;
    wire [7:0] send_data, transmit_data, transmit_free, crc_byte;
    wire crc_byte_written, crc_start;
    wire [19:0] bit_time;
    wire [15:0] watchdog_time;
    wire [31:0] crc;

    // in; what the node says itself it does not hear
    synchroniser #(
        .RESET(1)
    ) u_pin (
        .clk,
        .rst,
        .d(rs485_rx | rs485_driver_enable),
        .q(rx)
    );
    uart_rx u_receiver (
        .clk,
        .rst,
        .bit_time,
        .rx,
        .valid(received),
        .data (received_data),
        .ninth,
        .framing_error,
        .start_glitch,
        .busy (receiving)
    );
    break_detector #(
        .CLK_HZ(CLK_HZ)
    ) u_break (
        .clk,
        .rst,
        .rx,
        .found(line_break)
    );
    address_filter u_filter (
        .clk,
        .rst,
        .address,
        .valid_in(received),
        .data_in (received_data),
        .ninth,
        .valid   (filtered),
        .data    (filtered_data),
        .command (filtered_command)
    );
    frame_check u_check (
        .clk,
        .rst,
        .valid_in  (filtered),
        .data_in   (filtered_data),
        .command_in(filtered_command),
        .framing_error,
        .valid     (checked),
        .data,
        .command,
        .good,
        .frame_good,
        .frame_bad,
        .sync
    );
    sync_fifo #(
        .W    (10),
        .DEPTH(128)
    ) u_received (
        .clk,
        .rst,
        .push(checked),
        .in  ({good, command, data}),
        .pop (receive_read),
        .present,
        .out (receive),
        .free(receive_free),
        .overrun
    );
    heartbeat_watchdog #(
        .CLK_HZ(CLK_HZ)
    ) u_watchdog (
        .clk,
        .rst,
        .time_ms(watchdog_time),
        .kick   (frame_good),
        .armed,
        .expired(watchdog_expired)
    );

    // out
    sync_fifo #(
        .W    (9),
        .DEPTH(128)
    ) u_to_send (
        .clk,
        .rst,
        .push   (transmit_written),
        .in     ({transmit_command, transmit_data}),
        .pop    (send_ready),
        .present(to_send),
        .out    ({send_command, send_data}),
        .free   (transmit_free),
        .overrun(transmit_overrun)
    );
    uart_tx u_transmitter (
        .clk,
        .rst,
        .bit_time,
        .valid        (to_send),
        .ready        (send_ready),
        .data         (send_data),
        .ninth        (send_command),
        .tx,
        .driver_enable(driver_requested),
        .busy         (sending)
    );
    transmit_timeout u_transmit_timeout (
        .clk,
        .rst,
        .bit_time,
        .requested    (driver_requested),
        .driver_enable(rs485_driver_enable),
        .expired      (transmit_expired)
    );
    assign rs485_tx = tx || !rs485_driver_enable;

    crc32_stream u_crc (
        .clk,
        .rst,
        .start(crc_start),
        .valid(crc_byte_written),
        .data (crc_byte),
        .crc
    );

    bus_registers u_registers (
        .clk,
        .rst,
        .select,
        .write,
        .word,
        .wdata,
        .rdata,
        .bit_time,
        .receive_data       (receive[7:0]),
        .receive_command    (receive[8]),
        .receive_good       (receive[9]),
        .receive_present    (present),
        .receive_read,
        .transmit_data,
        .transmit_written,
        .transmit_command,
        .state_transmit_free(transmit_free),
        .state_sending      (sending),
        .frames_good        (frame_good),
        .frames_bad         (frame_bad),
        .framing_errors     (framing_error),
        .start_glitches     (start_glitch),
        .overruns           (overrun),
        .crc_byte_data      (crc_byte),
        .crc_byte_written,
        .crc_start_start    (crc_start),
        .crc,
        .watchdog_time,
        .breaks             (line_break),
        .transmit_timeouts  (transmit_expired),
        .syncs              (sync),
        .sync_axes
    );

    wire unused = &{1'b0, receiving, receive_free, transmit_overrun};
endmodule

`default_nettype wire
