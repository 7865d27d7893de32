// SPDX-License-Identifier: Apache-2.0
// relay_bridge -- answer a host over a 9-bit UART: status of a relay, its set of coefficients, and bytes for its flash.
//
// latency  the answer begins one bit after a request is done; SPI takes 65 clk a byte       rate  one request at a time
// request  `00 10 0001` with the 9th bit, length 1..LONGEST, body, CRC-32 of all before, as on the house's line
// answer   `01 10 0001` with the 9th bit, length, body, CRC-32; no answer to what is broken
// body     0: status. 1: status, and the flags fall. 2: a set begins with the bytes that follow, 3: it goes on with them: status.
//          4: a row of bytes to the flash under one select; the answer is 4 and the bytes that came back
// status   the body's first byte, flags, levels, store source, identity, position, correction: 16 bytes, low byte first
// model    tb/system/relay_host.py is the host
`default_nettype none

module relay_bridge #(
    parameter int LONGEST = 64                      // bytes of a body
) (
    input  wire                  clk,
    input  wire                  rst,
    input  wire        [19:0]    bit_time,          // 1/16 clk
    input  wire                  rx,                // level, synchronous to clk
    output logic                 tx,                // pin
    output logic                 driver_enable,     // pin: of the line driver
    input  wire        [7:0]     events,            // strobes or levels: each sets its flag
    input  wire        [7:0]     levels,
    input  wire        [1:0]     source,            // of relay_store
    input  wire        [31:0]    identity,          // of relay_set
    input  wire        [31:0]    position,          // counts
    input  wire signed [31:0]    correction,        // 2^-16 count
    output logic       [7:0]     flags,             // sticky
    output logic                 set_start,         // strobe
    output logic                 set_valid,         // strobe
    output logic       [7:0]     set_data,
    output logic                 pass_select,       // level: to relay_store
    output logic                 pass_valid,        // strobe
    input  wire                  pass_done,         // strobe
    input  wire        [7:0]     pass_data
);
    localparam int P = $clog2(LONGEST + 6);
    localparam logic [7:0] CLEAR = 8'd1, BEGIN_SET = 8'd2, SET = 8'd3, FLASH = 8'd4;
    localparam logic [7:0] REPLY  = 8'h61;
    localparam int         TOLD   = 16;             // bytes of a status

    typedef enum logic [2:0] {LISTEN, READ, ACT, WAIT, SPEAK} state_t;

    state_t       state;
    logic [7:0]   buffer [0:(1<<P)-1];
    logic [7:0]   read;
    logic [P-1:0] at, taken, length;                // byte of the body, or of the answer; bytes taken in; of the request
    logic [7:0]   kind;                             // first byte of the body
    logic [1:0]   tail;                             // byte of the CRC-32
    logic [127:0] told;
    logic         fetched, closing;                 // read stands; the CRC-32 goes out
    logic         sum_start, sum_valid;             // of the CRC-32, one clk behind the line
    logic [7:0]   out_q;

    wire         received, ninth_in, framing_error, own, command, good, ready;
    wire  [7:0]  byte_in, own_data, data;
    wire         passed, passed_command;
    wire         unused_glitch, unused_receiving, unused_good, unused_bad, unused_sending;
    wire  [31:0] crc;

    character_receiver u_receiver
        (.clk, .rst, .bit_time, .rx, .valid(received), .data(byte_in), .ninth(ninth_in), .framing_error, .start_glitch(unused_glitch),
         .busy(unused_receiving));
    address_filter u_filter
        (.clk, .rst, .address(4'd1), .valid_in(received), .data_in(byte_in), .ninth(ninth_in), .valid(own), .data(own_data), .command);
    frame_check #(.LONGEST(LONGEST)) u_check
        (.clk, .rst, .valid_in(own), .data_in(own_data), .command_in(command), .framing_error, .valid(passed), .data, .command(passed_command),
         .good, .frame_good(unused_good), .frame_bad(unused_bad));

    wire         unused = &{1'b0, unused_glitch, unused_receiving, unused_good, unused_bad, unused_sending};
    wire         keep   = passed && !passed_command && state == LISTEN;
    wire         flash  = kind == FLASH;
    wire [P-1:0] words  = flash ? length : P'(TOLD);         // bytes of the answer's body
    wire         first  = at == '0;
    wire         second = at == P'(1);
    wire [7:0]   body   = flash ? read : told[7:0];
    wire [7:0]   crc_at = crc[8*tail +: 8];
    wire [7:0]   out    = first ? REPLY : second ? 8'(words) : closing ? crc_at : body;
    wire         speaks = state == SPEAK && fetched;
    wire         sent   = speaks && ready;

    crc32_stream u_crc (.clk, .rst, .start(sum_start), .valid(sum_valid), .data(out_q), .crc);
    character_transmitter u_transmitter
        (.clk, .rst, .bit_time, .valid(speaks), .ready, .data(out), .ninth(first), .tx, .driver_enable, .busy(unused_sending));

    // a body lies from 0 up; the bytes of an answer are counted from its first, two before the body
    always_ff @(posedge clk) begin
        if (keep)           buffer[taken - 1'b1] <= data;
        else if (pass_done) buffer[at] <= pass_data;
        read <= buffer[state == SPEAK ? at - P'(2) : at];
    end

    always_ff @(posedge clk) begin
        set_start  <= 1'b0;
        set_valid  <= 1'b0;
        pass_valid <= 1'b0;
        flags      <= flags | events;
        fetched    <= 1'b1;
        sum_start  <= sent && first;
        sum_valid  <= sent && !closing;
        out_q      <= out;
        if (state == LISTEN && passed) taken <= passed_command ? '0 : taken + 1'b1;
        if (keep && taken == '0) length <= P'(data);
        case (state)
            LISTEN: begin
                at      <= '0;
                closing <= 1'b0;
                tail    <= '0;
                fetched <= 1'b0;
                if (good) state <= READ;
            end
            READ: begin                             // the byte comes out of the buffer
                fetched <= 1'b1;
                if (fetched) state <= ACT;
            end
            ACT: begin
                if (first) begin
                    kind        <= read;
                    set_start   <= read == BEGIN_SET;
                    pass_select <= read == FLASH;
                    told        <= {correction, position, identity, 6'd0, source, levels, flags, read};
                    if (read == CLEAR) flags <= events;
                end else begin
                    set_data   <= read;
                    set_valid  <= kind == BEGIN_SET || kind == SET;
                    pass_valid <= flash;
                end
                fetched <= 1'b0;
                state   <= flash && !first ? WAIT : READ;
                if (!flash || first) at <= at + 1'b1;
                if (at + 1'b1 == length && (!flash || first)) begin
                    state <= read > FLASH && first ? LISTEN : SPEAK;
                    at    <= '0;
                end
            end
            WAIT:
                if (pass_done) begin
                    at      <= at + 1'b1;
                    fetched <= 1'b0;
                    state   <= READ;
                    if (at + 1'b1 == length) begin
                        state <= SPEAK;
                        at    <= '0;
                    end
                end
            SPEAK: begin
                pass_select <= 1'b0;
                if (sent) begin
                    fetched <= 1'b0;
                    if (!closing) at <= at + 1'b1;
                    else          tail <= tail + 1'b1;
                    if (!first && !second) told <= told >> 8;
                    if (at == words + P'(1)) closing <= 1'b1;
                    if (closing && tail == 2'd3) state <= LISTEN;
                end
            end
            default: state <= LISTEN;
        endcase
        if (rst) begin
            state       <= LISTEN;
            taken       <= '0;
            flags       <= '0;
            pass_select <= 1'b0;
            set_start   <= 1'b0;
            set_valid   <= 1'b0;
            pass_valid  <= 1'b0;
        end
    end
endmodule

`default_nettype wire
