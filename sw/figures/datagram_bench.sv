// SPDX-License-Identifier: Apache-2.0
// datagram_bench -- process_link behind link_datagram, with the ports of process_link where they
// are the same, for link_run.cpp.
`default_nettype none

module datagram_bench (
    input  wire         clk,
    input  wire         rst,
    input  wire  [31:0] now,
    input  wire         enable,
    input  wire  [23:0] session,
    input  wire  [ 6:0] writes,
    input  wire  [ 6:0] reads,
    input  wire  [23:0] time_window,
    input  wire         list_put,
    input  wire  [ 6:0] list_at,
    input  wire  [31:0] list_entry,
    output logic        busy,
    output logic [47:0] refused,
    // datagrams
    input  wire         locked,       // level: a drive is on
    input  wire         rx_valid,     // level: a byte
    input  wire  [ 7:0] rx_data,      // byte
    input  wire         rx_last,      // level: with rx_valid, the last byte
    input  wire         rx_broken,    // level: with rx_valid, the datagram is damaged
    input  wire  [47:0] sender,       // IP address and port
    output logic [47:0] receiver,     // IP address and port
    output logic [15:0] length,       // bytes of the reply
    output logic        tx_valid,
    output logic        tx_last,
    input  wire         tx_taken,
    // register bus
    input  wire         ready,
    output logic        select
);
    wire valid, ends, broken, foreign, accepted, rx_ready, expired, request, write;
    wire pll_locked, capturing;
    wire [ 7:0] tx_data;
    wire [15:0] address;
    wire [20:0] phase_error;
    wire [31:0] wdata, read_at;

    link_datagram u_datagram (
        .clk,
        .rst,
        .enable,
        .reads,
        .locked,
        .rx_valid,
        .rx_last,
        .rx_error(rx_broken),
        .sender,
        .rx_ready,
        .receiver,
        .length,
        .valid,
        .ends,
        .broken,
        .foreign,
        .accepted
    );
    process_link u_link (
        .clk,
        .rst,
        .now,
        .enable,
        .session,
        .writes,
        .reads,
        .time_window,
        .watchdog_ms (16'd0),
        .pll_period  (20'd0),
        .capture_lead(19'd0),
        .list_put,
        .list_at,
        .list_entry,
        .busy,
        .refused,
        .expired,
        .locked      (pll_locked),
        .phase_error,
        .capturing,
        .read_at,
        .rx_valid    (valid),
        .rx_data,
        .rx_ends     (ends),
        .rx_broken   (broken),
        .rx_foreign  (foreign),
        .accepted,
        .tx_valid,
        .tx_data,
        .tx_last,
        .tx_taken,
        .request,
        .ready,
        .select,
        .write,
        .address,
        .wdata,
        .rdata       (32'd0)
    );

    wire unused = &{
        1'b0, rx_ready, expired, request, write, tx_data, address, wdata,
        pll_locked, phase_error, capturing, read_at
    };
endmodule

`default_nettype wire
