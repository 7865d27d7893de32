// SPDX-License-Identifier: Apache-2.0
// process_link -- the real-time link of a node: packets of process data between a carrier and the
// register bus, without the soft core.
//
// latency   see the blocks
// rate      see the blocks
// behaviour A request that passes all checks is played onto the register bus and answered; any
//           other one changes nothing but its count. The watchdog reports when no request has been
//           accepted for watchdog_ms. With PLL the read list is also read capture_lead before each
//           request that is expected, as soon as the arrivals are locked; its reply carries that.
// source    tables/link.toml: the layout of a packet
// model     the models of its blocks; tested together by tb/link/test_process_link.py
`default_nettype none

module process_link #(
    parameter int CLK_HZ = 60_000_000,  // Hz, clk frequency; a multiple of 1000
    parameter int PLL = 0  // 1: build the PLL of the arrivals, and captures before them
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [31:0] now,           // cycles, time of the node
    // settings, which change only while enable and busy are low
    input  wire         enable,        // level: the link is on
    input  wire  [23:0] session,       // number that the host has chosen for this session
    input  wire  [ 6:0] writes,        // entries of the write list, up to 122
    input  wire  [ 6:0] reads,         // entries of the read list, up to 122
    input  wire  [23:0] time_window,   // cycles, largest difference of the times; 0: not checked
    input  wire  [15:0] watchdog_ms,   // ms, longest time without a good request; 0: no limit
    input  wire  [19:0] pll_period,    // cycles, expected from one request to the next; 0: off
    input  wire  [18:0] capture_lead,  // cycles, from a capture to the expected request
    input  wire         list_put,      // strobe: list_entry is stored
    input  wire  [ 6:0] list_at,       // number of the entry
    input  wire  [31:0] list_entry,    // address that is written in bits 15:0, read in bits 31:16
    // state
    output logic        busy,          // level: a request is being played or answered
    output logic [47:0] refused,       // counts of 8 bits, in the order of the causes
    output logic        expired,       // level: the watchdog has expired
    output logic        locked,        // level: the PLL is locked, captures are made
    output logic [20:0] phase_error,   // cycles, signed: how late the last request was
    output logic        capturing,     // level: the read list is being read for a capture
    output logic [31:0] read_at,       // cycles, when the last reading began; 0 without PLL
    // requests from the carrier
    input  wire         rx_valid,      // strobe: rx_data is the next byte of a packet
    input  wire  [ 7:0] rx_data,       // byte
    input  wire         rx_ends,       // strobe: the packet has ended, after its last byte
    input  wire         rx_broken,     // strobe: the carrier has lost a byte of the packet
    input  wire         rx_foreign,    // level: with rx_ends, it is of a host that may not send
    output logic        accepted,      // strobe, 1 cycle after rx_ends: the request is acted upon
    // replies to the carrier
    output logic        tx_valid,      // level: tx_data is a byte of the reply
    output logic [ 7:0] tx_data,       // byte
    output logic        tx_last,       // level: with tx_valid, the last byte
    input  wire         tx_taken,      // level: with tx_valid, the byte is taken in this cycle
    // register bus
    output logic        request,       // level: an access waits for ready
    input  wire         ready,         // level: the registers take an access in the next cycle
    output logic        select,        // strobe: an access
    output logic        write,         // level: with select, wdata is to be written
    output logic [15:0] address,       // byte address, from 1 cycle before select on
    output logic [31:0] wdata,         // word to be written, from 1 cycle before select on
    input  wire  [31:0] rdata          // word read, 2 cycles after select
);
    wire bank, put, capture;
    wire [ 6:0] put_at;
    wire [31:0] word;

    packet_receiver u_receiver (
        .clk,
        .rst,
        // settings
        .enable,
        .session,
        .writes,
        .time_window,
        .now,
        // packets
        .valid  (rx_valid),
        .data   (rx_data),
        .ends   (rx_ends),
        .broken (rx_broken),
        .foreign(rx_foreign),
        // player
        .busy,
        .accepted,
        .bank,
        .put,
        .put_at,
        .word,
        .refused
    );
    packet_player #(
        .CAPTURES(PLL)
    ) u_player (
        .clk,
        .rst,
        // settings
        .enable,
        .writes,
        .reads,
        .list_put,
        .list_at,
        .list_entry,
        // request
        .put,
        .bank,
        .put_at,
        .word,
        .start(accepted),
        .busy,
        // captures
        .capture,
        .hold (locked),
        .capturing,
        .read_at,
        // for the reply
        .now,
        .refused,
        .expired,
        // register bus
        .request,
        .ready,
        .select,
        .write,
        .address,
        .wdata,
        .rdata,
        // reply
        .valid(tx_valid),
        .data (tx_data),
        .last (tx_last),
        .taken(tx_taken)
    );
    heartbeat_watchdog #(
        .CLK_HZ(CLK_HZ)
    ) u_watchdog (
        .clk,
        .rst,
        .time_ms(watchdog_ms),
        .kick   (accepted),
        .armed  (enable),
        .expired
    );

    if (PLL != 0) begin : g_pll
        link_pll u_pll (
            .clk,
            .rst,
            .enable,
            .period (pll_period),
            .lead   (capture_lead),
            .arrived(accepted),
            .locked,
            .error  (phase_error),
            .capture
        );
    end else begin : g_no_pll
        assign {locked, phase_error, capture} = '0;

        wire unused_pll = &{1'b0, pll_period, capture_lead};
    end
endmodule

`default_nettype wire
