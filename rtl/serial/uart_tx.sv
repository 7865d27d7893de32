// SPDX-License-Identifier: Apache-2.0
// uart_tx -- send the characters of a UART on a shared line: start bit, 8 data bits LSB first, a
// 9th bit if there is one, stop bit.
//
// latency   1 cycle from valid to driver_enable when idle; the start bit follows a bit and a part
//           later.
// rate      characters without any gap
// method    Bit n begins PARTS * n ticks of bit_timer after the start bit, so that rounding errors
//           never add up.
// behaviour driver_enable leads the first start bit by at least one bit, and follows the last stop
//           bit by at least half a bit: by one part of a bit more each, since a tick may come a
//           cycle early.
// limits    bit_time from PARTS cycles up; as many are added to less.
// source    S0: the 9th bit marks command bytes
// model     tb/serial/uart_tx.py, equal in every bit of every cycle
// proved    The line is high whenever it is not driven.
`default_nettype none

module uart_tx #(
    parameter int NINTH = 1,  // bits after the 8 data bits: 1, or 0 for 8N1
    parameter int PARTS = 8   // ticks of a bit: 8, or 4 for bits of less than 8 cycles
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
    output logic        busy,           // level: the line is driven
    output logic        tick            // strobe: a part of a bit; PARTS per bit while busy
);
    if (NINTH != 0 && NINTH != 1) begin : g_check
        NINTH_MUST_BE_0_OR_1 u_error ();
    end

    localparam int L = $clog2(PARTS);
    localparam logic [3:0] STOP = NINTH != 0 ? 4'd10 : 4'd9;

    typedef enum logic [1:0] {
        IDLE,
        LEAD,
        SEND,
        TRAIL
    } state_t;

    state_t         state;
    logic   [  3:0] number;  // of the bit: 0 start, 1..8 data, 9 ninth, STOP; before them -2 and -1
    logic   [L-1:0] part;  // of the bit
    logic   [  8:0] shifted;  // the bits to come, the next one lowest

    wire            ends = tick && &part;
    wire            begins = state == LEAD && ends && number[0];
    wire            goes_on = state == SEND && ends && number == STOP;
    wire            take = valid && ready;

    assign ready         = begins || goes_on || state == TRAIL;
    assign driver_enable = state != IDLE;
    assign busy          = state != IDLE;

    bit_timer #(
        .PARTS(PARTS)
    ) u_timer (
        .clk,
        .bit_time,
        .restart(state == IDLE || (state == TRAIL && valid)),
        .tick
    );

    always_ff @(posedge clk) begin
        if (state == IDLE) {number, part} <= {4'd14, {L{1'b1}}};
        else if (take) {number, part} <= '0;
        else if (tick) {number, part} <= {number, part} + 1'b1;

        if (take) begin
            tx      <= 1'b0;
            shifted <= {NINTH == 0 || ninth, data};
        end else if (state == SEND && ends) {shifted, tx} <= {1'b1, shifted};

        case (state)
            IDLE:    if (valid)          state <= LEAD;
            LEAD:    if (ready)           state <= valid ? SEND : TRAIL;
            SEND:    if (ready && !valid) state <= TRAIL;
            TRAIL:   if (valid)           state <= SEND;
                     else if (tick && part == L'(PARTS / 2)) state <= IDLE;
            default:  // unreachable: state has one of its four values
                state <= IDLE;
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
            if (state == LEAD) assert (number >= 4'd14);
            if (state == SEND) assert (number <= STOP);
            // behind the bits that are left there are ones
            for (int n = 0; n < 9; n++)
            if (state == SEND && n + int'(number) >= 8 + NINTH) assert (shifted[n]);
            if (state == SEND && number == STOP) assert (tx);
            cover (state == SEND);
        end
    end
`endif
endmodule

`default_nettype wire
