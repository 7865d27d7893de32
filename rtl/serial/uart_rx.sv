// SPDX-License-Identifier: Apache-2.0
// uart_rx -- characters of a UART: start, 8 data bits LSB first, 9th bit if there is one, stop.
//
// latency  valid comes within 2 clk of the middle of the stop bit; 1/16 bit later if its first two
//          samples differ
// rate     characters without any gap
// source   S0: the 9th bit syncs command bytes. Each bit is the majority of three samples 1/16 bit
//          apart around its middle; the stop bit is decided as soon as two agree, so that the start
//          bit of a faster sender is not met late
// model    tb/serial/uart_rx.py, equal in every bit of every cycle
// proved   a start ends once: as a character, a framing error or a glitch
// bounds   from bit_time = 8 clk up (less counts as 8); from 16 clk up the two ends may differ by 4
//          % of the bit time
`default_nettype none

module uart_rx #(
    parameter int NINTH = 1  // 0: without the 9th bit, 8N1
) (
    input wire clk,
    input wire rst,  // drops the character in flight
    input wire [19:0] bit_time,  // 1/16 clk
    input wire rx,  // level, synchronous to clk, idles high
    output logic valid,  // strobe: a character with a stop bit
    output logic [7:0] data,
    output logic ninth,  // the 9th bit; 0 without one
    output logic framing_error,  // strobe: no stop bit; the next character needs a high level first
    output logic start_glitch,  // strobe: low, but high again in the middle of the start bit
    output logic busy  // level: a character is under way
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
    logic   [19:0] left;  // 1/16 clk until the next sample
    logic   [ 1:0] sample;  // 0, 1, 2 of a bit
    logic   [ 1:0] seen;  // samples 0 and 1
    // bit of the character: 0 start, 1..8 data, 9 ninth, STOP
    logic   [ 3:0] place;
    logic   [ 8:0] shifted;

    wire    [19:0] whole = |bit_time[19:7] ? bit_time : 20'd128;
    // between samples: 1/16 bit, at least 1 clk
    wire    [19:0] spread = |whole[19:8] ? {4'd0, whole[19:4]} : 20'd16;
    wire           now = left < 20'd16;
    wire           first = place == 4'd0;
    wire           last = place == STOP;
    wire           agreed = sample == 2'd1 && seen[0] == rx;
    wire           decide = state == RECEIVE && now && (sample == 2'd2 || (last && agreed));
    wire           level = agreed ? rx : (seen[0] & seen[1]) | (seen[0] & rx) | (seen[1] & rx);

    assign busy = state != IDLE;

    always_ff @(posedge clk) begin
        valid         <= decide && last && level;
        framing_error <= decide && last && !level;
        start_glitch  <= decide && first && level;

        // rounding, and the edge is half a clk old
        if (state == IDLE) left <= {1'b0, whole[19:1]} - spread - 20'd24;
        else if (!now) left <= left - 20'd16;
        else left <= left - 20'd16 + (sample == 2'd2 ? whole - {spread[18:0], 1'b0} : spread);

        if (state != RECEIVE) sample <= 2'd0;
        else if (now) begin
            sample <= sample == 2'd2 ? 2'd0 : sample + 1'b1;
            seen   <= {seen[0], rx};
        end

        if (decide) begin
            place   <= place + 1'b1;
            shifted <= {level, shifted[8:1]};
            if (last) {ninth, data} <= NINTH != 0 ? shifted : {1'b0, shifted[8:1]};
        end

        case (state)
            IDLE: begin
                place <= 4'd0;
                if (!rx) state <= RECEIVE;
            end
            RECEIVE:
                if (decide && first && level) state <= IDLE;
                else if (decide && last)      state <= level ? IDLE : RELEASE;
            RELEASE:
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
            if (state == RECEIVE) assert (place <= STOP && sample <= 2'd2);
            if (start_glitch) assert (!busy);
            cover (start_glitch);
        end
    end
`endif
endmodule

`default_nettype wire
