// SPDX-License-Identifier: Apache-2.0
// relay_requests -- execute the requests of a relay's host and answer them: status, flags, set of
// coefficients, flash.
//
// latency  2 cycles per byte of the request, then 3 cycles to the first byte of the answer; a
//          request for the flash takes as long as the flash
// rate     one request at a time; a frame that comes before the answer is sent is dropped
// behaviour  The body is sequence number, kind, data. Kind 0: status. 1: clears the flags that are
//          set in the next byte. 2: a set begins with the bytes that follow. 3: the set continues.
//          4: bytes to the flash under one select. Another kind has no answer. A request with the
//          sequence number of the one before is answered but not executed again; bytes to the flash
//          are sent again, since a chip writes only after a write enable, which the first time used
//          up.
//          The answer is `01 10 0001`, length, sequence number, kind, then flags, levels, source
//          with orders above, identity, position, correction as they are when the answer begins,
//          low byte first, or the bytes from the flash; CRC-32 of all before.
// model    tb/relay/relay_requests.py, equal in every bit of every cycle
// proved   the set and the flash receive bytes only from a good frame, and never while an answer is
//          sent; only a request clears a flag; a repeated request changes neither set nor flags
`default_nettype none

module relay_requests #(
    parameter int LONGEST = 64  // bytes of a body
) (
    input  wire               clk,
    input  wire               rst,
    // frames, from frame_check
    input  wire               valid,         // strobe: data is new
    input  wire        [ 7:0] data,          // byte of a frame
    input  wire               command,       // level: data is a command byte
    input  wire               good,          // strobe: data is the last byte of a good frame
    // status
    input  wire        [ 7:0] events,        // strobes or levels: each sets its flag
    input  wire        [ 7:0] levels,        // as in the header of relay
    input  wire        [ 1:0] source,        // as in relay_store
    input  wire        [ 5:0] orders,        // orders of harmonic_map; 0: a table
    input  wire        [31:0] identity,      // CRC-32 of the set in use
    input  wire        [31:0] position,      // counts
    input  wire signed [31:0] correction,    // 2^-16 count
    output logic       [ 7:0] flags,         // sticky events
    // set
    output logic              set_start,     // strobe: a set begins
    output logic              set_valid,     // strobe: set_data is new
    output logic       [ 7:0] set_data,      // byte of the set
    // flash, through relay_store
    output logic              pass_select,   // level: select the chip
    input  wire               pass_ready,    // level: the chip waits for a byte
    output logic              pass_valid,    // strobe: send set_data to the chip
    input  wire               pass_done,     // strobe: pass_data is new
    input  wire        [ 7:0] pass_data,     // byte of the chip
    // answer
    output logic              answer_valid,  // level: a byte of the answer waits
    input  wire               answer_ready,  // with answer_valid: taken in this cycle
    output logic       [ 7:0] answer         // byte of the answer
);
    if (LONGEST < 17 || LONGEST > 124) begin : g_check
        LONGEST_MUST_BE_FROM_17_TO_124 u_error ();
    end

    localparam int P = $clog2(LONGEST + 6);
    localparam logic [7:0] CLEAR = 8'd1, BEGIN_SET = 8'd2, SET = 8'd3, FLASH = 8'd4;
    localparam logic [7:0] REPLY = 8'h61;
    localparam int STATUS = 17;  // bytes of a status

    typedef enum logic [2:0] {
        LISTEN,
        READ,
        ACT,
        WAIT,
        FETCH,
        SPEAK
    } state_t;

    state_t       state;
    logic   [7:0] buffer[0:(1<<P)-1];  // the body from 0 up, then its CRC-32
    logic [7:0] read, sequence_q, kind;
    // byte of the body, or of the answer; bytes taken in; of the request
    logic [P-1:0] at, taken, length;
    logic [             1:0] tail;  // byte of the CRC-32
    logic [8*(STATUS-2)-1:0] status;
    // a frame has begun; there was a request; this one repeats it
    logic open, heard, again;
    logic closing;  // the CRC-32 is being sent
    logic sum_start, sum_valid;  // of the CRC-32, which is one cycle behind the answer
    logic [  7:0] answer_q;

    wire          keep = valid && !command && open;
    wire          flash = kind == FLASH;
    wire  [P-1:0] words = flash ? length : P'(STATUS);  // bytes of the answer's body
    wire          first = at == '0;
    wire          second = at == P'(1);
    wire          early = at < P'(4);  // in the answer, before flags
    wire          last = at + 1'b1 == length;
    wire          known = second ? read <= FLASH : kind <= FLASH;
    wire          sent = answer_valid && answer_ready;
    wire          passes = flash && !first && !second;
    wire  [ 31:0] crc;
    wire  [  7:0] crc_byte = crc[8*tail+:8];
    wire  [  7:0] body = flash || early ? read : status[7:0];

    assign answer_valid = state == SPEAK;
    assign answer       = first ? REPLY : second ? 8'(words) : closing ? crc_byte : body;

    crc32_stream u_crc (
        .clk,
        .rst,
        .start(sum_start),
        .valid(sum_valid),
        .data (answer_q),
        .crc
    );

    always_ff @(posedge clk) begin
        if (keep) buffer[taken-1'b1] <= data;
        else if (pass_done) buffer[at] <= pass_data;
        read <= buffer[state==FETCH||state==SPEAK?at-P'(2) : at];
    end

    always_ff @(posedge clk) begin
        set_start  <= 1'b0;
        set_valid  <= 1'b0;
        pass_valid <= 1'b0;
        flags      <= flags | events;
        sum_start  <= state == READ;
        sum_valid  <= sent && !closing;
        answer_q   <= answer;
        case (state)
            LISTEN: begin
                at      <= '0;
                closing <= 1'b0;
                tail    <= '0;
                if (valid) begin
                    taken <= command ? '0 : taken + 1'b1;
                    open  <= open || command;
                end
                if (keep && taken == '0) length <= P'(data);
                if (good && open) begin
                    open  <= 1'b0;
                    state <= READ;
                end
            end
            READ: state <= ACT;                     // the byte comes out of the buffer
            ACT: if (!passes || pass_ready) begin
                if (first) begin
                    sequence_q <= read;
                    again      <= heard && read == sequence_q;
                    heard      <= 1'b1;
                end else if (second) begin
                    kind        <= read;
                    set_start   <= read == BEGIN_SET && !again;
                    pass_select <= read == FLASH;
                end else begin
                    set_data   <= read;
                    set_valid  <= (kind == BEGIN_SET || kind == SET) && !again;
                    pass_valid <= flash;
                    if (kind == CLEAR && !again && at == P'(2)) flags <= (flags & ~read) | events;
                end
                if (passes) state <= WAIT;
                else begin
                    at    <= last ? '0 : at + 1'b1;
                    state <= !last ? READ : first || !known ? LISTEN : FETCH;
                end
            end
            WAIT:
                if (pass_done) begin
                    at    <= last ? '0 : at + 1'b1;
                    state <= last ? FETCH : READ;
                end
            FETCH: begin
                pass_select <= 1'b0;
                state       <= SPEAK;
            end
            SPEAK:
                if (sent) begin
                    if (first)
                        status <= {correction, position, identity, orders, source, levels, flags};
                    else if (!early) status <= status >> 8;
                    if (!closing) at <= at + 1'b1;
                    else tail <= tail + 1'b1;
                    if (at == words + P'(1)) closing <= 1'b1;
                    state <= closing && tail == 2'd3 ? LISTEN : FETCH;
                end
            default: state <= LISTEN;  // unreachable: state has one of its six values
        endcase
        if (rst) begin
            state       <= LISTEN;
            open        <= 1'b0;
            heard       <= 1'b0;
            flags       <= '0;
            pass_select <= 1'b0;
            set_start   <= 1'b0;
            set_valid   <= 1'b0;
            pass_valid  <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic asked;  // a good frame came, its answer is not sent yet
    wire  ends = state == SPEAK && sent && closing && tail == 2'd3;
    always @(posedge clk) begin
        past  <= 1'b1;
        asked <= !rst && (state == LISTEN ? good && open : !ends);
        if (!past) assume (rst);
        assume (!good || (valid && !command && taken != '0));  // so does frame_check
        if (keep && taken == '0) assume (data != 8'd0 && data <= 8'(LONGEST));
        if (past && !$past(rst)) begin
            assert (state <= SPEAK);
            assert (asked || state == LISTEN);
            assert (!open || state == LISTEN);
            if (state != LISTEN || (open && taken != '0))
                assert (length != '0 && length <= P'(LONGEST));
            if (state == READ || state == ACT || state == WAIT) assert (at < length);
            if (state == WAIT) assert (flash && at >= P'(2));
            if (set_start || set_valid || pass_valid) assert ($past(state) == ACT && $past(asked));
            if ((set_start || set_valid) && $past(state) == ACT) assert (!again);
            if (pass_valid) assert (pass_select && $past(pass_ready));
            if (pass_select) assert (kind == FLASH && (state == FETCH || at >= P'(2)));
            if (flash && at >= P'(2) && (state == READ || state == ACT || state == WAIT))
                assert (pass_select);
            if (pass_select)
                assert (state == READ || state == ACT || state == WAIT || state == FETCH);
            if (($past(flags) & ~flags) != 0) assert ($past(state) == ACT && !again);
            cover (answer_valid && second);
            cover (set_valid && $past(set_start, 2));
            cover (flags == 0 && $past(flags) == 8'h0F);
        end
    end
`endif
endmodule

`default_nettype wire
