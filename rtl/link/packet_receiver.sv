// SPDX-License-Identifier: Apache-2.0
// packet_receiver -- receive the requests of the real-time link as bytes, check them, and count the
// refused ones by cause.
//
// latency   1 cycle from ends to accepted; 0 cycles from every fourth byte to put
// rate      one byte per cycle; ends comes after the last byte, not with it
// behaviour Words go to the bank of the memory that the player does not read; an accepted packet
//           exchanges the banks. A packet is accepted only if it is whole, of this session, of the
//           length of the lists, later than the last accepted one, within the time window, and if
//           the player is idle. Any other one changes one count. A packet without a byte is
//           ignored. A packet of which any byte, or the end, comes while enable is low is
//           foreign, and the last sequence is 0 then; a packet that the carrier calls foreign is
//           so, too.
// limits    writes up to 122; settings change only while enable is low
// source    tables/link.toml: the layout of a packet
// model     tb/link/packet_receiver.py, equal in every bit of every cycle
// proved    A packet is accepted only with all its checks passed, while the player is idle, and
//           after at least 24 bytes. Each packet with a byte ends in an acceptance or in one more
//           refusal, never in both. Without enable nothing is put into the memory.
// proof     depth 8
`default_nettype none

module packet_receiver (
    input  wire         clk,
    input  wire         rst,
    // settings
    input  wire         enable,       // level: the link is on
    input  wire  [23:0] session,      // number that the host has chosen for this session
    input  wire  [ 6:0] writes,       // values in a request
    input  wire  [23:0] time_window,  // cycles, largest difference of the times; 0: not checked
    input  wire  [31:0] now,          // cycles, time of the node
    // packets
    input  wire         valid,        // strobe: data is the next byte of a packet
    input  wire  [ 7:0] data,         // byte
    input  wire         ends,         // strobe: the packet has ended
    input  wire         broken,       // strobe: the carrier has lost a byte of the packet
    input  wire         foreign,      // level: with ends, the packet is of a host that may not send
    // player
    input  wire         busy,         // level: a packet is being played or answered
    output logic        accepted,     // strobe: the packet in the bank is to be played
    output logic        bank,         // bank that is being filled; the player reads the other one
    output logic        put,          // strobe: word is stored
    output logic [ 6:0] put_at,       // place of the word in the bank
    output logic [31:0] word,         // word of the packet
    output logic [47:0] refused       // counts of 8 bits, in the order of the causes
);
    // made by tables/link.py, not to be edited
    localparam logic [7:0] KIND_REQUEST = 8'h51;
    localparam int REQUEST_IDENTITY = 0;
    localparam int REQUEST_SEQUENCE = 1;
    localparam int REQUEST_TIME = 2;
    localparam int FRAME_WORDS = 6;
    // end of the made constants
    localparam logic [31:0] WHOLE = 32'h2144DF1C;  // CRC-32 of bytes and their CRC-32

    logic [ 9:0] count;  // bytes of the packet, stops at its largest value
    logic [23:0] held;  // the three bytes before
    logic        lost;  // a byte was lost
    logic        missed;  // a byte came while enable was low
    logic        known;  // the first word is of this session
    logic [31:0] sequence_number, stamp;  // of the packet
    logic [31:0] last;  // sequence of the last accepted packet
    logic        judged;  // the checks are those of a packet
    logic whole, ours, fits, later, timely, idle;  // the checks
    wire [31:0] crc;

    wire [31:0] advance = sequence_number - last;
    wire [31:0] late = now - stamp;  // cycles, signed
    wire [31:0] off = late ^ {32{late[31]}};  // its size, one less if it is negative
    wire        near = off[31:24] == '0 && {off[23:0], 1'b0} < {time_window, !late[31]};
    wire [ 9:0] length = {{1'b0, writes} + 8'(FRAME_WORDS), 2'b00};  // bytes of a request
    wire        some = count != '0 || lost || broken;
    wire [ 5:0] checks = {idle, timely, later, fits, ours, whole};  // the first one is bit 0
    wire [ 5:0] cause = ~checks & (checks + 6'd1);  // the lowest check that failed

    crc32_stream u_crc (
        .clk,
        .rst,
        .start(ends),
        .valid,
        .data,
        .crc
    );

    assign word     = {data, held};
    assign put      = valid && enable && !count[9] && count[1:0] == 2'd3;
    assign put_at   = count[8:2];
    assign accepted = judged && &checks;

    always_ff @(posedge clk) begin
        if (valid) held <= {data, held[23:8]};
        if (ends) count <= '0;
        else if (valid && count != '1) count <= count + 10'd1;
        lost   <= !ends && (lost || broken);
        missed <= !ends && (missed || (valid && !enable));
        if (put && put_at == 7'(REQUEST_IDENTITY)) known <= word == {session, KIND_REQUEST};
        if (put && put_at == 7'(REQUEST_SEQUENCE)) sequence_number <= word;
        if (put && put_at == 7'(REQUEST_TIME)) stamp <= word;

        judged <= ends && some;
        whole  <= crc == WHOLE && !lost && !broken;
        ours   <= known && enable && !missed && !foreign;
        fits   <= count == length;
        later  <= advance != '0 && !advance[31];
        timely <= time_window == '0 || near;
        idle   <= !busy;

        if (accepted) begin
            bank <= !bank;
            last <= sequence_number;
        end else if (judged) begin
            for (int n = 0; n < 6; n++) if (cause[n]) refused[8*n+:8] <= refused[8*n+:8] + 8'd1;
        end
        if (!enable) last <= '0;
        if (rst) begin
            count   <= '0;
            lost    <= 1'b0;
            missed  <= 1'b0;
            judged  <= 1'b0;
            bank    <= 1'b0;
            last    <= '0;
            refused <= '0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic       some_before;  // the packet that has just ended had a byte
    logic [9:0] bytes_before;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (!(valid && ends) && writes <= 7'd122);
        some_before  <= ends && some && !rst;
        bytes_before <= count;
        if (past) begin
            if (accepted) assert (some_before && $past(enable && !busy && known && !foreign));
            if (accepted) assert ($past(crc) == WHOLE && $past(!lost && !broken));
            if (accepted) assert (bytes_before >= 10'd24 && bytes_before == $past(length));
            if (accepted && $past(enable)) assert ($past(sequence_number) != $past(last));
            assert (judged == some_before);
            if ($past(accepted && !rst)) assert (refused == $past(refused));
            if ($past(!judged && !rst)) assert (refused == $past(refused) && bank == $past(bank));
            if ($past(judged && !accepted && !rst))
                assert (refused != $past(refused) && bank == $past(bank));
            if ($past(accepted && !rst)) assert (bank != $past(bank));
            if (!enable) assert (!put);
            cover (refused[7:0] == 8'd1);
            cover (put && put_at == 7'd0);
        end
    end
`endif
endmodule

`default_nettype wire
