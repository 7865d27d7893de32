// SPDX-License-Identifier: Apache-2.0
// uart_tx -- send the characters of a UART on a shared line: start bit, 8 data bits LSB first, a
// 9th bit if there is one, stop bit.
//
// latency   1 cycle from valid to driver_enable when idle; the start bit follows one bit time
//           later.
// rate      characters without any gap
// method    Bit n begins in the cycle at or before n * bit_time, so that rounding errors never add
//           up.
// behaviour driver_enable leads the first start bit by at least one bit, and follows the last stop
//           bit by at least half a bit.
// limits    bit_time from 8 cycles up; less counts as 8.
// source    S0: the 9th bit marks command bytes
// model     tb/serial/uart_tx.py, equal in every bit of every cycle
// proved    The line is high whenever it is not driven.
`default_nettype none

module uart_tx #(
    parameter int NINTH = 1  // bits after the 8 data bits: 1, or 0 for 8N1
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [19:0] bit_time,       // 1/16 cycle
    input  wire         valid,          // level: data and ninth are a character to be sent
    output logic        ready,          // level: with valid, the character is taken in this cycle
    input  wire  [ 7:0] data,           // 8 data bits of the character
    input  wire         ninth,          // level: the 9th bit; unused without one
    output logic        tx,             // level: the line, idles high
    output logic        driver_enable,  // level: the line driver is on
    output logic        busy            // level: the line is driven
);
    if (NINTH != 0 && NINTH != 1) begin : g_check
        NINTH_MUST_BE_0_OR_1 u_error ();
    end

    localparam logic [3:0] STOP = NINTH != 0 ? 4'd10 : 4'd9;

    typedef enum logic [1:0] {
        IDLE,
        LEAD,
        SEND,
        TRAIL
    } state_t;

    state_t        state;
    logic   [19:0] left;  // 1/16 cycle until the next bit
    logic   [ 3:0] to_come;  // bits after this one
    logic   [ 9:0] shifted;  // the bits to come, the next one lowest

    wire    [19:0] whole = |bit_time[19:7] ? bit_time : 20'd128;
    // Less than a cycle is left: the bit ends. A flip-flop, since it decides about the next
    // character; a new bit is always longer than a cycle.
    logic          now;

    wire           begins = state == LEAD && now;
    wire           goes_on = state == SEND && now && to_come == 4'd0;

    assign ready         = begins || goes_on || state == TRAIL;
    assign driver_enable = state != IDLE;
    assign busy          = state != IDLE;

    always_ff @(posedge clk) begin
        // rounded up, so that the lead is at least one bit
        if (state == IDLE) left <= whole - 20'd1;
        else if (!now) left <= left - 20'd16;
        else if (state == SEND && ready)
            left <= valid ? left - 20'd16 + whole : left + {1'b0, whole[19:1]};
        else left <= left - 20'd16 + whole;
        now <= state != IDLE && !now && left < 20'd32 && !(state == TRAIL && valid);

        if (valid && ready) begin
            tx      <= 1'b0;
            to_come <= STOP;
            shifted <= {1'b1, NINTH != 0 ? ninth : 1'b1, data};
            if (state == TRAIL) left <= whole - 20'd16;
        end else if (state == SEND && now) begin
            tx      <= to_come == 4'd0 || shifted[0];
            to_come <= to_come - 1'b1;
            shifted <= {1'b1, shifted[9:1]};
        end

        case (state)
            IDLE:    if (valid)          state <= LEAD;
            LEAD:    if (now)            state <= valid ? SEND : TRAIL;
            SEND:    if (ready && !valid) state <= TRAIL;
            TRAIL:   if (valid)          state <= SEND;
                     else if (now)       state <= IDLE;
            default:                     state <= IDLE;
        endcase
        if (rst) begin
            state <= IDLE;
            tx    <= 1'b1;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (!driver_enable) assert (tx);
            if (state != SEND) assert (tx);
            if (state == SEND) assert (to_come <= STOP);
            if (state != IDLE) assert (now == (left < 20'd16));
            cover (state == SEND);
        end
    end
`endif
endmodule

`default_nettype wire
