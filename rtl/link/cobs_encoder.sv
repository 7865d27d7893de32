// SPDX-License-Identifier: Apache-2.0
// cobs_encoder -- make of each packet a row of bytes for a serial line: a zero, the packet without
// zeros by consistent overhead byte stuffing (COBS), and a zero.
//
// latency   2 cycles from what ends a block to its first byte on an idle line. A zero ends a block,
//           the byte after 254 others does, and the cycle after the last byte; so does the start of
//           a packet, for the zero in front of it.
// rate      one byte per cycle from the packet, and 1 cycle more per packet and per 254 bytes
//           without a zero, until the memory is full; a byte to the line in 2 cycles
// behaviour The memory takes a block before its length, which comes first on the line, is known. It
//           holds the longest block and goes on with the next one while the line takes its time.
// source    Cheshire and Baker, Consistent Overhead Byte Stuffing, 1999
// model     tb/link/cobs_encoder.py, equal in every bit of every cycle
// proved    Each byte that the line is given stays until it is taken. No byte is given that is not
//           complete, and none is overwritten before it is taken.
// proof     depth 6, A = 9
`default_nettype none

module cobs_encoder #(
    parameter int A = 9  // bits of an address of the memory: 2^A bytes, more than 256
) (
    input  wire        clk,
    input  wire        rst,
    // packet
    input  wire        valid,     // level: data is a byte of a packet
    input  wire  [7:0] data,      // byte
    input  wire        last,      // level: with valid, the last byte
    output logic       taken,     // level: with valid, the byte is taken in this cycle
    // line
    output logic       sends,     // level: data_out is to be sent
    output logic [7:0] data_out,  // byte
    input  wire        ready,     // level: with sends, the byte is taken in this cycle
    output logic       busy       // level: a byte has not been taken, or a packet not ended
);
    if (A < 9) begin : g_check
        A_MUST_BE_9_OR_MORE u_error ();
    end

    typedef enum logic [1:0] {
        IDLE,
        BLOCK,  // bytes of a block are stored
        CODE,   // the packet has ended: the last block gets its code
        ENDS    // and the zero behind it
    } state_t;

    (* no_rw_check *) logic [7:0] memory[0:2**A-1];
    state_t state;
    logic [A-1:0] next;  // where the next byte goes
    logic [A-1:0] code_at;  // where the code of the block goes; all before it is complete
    logic [7:0] code;  // bytes of the block and its code
    logic [A-1:0] sent;  // bytes before it have been taken
    logic fetched;  // data_out is the byte at sent

    wire room = next - sent < A'(2 ** A - 3);
    wire full = code == '1;
    wire begins = state == IDLE && valid && room;
    wire flows = state == BLOCK && valid && room;
    wire zero = data == '0;
    wire closes = (flows && (full || zero)) || state == CODE;  // the code is stored

    assign taken = flows && !full;
    assign sends = fetched;
    assign busy  = state != IDLE || sent != code_at;

    always_ff @(posedge clk) begin
        if (begins || flows || state == CODE || state == ENDS)
            memory[closes?code_at : next] <= closes ? code : state == BLOCK ? data : '0;
        data_out <= memory[sent];
    end

    always_ff @(posedge clk) begin
        fetched <= sent != code_at && !(fetched && ready);
        if (fetched && ready) sent <= sent + 1'b1;
        case (state)
            IDLE:
            if (begins) begin
                code_at <= next + 1'b1;
                next    <= next + A'(2);
                code    <= 8'd1;
                state   <= BLOCK;
            end
            BLOCK:
            if (flows) begin
                if (closes) code_at <= next;
                code <= closes ? 8'd1 : code + 8'd1;
                next <= next + 1'b1;
                if (taken && last) state <= CODE;
            end
            CODE: begin
                code_at <= next;
                state   <= ENDS;
            end
            default: begin  // ENDS
                code_at <= next + 1'b1;
                next    <= next + 1'b1;
                state   <= IDLE;
            end
        endcase
        if (rst) begin
            state   <= IDLE;
            next    <= '0;
            code_at <= '0;
            sent    <= '0;
            fetched <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if ($past(sends && !ready)) assert (sends && $stable(data_out));
            if (sends) assert (sent != code_at && data_out == memory[sent]);
            // bytes that wait, those of the open block, and the block's code
            assert (A'(next - sent) <= A'(2 ** A - 2));
            assert (A'(code_at - sent) <= A'(next - sent));
            if (state == IDLE || state == ENDS) assert (code_at == next);
            if (state == BLOCK || state == CODE)
                assert (A'(next - code_at) == A'(code) && code != '0);
            cover (state == ENDS);
        end
    end
`endif
endmodule

`default_nettype wire
