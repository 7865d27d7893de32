// SPDX-License-Identifier: Apache-2.0
// uart_rx -- receive the characters of a UART: start bit, 8 data bits LSB first, a 9th bit if there
// is one, stop bit.
//
// latency   2 cycles at most between valid and the middle of the stop bit; valid comes 1/PARTS bit
//           later if the first two samples of the stop bit differ.
// rate      characters without any gap
// method    Each bit is the majority of three samples, 1/PARTS bit apart, around its middle. The
//           stop bit is decided as soon as two samples agree, so that the start bit of a faster
//           sender is not missed.
// behaviour data and ninth stay as they are for two bit times from valid on.
// limits    bit_time from PARTS cycles up; as many are added to less. From 16 cycles up the two
//           ends may differ by 3.8 % of the bit time.
// source    S0: the 9th bit marks command bytes
// model     tb/serial/uart_rx.py, equal in every bit of every cycle
// proved    A start bit ends once: as a character, as a framing error, or as a glitch.
`default_nettype none

module uart_rx #(
    parameter int NINTH = 1,  // bits after the 8 data bits: 1, or 0 for 8N1
    parameter int PARTS = 8   // ticks of a bit: 8, or 4 for bits of less than 8 cycles
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [19:0] bit_time,       // 1/16 cycle
    input  wire         rx,             // level: the line, synchronous to clk; idles high
    output logic        valid,          // strobe: a character with a stop bit
    output logic [ 7:0] data,           // 8 data bits of the character
    output logic        ninth,          // level: the 9th bit; 0 without one
    output logic        framing_error,  // strobe: there was no stop bit
    output logic        start_glitch,   // strobe: high again in the middle of the start bit
    output logic        busy            // level: a character is being received
);
    if (NINTH != 0 && NINTH != 1) begin : g_check
        NINTH_MUST_BE_0_OR_1 u_error ();
    end

    localparam int L = $clog2(PARTS);
    localparam logic [3:0] STOP = NINTH != 0 ? 4'd10 : 4'd9;

    typedef enum logic [1:0] {
        IDLE,
        RECEIVE,
        RELEASE
    } state_t;

    state_t             state;
    logic               rx_q;  // the level that is sampled: the edge is half a cycle old on average
    logic   [      1:0] seen;  // the two samples before
    // parts of a bit since the start bit began, and half a bit less one part more: the last sample
    // of bit n is in its last part
    logic   [    L+3:0] part;
    logic   [7+NINTH:0] shifted;
    wire                tick;

    // number of the bit: 0 start, 1..8 data, 9 ninth, STOP
    wire    [      3:0] bit_number = part[L+3:L];
    wire                first = bit_number == 4'd0;
    wire                last = bit_number == STOP;
    wire                agreed = part[L-1:0] == L'(PARTS - 2) && seen[0] == rx_q;
    wire                decide = state == RECEIVE && tick && (&part[L-1:0] || (last && agreed));
    wire                level = (seen[0] & seen[1]) | (seen[0] & rx_q) | (seen[1] & rx_q);

    assign busy  = state != IDLE;
    assign data  = shifted[7:0];
    assign ninth = NINTH != 0 && shifted[7+NINTH];

    bit_timer #(
        .PARTS(PARTS)
    ) u_timer (
        .clk,
        .bit_time,
        .restart(state == IDLE),
        .tick
    );

    always_ff @(posedge clk) begin
        valid         <= decide && last && level;
        framing_error <= decide && last && !level;
        start_glitch  <= decide && first && level;

        if (state == IDLE) part <= (L + 4)'(PARTS / 2 - 1);
        else if (tick) part <= part + 1'b1;
        rx_q <= rx;
        if (tick) seen <= {seen[0], rx_q};
        if (decide && !first && !last) shifted <= {level, shifted[7+NINTH:1]};

        case (state)
            IDLE: if (!rx) state <= RECEIVE;
            RECEIVE:
                if (decide && first && level) state <= IDLE;
                else if (decide && last)      state <= level ? IDLE : RELEASE;
            RELEASE:  // the line must be high before the next character
                if (rx) state <= IDLE;
            default:  // unreachable: state has one of its three values
                state <= IDLE;
        endcase
        if (rst) begin
            state         <= RELEASE;
            valid         <= 1'b0;
            framing_error <= 1'b0;
            start_glitch  <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            assert (state == IDLE || state == RECEIVE || state == RELEASE);
            assert (valid + framing_error + start_glitch <= 1);
            if (state == RECEIVE) assert (bit_number <= STOP);
            if (start_glitch) assert (!busy);
            cover (start_glitch);
        end
    end
`endif
endmodule

`default_nettype wire
