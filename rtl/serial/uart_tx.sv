// SPDX-License-Identifier: Apache-2.0
// uart_tx -- characters of a UART onto a line that is shared: start, 8 data bits LSB first, 9th bit
// if any, stop.
//
// latency  from idle: 1 clk to driver_enable, one bit more to the start bit
// rate     characters
//          without any gap
// source   S0: the 9th bit syncs command bytes. Bit edges stand at the clk at or before n ·
//          bit_time: never a sum of roundings
// model    tb/serial/uart_tx.py, equal in every bit of every cycle
// proved   the line is high whenever it is not driven
// bounds   driver_enable leads the first start bit by at least one bit, follows the last stop bit
//          by at least half a bit; from bit_time = 8 clk up (less counts as 8)
`default_nettype none

module uart_tx #(
    parameter int NINTH = 1  // 0: without the 9th bit, 8N1
) (
    input  wire         clk,
    input  wire         rst,            // lets go of the line
    input  wire  [19:0] bit_time,       // 1/16 clk
    input  wire         valid,          // level: data and ninth stand
    output logic        ready,          // with valid: taken in this clk
    input  wire  [ 7:0] data,
    input  wire         ninth,          // the 9th bit, unused without one
    output logic        tx,             // idles high
    output logic        driver_enable,  // of the line driver
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
    logic   [19:0] left;  // 1/16 clk until the next bit
    logic   [ 3:0] place;  // bits still to come after this one
    logic   [ 9:0] shifted;  // these bits, the next one lowest

    wire    [19:0] whole = |bit_time[19:7] ? bit_time : 20'd128;
    wire           now = left < 20'd16;

    assign ready         = (state == LEAD && now) || (state == SEND && now && place == 4'd0) || state == TRAIL;
    assign driver_enable = state != IDLE;
    assign busy          = state != IDLE;

    always_ff @(posedge clk) begin
        // rounded up: a whole bit of lead
        if (state == IDLE) left <= whole - 20'd1;
        else if (!now) left <= left - 20'd16;
        else if (state == SEND && ready)
            left <= valid ? left - 20'd16 + whole : left + {1'b0, whole[19:1]};
        else left <= left - 20'd16 + whole;

        if (valid && ready) begin
            tx      <= 1'b0;
            place   <= STOP;
            shifted <= {1'b1, NINTH != 0 ? ninth : 1'b1, data};
            if (state == TRAIL) left <= whole - 20'd16;
        end else if (state == SEND && now) begin
            tx      <= place == 4'd0 || shifted[0];
            place   <= place - 1'b1;
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
            if (state == SEND) assert (place <= STOP);
            cover (state == SEND);
        end
    end
`endif
endmodule

`default_nettype wire
