// SPDX-License-Identifier: Apache-2.0
// frame_check -- watch the words for this node and report which frames are good and which are
// broken.
//
// latency   1 cycle from a word at the input to the word at the output; `good` comes with the last
//           byte.
// rate      one word per cycle
// method    The CRC-32 of a frame together with its own CRC-32 leaves a constant remainder if all
//           bits are right.
// behaviour After a command byte `00 10 address` a frame has a length (1..LONGEST), a body, and the
//           CRC-32 of command, length and body, low byte first. Words pass while a frame is
//           expected or being received. After its end, after `00 01 address`, which has no frame,
//           and after a broken frame, data words are dropped until the next command byte: if the
//           command byte of another node is lost, its data must not fill the queue.
// source    S0: the frames of the RS-485 bus
// model     tb/serial/frame_check.py, equal in every bit of every cycle
// proved    Each frame ends once: as good, as bad, or unfinished. `good` comes only with the byte
//           that the length names, and only if all 32 bits of the remainder are right.
`default_nettype none

module frame_check #(
    parameter int LONGEST = 64  // bytes, longest body
) (
    input  wire        clk,
    input  wire        rst,
    input  wire        valid_in,       // strobe: a word from the address filter
    input  wire  [7:0] data_in,        // 8 data bits of the word
    input  wire        command_in,     // level: a command byte of this node; with valid_in
    input  wire        framing_error,  // strobe: a character was lost before this word
    output logic       valid,          // strobe: data and command are a word that passed
    output logic [7:0] data,           // 8 data bits of the word
    output logic       command,        // level: a command byte of this node; with valid
    output logic       good,           // level: a good frame ends with this word; with valid
    output logic       frame_good,     // strobe: length and CRC-32 of a frame are right
    output logic       frame_bad,      // strobe: wrong length, wrong CRC-32, or interrupted
    output logic       sync            // strobe: a good frame that is for all nodes
);
    if (LONGEST < 1 || LONGEST > 124) begin : g_check
        LONGEST_MUST_BE_FROM_1_TO_124 u_error ();
    end

    localparam logic [31:0] WHOLE = 32'h2144DF1C;  // CRC-32 of anything followed by its own CRC-32

    typedef enum logic [1:0] {
        IDLE,
        LENGTH,
        PAYLOAD
    } state_t;

    state_t        state;
    logic   [ 6:0] left;  // bytes of body and CRC-32 still to come, less 1
    logic          ended;  // data is the last byte of a payload
    logic          broken;  // the frame was interrupted or has a wrong length
    logic          to_all;  // the command byte has address 0
    wire    [31:0] crc;

    wire           listening = state != IDLE && !framing_error;
    wire           call = valid_in && command_in;
    wire           word = valid_in && !command_in && listening;
    wire           interrupted = state != IDLE && (framing_error || call);
    wire           misfit = data_in == 8'd0 || data_in > 8'(LONGEST);

    crc32_stream u_crc (
        .clk,
        .rst,
        .start(call),
        .valid(valid_in),
        .data (data_in),
        .crc
    );

    assign good       = ended && crc == WHOLE;
    assign frame_good = good;
    assign sync       = good && to_all;
    assign frame_bad  = broken || (ended && !good);

    always_ff @(posedge clk) begin
        valid   <= call || word;
        data    <= data_in;
        command <= command_in;
        ended   <= word && state == PAYLOAD && left == 7'd0;
        broken  <= interrupted || (word && state == LENGTH && misfit);

        if (call) to_all <= data_in[3:0] == 4'd0;
        if (call) state <= data_in[5] ? LENGTH : IDLE;
        else if (framing_error) state <= IDLE;
        else if (word && state == LENGTH) begin
            state <= misfit ? IDLE : PAYLOAD;
            left  <= data_in[6:0] + 7'd3;
        end else if (word) begin
            if (left == 7'd0) state <= IDLE;
            left <= left - 1'b1;
        end
        if (rst) begin
            state  <= IDLE;
            valid  <= 1'b0;
            ended  <= 1'b0;
            broken <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic       running;  // a frame has begun and not ended
    logic [7:0] taken;  // its data words so far
    logic [7:0] length;  // of its body
    wire        last = taken == length + 8'd4;  // of its data words
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst) running <= 1'b0;
        else if (call) running <= data_in[5];
        else if (framing_error) running <= 1'b0;
        else if (word && (taken == 0 ? misfit : last)) running <= 1'b0;
        if (call) taken <= 8'd0;
        else if (word) taken <= taken + 1'b1;
        if (word && taken == 0) length <= data_in;
        if (past && !$past(rst)) begin
            assert (state == IDLE || state == LENGTH || state == PAYLOAD);
            assert (running == (state != IDLE));
            if (running) assert ((taken == 0) == (state == LENGTH));
            if (state == PAYLOAD) assert (length >= 1 && length <= 8'(LONGEST));
            if (state == PAYLOAD)
                assert (taken <= length + 8'd4 && taken + {1'b0, left} == length + 8'd4);
            assert (!(frame_good && frame_bad));
            assert (frame_good == (ended && crc == 32'h2144DF1C));  // all 32 bits
            if (good) assert (valid && !command && taken == length + 8'd5);
            if (frame_good) assert ($past(running) && !running);
            if (sync) assert (frame_good && to_all);
            if (frame_bad) assert ($past(running));
            if ($past(running) && !running) assert (frame_good || frame_bad);
            cover (frame_good);
            cover (frame_bad && ended);
            cover (broken && command);
        end
    end
`endif
endmodule

`default_nettype wire
