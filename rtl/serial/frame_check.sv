// SPDX-License-Identifier: Apache-2.0
// frame_check -- watch the words for this node and report which frames are good and which are
// broken.
//
// latency   9 cycles from a word at the input to valid, `good` and the end of a frame, 10 to sync
// rate      one word in 10 cycles; data and command must stay as they are from valid_in to valid
// method    The CRC-32 of command, length and body is made bit by bit and compared with the four
//           bytes after them.
// behaviour After a command byte `00 10 address` a frame has a length (1..LONGEST), a body, and the
//           CRC-32 of command, length and body, low byte first. Words pass while a frame is
//           expected or being received. After its end, after `00 01 address`, which has no frame,
//           and after a broken frame, data words are dropped until the next command byte: if the
//           command byte of another node is lost, its data must not fill the queue.
// source    S0: the frames of the RS-485 bus
// model     tb/serial/frame_check.py, equal in every bit of every cycle
// proved    Each frame ends once: as good, as bad, or unfinished. `good` comes only with the byte
//           that the length names.
// proof     depth 14
`default_nettype none

module frame_check #(
    parameter int LONGEST = 64  // bytes, longest body
) (
    input  wire        clk,
    input  wire        rst,
    input  wire        valid_in,       // strobe: data and command are a word, from address_filter
    input  wire  [7:0] data,           // 8 data bits of the word
    input  wire        command,        // level: a command byte of this node
    input  wire        framing_error,  // strobe: a character was lost before this word
    output logic       valid,          // strobe: data and command are a word that passed
    output logic       good,           // level: a good frame ends with this word; with valid
    output logic       frame_good,     // strobe: length and CRC-32 of a frame are right
    output logic       frame_bad,      // strobe: wrong length, wrong CRC-32, or interrupted
    output logic       sync            // strobe: a good frame that is for all nodes
);
    if (LONGEST < 1 || LONGEST > 124) begin : g_check
        LONGEST_MUST_BE_FROM_1_TO_124 u_error ();
    end

    typedef enum logic [1:0] {
        IDLE,
        LENGTH,
        BODY,
        CRC
    } state_t;

    state_t       state;
    logic   [6:0] left;  // bytes of the body still to come; 0, -1, -2, -3: of the CRC-32
    logic         passes;  // the word passes
    logic         checked;  // the word is a byte of the CRC-32
    logic         ended;  // the word is the last byte of a frame
    logic         broken;  // the frame was interrupted or has a wrong length
    logic         to_all;  // the command byte has address 0
    wire          done;  // the CRC-32 has taken in the word
    wire          wrong;  // a byte of the CRC-32 is

    wire          call = valid_in && command;
    wire          word = valid_in && !command && state != IDLE && !framing_error;
    wire          interrupted = state != IDLE && (framing_error || call);
    wire          misfit = data == 8'd0 || data > 8'(LONGEST);
    wire          last = state == CRC && left[1:0] == 2'b01;

    /* verilator lint_off PINCONNECTEMPTY */
    crc32_serial u_crc (
        .clk,
        .rst,
        .start(call),
        .valid(valid_in),
        .data,
        .check(checked),
        .busy (),
        .done,
        .wrong,
        .crc  ()
    );
    /* verilator lint_on PINCONNECTEMPTY */

    assign valid      = done && passes;
    assign good       = ended && !wrong;
    assign frame_good = valid && good;
    assign frame_bad  = broken || (valid && ended && wrong);

    always_ff @(posedge clk) begin
        if (valid_in) begin
            passes  <= call || word;
            checked <= state == CRC && !command;
            ended   <= word && last;
        end
        broken <= interrupted || (word && state == LENGTH && misfit);
        sync   <= frame_good && to_all && !rst;

        if (call) to_all <= data[3:0] == 4'd0;
        if (call) state <= data[5] ? LENGTH : IDLE;
        else if (framing_error) state <= IDLE;
        else if (word && state == LENGTH) begin
            state <= misfit ? IDLE : BODY;
            left  <= data[6:0];
        end else if (word) begin
            if (last) state <= IDLE;
            else if (left == 7'd1) state <= CRC;
            left <= left - 7'd1;
        end
        if (rst) begin
            state  <= IDLE;
            passes <= 1'b0;
            broken <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic       running;  // a frame has begun and not ended
    logic [7:0] taken;  // its data words so far
    logic [7:0] length;  // of its body
    logic       open;  // a frame has begun, whose end has not been reported
    logic [3:0] since;  // cycles since the last word, at most 15
    wire  [7:0] of_crc = taken - length - 8'd1;  // bytes of the CRC-32 so far
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) assume (!rst);
        since <= valid_in ? 4'd1 : since + 4'(since != 4'd15);
        if (rst) since <= 4'd15;
        if (past && since < 4'd10)
            assume (!valid_in && !framing_error && data == $past(
                data
            ) && command == $past(
                command
            ));
        if (rst) running <= 1'b0;
        else if (call) running <= data[5];
        else if (framing_error) running <= 1'b0;
        else if (word && (taken == 0 ? misfit : taken == length + 8'd4)) running <= 1'b0;
        if (call) taken <= 8'd0;
        else if (word) taken <= taken + 1'b1;
        if (word && taken == 0) length <= data;
        if (rst || frame_good || (frame_bad && !running)) open <= 1'b0;
        if (call && data[5] && !rst) open <= 1'b1;
        if (past && !$past(rst)) begin
            assert (running == (state != IDLE));
            if (running) assert ((taken == 0) == (state == LENGTH));
            if (state == BODY || state == CRC) assert (length >= 1 && length <= 8'(LONGEST));
            if (state == BODY) assert (taken >= 1 && {1'b0, left} + taken == length + 8'd1);
            if (state == BODY) assert (left != 0 && taken <= length);
            if (state == CRC) assert (of_crc <= 8'd3 && left == 7'd0 - of_crc[6:0]);
            if (ended && passes && since < 4'd10)
                assert (!running && taken == length + 8'd5 && !command);
            assert (done == (since == 4'd9));
            if (good && valid) assert (ended && !running);
            assert (!(frame_good && frame_bad));
            assert (sync == $past(frame_good && to_all));
            if (frame_good || frame_bad) assert (open);
            if (running) assert (open);
            if (open) assert (running || broken || (ended && passes && since <= 4'd9));
            cover (valid && command);
            cover (broken);
        end
    end
`endif
endmodule

`default_nettype wire
