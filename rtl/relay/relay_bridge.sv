// SPDX-License-Identifier: Apache-2.0
// relay_bridge -- connect a relay to the bus of its host: a 9-bit UART, the frame check for address
// 1, and the requests.
//
// latency  see relay_requests; the answer begins one bit after a request is done
// rate     one request at a time
// behaviour  A request is `00 10 0001` with the 9th bit, length 1..LONGEST, body, CRC-32 of all
//          before, as on the RS-485 bus of the nodes. An answer is `01 10 0001`, length, body,
//          CRC-32. The bodies are those of relay_requests. A damaged frame has no answer.
// model    the models of its blocks; tested together by tb/system/test_relay.py
`default_nettype none

module relay_bridge #(
    parameter int LONGEST = 64  // bytes of a body
) (
    input  wire               clk,
    input  wire               rst,
    // bus
    input  wire        [19:0] bit_time,       // 1/16 cycle
    input  wire               rx,             // level, synchronous to clk
    output logic              tx,             // pin
    output logic              driver_enable,  // pin, 1: drive the bus
    // status
    input  wire        [ 7:0] events,         // strobes or levels: each sets its flag
    input  wire        [ 7:0] levels,         // as in the header of relay
    input  wire        [ 1:0] source,         // as in relay_store
    input  wire        [ 5:0] orders,         // orders of harmonic_map; 0: a table
    input  wire        [31:0] identity,       // CRC-32 of the set in use
    input  wire        [31:0] position,       // counts
    input  wire signed [31:0] correction,     // 2^-16 count
    output logic       [ 7:0] flags,          // sticky events
    // set
    output logic              set_start,      // strobe: a set begins
    output logic              set_valid,      // strobe: set_data is new
    output logic       [ 7:0] set_data,       // byte of the set
    // flash, through relay_store
    output logic              pass_select,    // level: select the chip
    input  wire               pass_ready,     // level: the chip waits for a byte
    output logic              pass_valid,     // strobe: send set_data to the chip
    input  wire               pass_done,      // strobe: pass_data is new
    input  wire        [ 7:0] pass_data       // byte of the chip
);
    wire received, ninth, framing_error, own, passed, good;
    wire answer_valid, answer_ready;
    wire [7:0] character, answer;
    wire unused_glitch, unused_receiving, unused_last, unused_bad, unused_sync;
    wire unused_sending, unused_tick;

    uart_rx u_receiver (
        .clk,
        .rst,
        .bit_time,
        .rx,
        .valid       (received),
        .data        (character),
        .ninth,
        .framing_error,
        .start_glitch(unused_glitch),
        .busy        (unused_receiving)
    );
    address_filter u_filter (
        .clk,
        .rst,
        .address (4'd1),
        .valid_in(received),
        .data_in (character),
        .ninth,
        .valid   (own)
    );
    frame_check #(
        .LONGEST(LONGEST)
    ) u_check (
        .clk,
        .rst,
        .valid_in  (own),
        .data      (character),
        .command   (ninth),
        .framing_error,
        .valid     (passed),
        .good      (unused_last),
        .frame_good(good),
        .frame_bad (unused_bad),
        .sync      (unused_sync)
    );
    relay_requests #(
        .LONGEST(LONGEST)
    ) u_requests (
        .clk,
        .rst,
        .valid  (passed),
        .data   (character),
        .command(ninth),
        .good,
        .events,
        .levels,
        .source,
        .orders,
        .identity,
        .position,
        .correction,
        .flags,
        .set_start,
        .set_valid,
        .set_data,
        .pass_select,
        .pass_ready,
        .pass_valid,
        .pass_done,
        .pass_data,
        .answer_valid,
        .answer_ready,
        .answer
    );
    uart_tx u_transmitter (
        .clk,
        .rst,
        .bit_time,
        .valid(answer_valid),
        .ready(answer_ready),
        .data (answer),
        .ninth(1'b0),
        .tx,
        .driver_enable,
        .busy (unused_sending),
        .tick (unused_tick)
    );

    wire unused = &{
        1'b0, unused_glitch, unused_receiving, unused_last, unused_bad, unused_sync, unused_sending,
        unused_tick
    };
endmodule

`default_nettype wire
