// SPDX-License-Identifier: Apache-2.0
// link_spi -- carry the packets of the real-time link over SPI: in each transfer the host sends a
// request, and reads the reply after it.
//
// latency   0 cycles from the eighth rise of sclk to valid, 1 from the last byte to ends, 1 from a
//           rise of sclk to miso
// rate      one bit per 2 cycles
// behaviour SPI mode 0, most significant bit first; mode 3 works as well. The lists tell how long a
//           request is. After it, miso carries bytes of 0 until the reply begins, and again after
//           the reply: the first byte of a reply is not 0. Each bit of miso comes with the rise of
//           sclk before the one at which the host takes it, so the host has a whole period. If cs_n
//           rises within a request, the request is broken; if it rises before the end of the reply,
//           the remainder of the reply is dropped. A reply never comes in a later transfer.
// limits    With a synchroniser of 2 stages at the pins: sclk is high for at least 2 cycles and low
//           for at least 2, and its period is at least 5 cycles. cs_n is low for 2 cycles before
//           the first rise of sclk and after the last one, and high for 2 between transfers. miso
//           changes 2 to 4 cycles after the rise of sclk at the pin. The next byte of a reply is
//           valid before 8 further bits have been sent.
// source    docs/link.md
// model     tb/link/link_spi.py, equal in every bit of every cycle
// proved    No byte comes with the end of a request or after it, until cs_n rises. Bits of a reply
//           are only sent after a request of the same transfer was accepted, and miso is low
//           otherwise. Whenever no reply is being sent, offered bytes are dropped. A broken request
//           ends in the cycle in which it is cut, and is never accepted.
// proof     depth 20
`default_nettype none

module link_spi (
    input  wire        clk,
    input  wire        rst,
    input  wire  [6:0] writes,       // values in a request, up to 122
    // pins, synchronised
    input  wire        cs_n,         // level, low during a transfer
    input  wire        sclk,         // level
    input  wire        mosi,         // level, bits of the request
    output logic       miso,         // level, bits of the reply; low without one
    // requests
    output logic       valid,        // strobe: data is the next byte of a request
    output logic [7:0] data,         // byte
    output logic       ends,         // strobe: the request has ended
    output logic       broken,       // strobe, with ends: it is cut
    input  wire        accepted,     // strobe, 1 cycle after ends: the request is acted upon
    output logic       cut,          // strobe: a transfer has ended in a packet or in a byte
    // replies
    input  wire        reply_valid,  // level: reply_data is a byte of a reply
    input  wire  [7:0] reply_data,   // byte
    input  wire        reply_last,   // level: with reply_valid, the last byte
    output logic       reply_taken   // level: with reply_valid, the byte is taken in this cycle
);
    // made by tables/link.py, not to be edited
    localparam int FRAME_WORDS = 6;
    // end of the made constants

    typedef enum logic [2:0] {
        REQUEST,  // bytes of the request come, or the host has not begun
        ENDED,    // the request is whole
        JUDGED,   // it is accepted now, or not at all
        ANSWER,   // bytes of the reply are sent, or it has not begun
        LAST,     // the last byte of the reply is being sent
        DONE      // what is left of the transfer has no meaning
    } state_t;

    state_t       state;
    logic         sclk_q;
    logic   [2:0] bits;  // of the byte
    logic   [9:0] bytes;  // of the request
    logic   [6:0] held;  // bits of mosi
    logic   [7:0] shifted;  // bits that are sent

    wire          rise = sclk && !sclk_q && !cs_n;
    wire          whole = rise && bits == 3'd7;  // a byte
    wire    [9:0] length = {{1'b0, writes} + 8'(FRAME_WORDS), 2'b00};  // bytes of a request
    wire          some = bits != '0 || bytes != '0;  // something of a request has come
    wire          in_request = state == REQUEST;
    wire          loads = whole && state == ANSWER;

    assign miso        = shifted[7];
    assign valid       = whole && in_request;
    assign data        = {held, mosi};
    assign broken      = cs_n && in_request && some;
    assign ends        = broken || state == ENDED;
    assign cut         = cs_n && (in_request ? some : state != DONE || bits != '0);
    assign reply_taken = loads || state != ANSWER;

    always_ff @(posedge clk) begin
        sclk_q <= sclk;
        if (rise) begin
            bits    <= bits + 3'd1;
            held    <= {held[5:0], mosi};
            shifted <= {shifted[6:0], 1'b0};
        end
        if (valid) bytes <= bytes + 10'd1;
        if (loads && reply_valid) shifted <= reply_data;
        case (state)
            REQUEST: if (valid && bytes + 10'd1 == length) state <= ENDED;
            ENDED:   state <= JUDGED;
            JUDGED:  state <= accepted ? ANSWER : DONE;
            ANSWER:  if (loads && reply_valid && reply_last) state <= LAST;
            LAST:    if (whole) state <= DONE;
            default: state <= DONE;
        endcase
        if (rst || cs_n) begin
            state   <= REQUEST;
            bits    <= '0;
            bytes   <= '0;
            shifted <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic after;  // the request of this transfer has ended
    logic answers;  // it was accepted
    always @(posedge clk) begin
        past    <= 1'b1;
        after   <= (after || ends) && !cs_n && !rst;
        answers <= (answers || (state == JUDGED && accepted)) && !cs_n && !rst;
        if (!past) assume (rst);
        assume (writes <= 7'd122);
        if (past) begin
            assert (after == (state > ENDED));
            assert (answers == (state == ANSWER || state == LAST || (state == DONE && answers)));
            assert (!(valid && (ends || after)));
            if (!answers) assert (!miso && shifted == '0);
            if (!(answers && state == ANSWER)) assert (reply_taken);
            if (broken) assert (ends && cut && cs_n);
            if (ends && !broken) assert (bytes == $past(length) && bits == '0);
            if ($past(broken)) assert (state == REQUEST);
            if ($past(cs_n)) assert (!some && !miso && in_request);
            cover (valid && data == 8'h51);
            cover (broken && bytes != '0);
        end
    end
`endif
endmodule

`default_nettype wire
