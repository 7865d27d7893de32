// SPDX-License-Identifier: Apache-2.0
// uart_rx -- receive the characters of a UART: start bit, 8 data bits LSB first, a 9th bit if there
// is one, stop bit.
//
// latency   2 cycles at most between valid and the middle of the stop bit; valid comes 1/16 bit
//           later if the first two samples of the stop bit differ.
// rate      characters without any gap
// method    Each bit is the majority of three samples, 1/16 bit apart, around its middle. The stop
//           bit is decided as soon as two samples agree, so that the start bit of a faster sender
//           is not missed.
// limits    bit_time from 8 cycles up; less counts as 8. From 16 cycles up the two ends may differ
//           by 4 % of the bit time.
// source    S0: the 9th bit marks command bytes
// model     tb/serial/uart_rx.py, equal in every bit of every cycle
// proved    A start bit ends once: as a character, as a framing error, or as a glitch.
`default_nettype none

module uart_rx #(
    parameter int NINTH = 1  // bits after the 8 data bits: 1, or 0 for 8N1
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

    localparam logic [3:0] STOP = NINTH != 0 ? 4'd10 : 4'd9;

    typedef enum logic [1:0] {
        IDLE,
        RECEIVE,
        RELEASE
    } state_t;

    state_t        state;
    logic   [19:0] left;  // 1/16 cycle until the next sample
    logic   [ 1:0] sample;  // number within the bit: 0, 1, 2
    logic   [ 1:0] seen;  // samples 0 and 1
    // number of the bit: 0 start, 1..8 data, 9 ninth, STOP
    logic   [ 3:0] bit_number;
    logic   [ 8:0] shifted;

    wire    [19:0] whole = |bit_time[19:7] ? bit_time : 20'd128;
    // between samples: 1/16 bit, at least 1 cycle
    wire    [19:0] spread = |whole[19:8] ? {4'd0, whole[19:4]} : 20'd16;
    wire           now = left < 20'd16;
    wire           first = bit_number == 4'd0;
    wire           last = bit_number == STOP;
    wire           agreed = sample == 2'd1 && seen[0] == rx;
    wire           decide = state == RECEIVE && now && (sample == 2'd2 || (last && agreed));
    wire           level = agreed ? rx : (seen[0] & seen[1]) | (seen[0] & rx) | (seen[1] & rx);

    assign busy = state != IDLE;

    always_ff @(posedge clk) begin
        valid         <= decide && last && level;
        framing_error <= decide && last && !level;
        start_glitch  <= decide && first && level;

        // 24: rounding, and the edge is half a cycle old on average
        if (state == IDLE) left <= {1'b0, whole[19:1]} - spread - 20'd24;
        else if (!now) left <= left - 20'd16;
        else left <= left - 20'd16 + (sample == 2'd2 ? whole - {spread[18:0], 1'b0} : spread);

        if (state != RECEIVE) sample <= 2'd0;
        else if (now) begin
            sample <= sample == 2'd2 ? 2'd0 : sample + 1'b1;
            seen   <= {seen[0], rx};
        end

        if (decide) begin
            bit_number <= bit_number + 1'b1;
            shifted    <= {level, shifted[8:1]};
            if (last) {ninth, data} <= NINTH != 0 ? shifted : {1'b0, shifted[8:1]};
        end

        case (state)
            IDLE: begin
                bit_number <= 4'd0;
                if (!rx) state <= RECEIVE;
            end
            RECEIVE:
                if (decide && first && level) state <= IDLE;
                else if (decide && last)      state <= level ? IDLE : RELEASE;
            RELEASE:  // the line must be high before the next character
                if (rx) state <= IDLE;
            default:
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
            if (state == RECEIVE) assert (bit_number <= STOP && sample <= 2'd2);
            if (start_glitch) assert (!busy);
            cover (start_glitch);
        end
    end
`endif
endmodule

`default_nettype wire
