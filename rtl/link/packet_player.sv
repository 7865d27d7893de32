// SPDX-License-Identifier: Apache-2.0
// packet_player -- play an accepted request of the real-time link onto the register bus, and answer
// it with what it reads there.
//
// latency   1 cycle from start to the first step; 7 cycles for each register while ready is high,
//           2 cycles for each word of the head of the reply, 6 cycles for four bytes of the reply
//           while taken is high, and 1 cycle after each of the six phases; 1 cycle from capture to
//           the first step of the reading, while no request is played or answered
// rate      one request at a time: start is ignored while busy is high
// behaviour The values of the request are written to the registers of the write list, in order.
//           Then the time is taken, the registers of the read list are read, in order, and the
//           spare access follows. The reply is sent only after that, from a memory of its own.
//           Entry n of the lists has the address of write n in bits 15:0 and that of read n in bits
//           31:16; it is stored while enable and busy are low and no capture is made.
//           With CAPTURES the registers of the read list are read at `capture` too, and while
//           `hold` is high the next reply carries these values instead of reading. No values are
//           sent twice: a request without a capture since the last one reads the registers. A
//           request that comes during a capture waits for its end; a capture that comes during a
//           request, too.
// limits    writes and reads up to 122; they change only while enable and busy are low
// source    tables/link.toml: the layout of a packet
// model     tb/link/packet_player.py, equal in every bit of every cycle
// proved    The register bus gets no access unless a request is being played or a capture is made,
//           and a capture only reads. Bytes are sent only while a request is being answered, each
//           stays until it is taken, and last comes only with the last byte of the CRC-32.
// proof     depth 10, CAPTURES = 1
`default_nettype none

module packet_player #(
    parameter int CAPTURES = 0  // 1: the read list can be read before a request
) (
    input  wire         clk,
    input  wire         rst,
    // settings
    input  wire         enable,      // level: the link is on
    input  wire  [ 6:0] writes,      // entries of the write list
    input  wire  [ 6:0] reads,       // entries of the read list
    input  wire         list_put,    // strobe: list_entry is stored
    input  wire  [ 6:0] list_at,     // number of the entry
    input  wire  [31:0] list_entry,  // addresses of two registers
    // request
    input  wire         put,         // strobe: word of a request is stored
    input  wire         bank,        // bank that is being filled
    input  wire  [ 6:0] put_at,      // place of the word in the bank
    input  wire  [31:0] word,        // word of a request
    input  wire         start,       // strobe: the request in the bank is to be played
    output logic        busy,        // level: a request is being played or answered
    // captures
    input  wire         capture,     // strobe: read the registers of the read list
    input  wire         hold,        // level: a reply carries a capture, if there is a new one
    output logic        capturing,   // level: they are being read for a capture
    output logic [31:0] read_at,     // cycles, time at which the last reading began; 0 without
    // for the reply
    input  wire  [31:0] now,         // cycles, time of the node
    input  wire  [47:0] refused,     // counts of refused packets
    input  wire         expired,     // level: the watchdog has expired
    // register bus
    output logic        request,     // level: an access waits for ready
    input  wire         ready,       // level: the registers take an access in the next cycle
    output logic        select,      // strobe: an access
    output logic        write,       // level: with select, wdata is to be written
    output logic [15:0] address,     // byte address, from 1 cycle before select on
    output logic [31:0] wdata,       // word to be written, from 1 cycle before select on
    input  wire  [31:0] rdata,       // word read, 2 cycles after select
    // reply
    output logic        valid,       // level: data is a byte of the reply
    output logic [ 7:0] data,        // byte
    output logic        last,        // level: with valid, the last byte
    input  wire         taken        // level: with valid, the byte is taken in this cycle
);
    // made by tables/link.py, not to be edited
    localparam logic [7:0] KIND_REPLY = 8'hA2;
    localparam int REQUEST_WORDS = 3;
    localparam int REPLY_IDENTITY = 0;
    localparam int REPLY_SEQUENCE = 1;
    localparam int REPLY_TIME = 2;
    localparam int REPLY_REFUSED = 3;
    localparam int REPLY_WORDS = 5;
    localparam int REPLY_END_WORDS = 1;
    // end of the made constants

    // Requests: banks 0 and 1, then the lists. No word of the memories that is used is read in the
    // cycle in which it is written.
    (* no_rw_check *)logic [31:0] requests[0:511];
    (* no_rw_check *)logic [31:0] replies [0:127];

    typedef enum logic [2:0] {
        IDLE,
        FETCH,   // the memory reads an entry of a list, or a word
        VALUE,   // it has read; it reads the value to be written
        TAKE,    // the access begins
        ANSWER,  // the access is under way
        BYTES    // four bytes are being sent
    } state_t;

    // phases
    localparam logic [2:0] WRITES = 3'd0;
    localparam logic [2:0] HEAD = 3'd1;  // of the reply
    localparam logic [2:0] READS = 3'd2;
    localparam logic [2:0] SPARE = 3'd3;
    localparam logic [2:0] SEND = 3'd4;
    localparam logic [2:0] SEAL = 3'd5;  // CRC-32

    state_t        state;
    logic   [ 2:0] phase;
    logic   [ 7:0] index;  // of the entry or the word
    logic   [15:0] at;  // address of the register
    logic          writing;
    logic   [ 1:0] number;  // of the byte
    logic [31:0] fetched, reply_word;  // what the memories have read
    logic free, done;
    logic captured;  // the memory of the reply has the values of a capture for the next reply
    logic captures, plays;  // levels: what begins if the player is idle
    wire  [31:0] crc;

    // words of the phase
    logic [ 7:0] words;
    always_comb begin
        case (phase)
            WRITES:  words = {1'b0, writes};
            HEAD:    words = 8'(REPLY_WORDS);
            READS:   words = {1'b0, reads};
            SPARE:   words = 8'd1;
            SEND:    words = {1'b0, reads} + 8'(REPLY_WORDS + REPLY_END_WORDS);
            default: words = 8'd1;
        endcase
    end

    // place in the memory of the requests
    wire       in_list = phase == WRITES || phase == READS;
    wire       from_list = state == FETCH && in_list;
    wire [6:0] spare_at = writes + 7'(REQUEST_WORDS) + {6'd0, state == VALUE};
    wire [6:0] value_at = index[6:0] + (phase == HEAD ? 7'd0 : 7'(REQUEST_WORDS));
    wire [8:0] request_at = {1'b0, !bank, phase == SPARE ? spare_at : value_at};
    wire [8:0] fetch_at = from_list ? {2'b10, index[6:0]} : request_at;
    wire       list_stored = list_put && !enable && !busy && !capturing;

    always_ff @(posedge clk) begin
        if (put || list_stored)
            requests[list_stored?{2'b10, list_at} : {1'b0, bank, put_at}] <=
                list_stored ? list_entry : word;
        fetched <= requests[fetch_at];
    end

    // memory of the reply
    wire  [ 2:0] head_at = index[2:0];
    wire  [31:0] reply_identity = {fetched[31:8], KIND_REPLY};  // the session is the link's
    wire  [31:0] refused_low = refused[31:0];
    wire  [31:0] link_state = {15'd0, expired, refused[47:32]};
    logic [31:0] head;
    always_comb begin
        case (head_at)
            3'(REPLY_IDENTITY): head = reply_identity;
            3'(REPLY_SEQUENCE): head = fetched;
            3'(REPLY_TIME):     head = now;
            3'(REPLY_REFUSED):  head = refused_low;
            default:            head = link_state;
        endcase
    end
    wire       heads = state == VALUE && phase == HEAD;
    wire       reply_put = heads || (state == ANSWER && done && phase != WRITES);
    wire [6:0] past_head = heads ? 7'd0 : 7'(REPLY_WORDS);
    wire [6:0] past_reads = phase == SPARE ? reads : 7'd0;
    wire [6:0] reply_at = index[6:0] + past_head + past_reads;

    always_ff @(posedge clk) begin
        if (reply_put) replies[reply_at] <= heads ? head : rdata;
        reply_word <= replies[index[6:0]];
    end

    register_access u_access (
        .clk,
        .rst,
        // request
        .take (state == TAKE),
        .put  (writing),
        .at,
        .value(fetched),
        .free,
        .waits(request),
        .done,
        // register bus
        .ready,
        .select,
        .write,
        .address,
        .wdata
    );

    crc32_stream u_crc (
        .clk,
        .rst,
        .start(state == IDLE),
        .valid(valid && taken && phase == SEND),
        .data,
        .crc
    );

    wire [31:0] sent_word = phase == SEAL ? crc : reply_word;
    wire        ends = index == words;
    wire        sent = valid && taken && number == 2'd3;

    if (CAPTURES != 0) begin : g_captures
        logic due, waiting;  // what could not begin yet

        assign captures = capture || due;
        assign plays    = start || waiting;
        assign busy     = (state != IDLE && !capturing) || waiting;

        always_ff @(posedge clk) begin
            due     <= hold && captures && state != IDLE;
            waiting <= (waiting || (start && !busy)) && (state != IDLE || captures);
            if (state == IDLE) capturing <= captures;
            else if (state == FETCH && ends && phase == READS) capturing <= 1'b0;
            if (state == FETCH && ends) captured <= capturing || (captured && phase != HEAD);
            if (!hold) captured <= 1'b0;
            if (state == FETCH && phase == READS && index == '0) read_at <= now;
            if (rst) begin
                due       <= 1'b0;
                waiting   <= 1'b0;
                capturing <= 1'b0;
                captured  <= 1'b0;
            end
        end
    end else begin : g_no_captures
        assign {captures, capturing, captured} = '0;
        assign plays   = start;
        assign busy    = state != IDLE;
        assign read_at = '0;

        wire unused_capture = &{1'b0, capture, hold};
    end

    assign valid = state == BYTES;
    assign data  = sent_word[8*number+:8];
    assign last  = valid && phase == SEAL && number == 2'd3;

    always_ff @(posedge clk) begin
        case (state)
            IDLE: begin
                phase <= captures ? READS : WRITES;
                index <= '0;
                if (captures || plays) state <= FETCH;
            end
            FETCH:
            if (ends) begin
                index <= '0;
                phase <= phase == HEAD && captured ? SPARE : phase + 3'd1;
                if (phase == SEAL || capturing) state <= IDLE;
            end else state <= VALUE;
            VALUE: begin
                at      <= phase == READS ? fetched[31:16] : fetched[15:0];
                writing <= phase == WRITES || (phase == SPARE && fetched[31]);
                number  <= '0;
                if (phase == HEAD) index <= index + 8'd1;
                state <= phase == HEAD ? FETCH : phase == SEND || phase == SEAL ? BYTES : TAKE;
            end
            TAKE: state <= ANSWER;
            ANSWER:
            if (done) begin
                index <= index + 8'd1;
                state <= FETCH;
            end
            BYTES:
            if (taken) begin
                number  <= number + 2'd1;
                if (sent) begin
                    index <= index + 8'd1;
                    state <= FETCH;
                end
            end
            default:  // unreachable: state has one of its six values
            state <= IDLE;
        endcase
        if (rst) state <= IDLE;
    end

    wire unused = &{1'b0, free};

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (writes <= 7'd122 && reads <= 7'd122);
        if (past && !$past(rst)) begin
            assert (state <= BYTES);
            if (state != IDLE) assert (phase <= SEAL && (busy || capturing));
            if (capturing) assert (state != IDLE && phase == READS);
            assert (free == (state != ANSWER));
            // an access waits, is made, or is being answered
            assert (32'(!free) == 32'(request) + 32'(select) + 32'($past(select)) + 32'(done));
            if (select) assert (state == ANSWER);
            if (state == TAKE || state == ANSWER) assert (phase != HEAD && phase < SEND);
            if (state == BYTES) assert (phase == SEND || phase == SEAL);
            if (phase == WRITES && select) assert (write);
            if (phase == READS && select) assert (!write);
            if (state == TAKE) assert (writing == (phase == WRITES) || phase == SPARE);
            if (state == ANSWER) assert (write == (phase == WRITES) || phase == SPARE);
            if (state == BYTES) assert (reply_word == replies[index[6:0]]);
            if ($past(valid && !taken)) assert (valid && $stable(data) && $stable(last));
            if (last) assert (valid && phase == SEAL);
            cover (select && write);
            cover (state == VALUE && phase == HEAD);
            cover (capturing && select);
        end
    end
`endif
endmodule

`default_nettype wire
