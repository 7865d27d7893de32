// SPDX-License-Identifier: Apache-2.0
// link_datagram -- carry the packets of the real-time link in UDP datagrams: find the end of a
// request, and address the reply.
//
// latency   0 cycles from a byte to valid, 1 cycle from the last byte to ends
// rate      one byte per cycle, and a pause of one cycle after a datagram
// behaviour A datagram is one packet, without framing. The host whose request was accepted last is
//           the master, and replies go to it. While locked is high, a packet of any other host is
//           foreign. Without a master, as after the link was off, any host may become it.
// source    tables/link.toml: the words of a reply
// model     tb/link/link_datagram.py, equal in every bit of every cycle
// proved    A packet ends exactly once after each last byte, never together with a byte. While
//           locked is high and the link is on, the master stays, since packet_receiver accepts no
//           foreign packet.
// proof     depth 8
`default_nettype none

module link_datagram (
    input  wire         clk,
    input  wire         rst,
    // settings
    input  wire         enable,    // level: the link is on
    input  wire  [ 6:0] reads,     // values in a reply
    input  wire         locked,    // level: a drive is on, the master stays
    // datagrams
    input  wire         rx_valid,  // level: data is a byte of a datagram
    input  wire         rx_last,   // level: with rx_valid, the last byte
    input  wire         rx_error,  // level: with rx_valid, the datagram is damaged
    input  wire  [47:0] sender,    // IP address, UDP port in bits 15:0; steady in a datagram
    output logic        rx_ready,  // level: with rx_valid, the byte is taken in this cycle
    output logic [47:0] receiver,  // of the reply, as sender
    output logic [15:0] length,    // bytes of the reply
    // requests
    output logic        valid,     // strobe: the byte is the next one of a packet
    output logic        ends,      // strobe: the packet has ended
    output logic        broken,    // strobe: the packet is damaged
    output logic        foreign,   // level: with ends, the packet is of another host
    input  wire         accepted   // strobe, 1 cycle after ends: the request is acted upon
);
    // made by tables/link.py, not to be edited
    localparam int REPLY_FRAME_WORDS = 7;
    // end of the made constants

    logic [47:0] host;  // sender of the datagram
    logic [47:0] master;
    logic        known;  // there is a master

    assign rx_ready = !ends;
    assign valid    = rx_valid && rx_ready;
    assign broken   = valid && rx_error;
    assign foreign  = locked && known && host != master;
    assign receiver = master;
    assign length   = 16'({{1'b0, reads} + 8'(REPLY_FRAME_WORDS), 2'b00});

    always_ff @(posedge clk) begin
        ends <= valid && rx_last;
        if (valid) host <= sender;
        if (accepted) master <= host;
        known <= enable && (known || accepted);
        if (rst) begin
            ends  <= 1'b0;
            known <= 1'b0;
        end
    end

`ifdef FORMAL
    logic [1:0] past = '0;
    always @(posedge clk) begin
        past <= {past[0], 1'b1};
        if (!past[0]) assume (rst);
        // what packet_receiver guarantees
        if (accepted) assume (past[0] && $past(ends && enable && !foreign && !rst));
        assert (!(valid && ends));
        if (past[0]) begin
            assert (ends == $past(valid && rx_last && !rst));
            if ($past(!accepted)) assert ($stable(master));
            if ($past(!enable || rst)) assert (!known);
            cover (foreign && ends);
        end
        if (past[1]) if ($past(locked && known, 2)) assert ($stable(master));
    end
`endif
endmodule

`default_nettype wire
