// SPDX-License-Identifier: Apache-2.0
// angle_sensor_port -- receive the frames of an absolute angle sensor; if it is not built, it
// reports nothing.
//
// latency  see angle_frame
// rate     one frame at a time
// source   S4: the sub-controller reads a time-grating sensor
// model    the models of its blocks; tested together by tb/peripheral/test_peripherals.py
`default_nettype none

module angle_sensor_port #(
    parameter int BUILT = 1  // 0: no logic, all outputs are 0
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         rx_pin,           // pin, idles high
    input  wire  [19:0] bit_time,         // 1/16 cycle, duration of a bit
    input  wire  [23:0] gap,              // cycles, longest pause inside a frame
    input  wire  [31:0] stale_after,      // cycles without a good frame; 0: never stale
    input  wire         clear,            // strobe: clear the three error counts
    output logic        frame,            // strobe: a good frame has come
    output logic [31:0] angle,            // 2^-32 turn, of the last good frame
    output logic [31:0] age,              // cycles since that frame began
    output logic [ 7:0] sequence_number,  // of the last good frame
    output logic        stale,            // level: no frame yet, or the last one is too old
    output logic [ 7:0] crc_errors,       // frames with a wrong CRC-16
    output logic [ 7:0] broken,           // frames with a pause or a framing error inside
    output logic [ 7:0] missed            // frames that the sequence numbers leave out
);
    if (BUILT == 0) begin : g_idle
        assign {frame, angle, age, sequence_number, stale, crc_errors, broken, missed} = '0;
        wire unused = &{1'b0, clk, rst, rx_pin, bit_time, gap, stale_after, clear};
    end else begin : g_built
        wire rx, received, ninth, framing_error, start_glitch, receiving;
        wire [7:0] data;

        synchroniser #(
            .RESET(1)
        ) u_pin (
            .clk,
            .rst,
            .d(rx_pin),
            .q(rx)
        );
        uart_rx #(
            .NINTH(0)
        ) u_receiver (
            .clk,
            .rst,
            .bit_time,
            .rx,
            .valid(received),
            .data,
            .ninth,
            .framing_error,
            .start_glitch,
            .busy (receiving)
        );
        angle_frame #(
            .W(8)
        ) u_frame (
            .clk,
            .rst,
            .gap,
            .stale_after,
            .byte_valid(received),
            .byte_data (data),
            .framing_error,
            .clear,
            .valid     (frame),
            .angle,
            .sequence_number,
            .age,
            .stale,
            .crc_errors,
            .broken,
            .missed
        );
        wire unused = &{1'b0, ninth, start_glitch, receiving};
    end
endmodule

`default_nettype wire
