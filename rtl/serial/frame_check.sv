// SPDX-License-Identifier: Apache-2.0
// frame_check -- watch the words for this node and tell whole payloads from broken ones.
//
// latency  1 clk, `good` comes with the last byte
// rate     one word per clk
// source   after a command byte `00 10 address`: length (1..LONGEST), body, CRC-32 over command,
//          length and body, low byte first. Taking the CRC in as well leaves a constant remainder
//          behind when all is right
// model    tb/serial/frame_check.py, equal in every bit of every cycle
// proved   each frame ends once: good, bad or unfinished; `good` only on the byte where its length
//          says, and only if all 32 bits of the remainder are right
//
// Words pass while a payload is awaited or runs. After its end, after `00 01 address`, which has
// none, and after a broken
// one, data words are dropped until the next command byte: a lost command byte of another node must
// not fill the queue.
`default_nettype none

module frame_check #(
    parameter int LONGEST = 64  // bytes of a body
) (
    input wire clk,
    input wire rst,
    input wire valid_in,  // strobe, after the address filter
    input wire [7:0] data_in,
    input wire command_in,  // a command byte of this node
    input wire framing_error,  // strobe: a character was lost; comes before a word of the same clk
    output logic valid,  // strobe
    output logic [7:0] data,
    output logic command,
    output logic good,  // with valid: length and CRC-32 of the frame that ends here are right
    output logic frame_good,  // strobe: the same
    output logic frame_bad,  // strobe: wrong length, wrong CRC-32, or interrupted
    output logic sync  // strobe: a good one that is for all nodes
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
    logic          broken;
    logic          to_all;  // the command byte had address 0
    wire    [31:0] crc;

    wire           listening = state != IDLE && !framing_error;
    wire           call = valid_in && command_in;
    wire           word = valid_in && !command_in && listening;
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
        broken  <= (state != IDLE && (framing_error || call)) || (word && state == LENGTH && misfit);

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
    logic       running;  // a payload was called for and has not ended
    logic [7:0] taken;  // data words of it so far
    logic [7:0] length;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst) running <= 1'b0;
        else if (call) running <= data_in[5];
        else if (framing_error) running <= 1'b0;
        else if (word && (taken == 0 ? misfit : taken == length + 8'd4)) running <= 1'b0;
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
            assert (frame_good == (ended && crc == 32'h2144DF1C));  // all bits of it
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
