// SPDX-License-Identifier: Apache-2.0
// relay_store -- read the set of a relay from an SPI flash at power-up: the first copy, or the
// second one if the first is damaged.
//
// latency  2048 + 66 (LENGTH + 5) cycles from reset to the last byte of the first copy; 2048 + 66
//          (LENGTH + 4) cycles from `bad` to the last byte of the second copy
// rate     one bit per 8 cycles, one byte per 66 cycles
// behaviour  Afterwards bytes pass to the flash and back while pass_select is high, so the host
//          can write it. The host writes the second copy first, reads it back, then writes the
//          first one: whenever the power fails, one of the two is complete, and the set that is
//          read is either the old one or the new one.
// limits   The flash must have command 03 (read, 24-bit address) and AB (wake) in SPI mode 0, like
//          the chip that an iCE40 boots from.
// model    tb/relay/flash.py is the chip; the bytes are those that it holds
// proved   chip_n rises and falls only while sclk is low; sclk rises only while the chip is
//          selected
`default_nettype none

module relay_store #(
    parameter int LENGTH = 156,      // bytes of a set
    parameter int FIRST  = 1048576,  // byte address of the first copy
    parameter int SECOND = 1052672   // byte address of the second copy, in another sector
) (
    input  wire        clk,
    input  wire        rst,          // reads again
    // result of a copy
    input  wire        good,         // strobe: the set was complete
    input  wire        bad,          // strobe: the set was refused
    // host's access
    input  wire        pass_select,  // level: select the chip
    output logic       pass_ready,   // level: the chip is selected and waits for a byte
    input  wire        pass_valid,   // strobe: send pass_data; only while ready
    input  wire  [7:0] pass_data,    // byte to send
    // bytes
    output logic       start,        // strobe: a copy begins
    output logic       valid,        // strobe: data is new
    output logic [7:0] data,         // byte of the copy, or the answer to pass_data
    output logic       pass_done,    // strobe: data is the answer
    output logic       busy,         // level: a copy is being read
    output logic [1:0] source,       // 0 no copy was complete, 1 the first, 2 the second
    // pins
    output logic       chip_n,       // pin, low during an access
    output logic       sclk,         // pin
    output logic       sdo,          // pin, data to the flash
    input  wire        sdi           // level, synchronous to clk
);
    typedef enum logic [2:0] {
        WAKE,
        PAUSE,
        ADDRESS,
        READ,
        JUDGE,
        DONE
    } state_t;

    localparam logic [7:0] WAKE_UP = 8'hAB, READ_FROM = 8'h03;
    localparam logic [10:0] LAST = 11'(LENGTH - 1);

    state_t state;
    logic second;  // the copy
    logic shifting;
    logic [5:0] bit_clk;  // 1/8 of a bit
    logic [7:0] shifted;
    logic [10:0] left;  // bytes, or cycles of the pause
    logic byte_done;

    wire [31:0] call = {READ_FROM, second ? 24'(SECOND) : 24'(FIRST)};
    wire [7:0] called = call[8*left[1:0]+:8];
    wire idle = !shifting && !byte_done;
    wire reads = state == WAKE || state == ADDRESS || state == READ;
    wire send = idle && (reads || (pass_ready && pass_valid));
    wire [7:0] to_send =
        state == WAKE ? WAKE_UP : state == ADDRESS ? called : state == READ ? 8'd0 : pass_data;

    assign busy       = state != DONE;
    assign pass_ready = state == DONE && idle && pass_select && !chip_n;
    assign sclk       = shifting && bit_clk[2];
    assign sdo        = shifted[7];
    assign data       = shifted;

    always_ff @(posedge clk) begin
        byte_done <= shifting && bit_clk == '1;
        valid     <= state == READ && byte_done;
        pass_done <= state == DONE && byte_done;
        start     <= 1'b0;
        if (send) begin
            shifting <= 1'b1;
            bit_clk  <= '0;
            shifted  <= to_send;
        end else if (shifting) begin
            bit_clk <= bit_clk + 1'b1;
            if (bit_clk[2:0] == '1) shifted <= {shifted[6:0], sdi};
            if (bit_clk == '1) shifting <= 1'b0;
        end
        case (state)
            WAKE: begin
                chip_n <= 1'b0;
                if (byte_done) begin
                    state <= PAUSE;
                    left  <= '1;
                end
            end
            PAUSE: begin  // the chip wakes, or rests between two commands
                chip_n <= 1'b1;
                left   <= left - 1'b1;
                if (left == '0) begin
                    state  <= ADDRESS;
                    left   <= 11'd3;
                    chip_n <= 1'b0;
                    start  <= 1'b1;
                end
            end
            ADDRESS:
            if (byte_done) begin
                left <= left - 1'b1;
                if (left == '0) begin
                    state <= READ;
                    left  <= LAST;
                end
            end
            READ:
            if (byte_done) begin
                left <= left - 1'b1;
                if (left == '0) state <= JUDGE;
            end
            JUDGE: begin
                chip_n <= 1'b1;
                if (good) source <= {second, !second};
                if (good || (bad && second)) state <= DONE;
                else if (bad) begin
                    second <= 1'b1;
                    state  <= PAUSE;
                    left   <= '1;
                end
            end
            default: if (!shifting) chip_n <= !pass_select;
        endcase
        if (rst) begin
            state     <= WAKE;
            second    <= 1'b0;
            source    <= '0;
            shifting  <= 1'b0;
            byte_done <= 1'b0;
            valid     <= 1'b0;
            pass_done <= 1'b0;
            chip_n    <= 1'b1;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (chip_n != $past(chip_n)) assert (!sclk && !$past(sclk));
            if (sclk && !$past(sclk)) assert (!chip_n);
            if (shifting && (state != WAKE || bit_clk != 0)) assert (!chip_n);
            if (state == ADDRESS || state == READ) assert (!chip_n);
            assert (state <= DONE);
            assert (!shifting || (state != PAUSE && state != JUDGE));
            assert (!byte_done || !shifting);
            cover (state == WAKE && sclk);
        end
    end
`endif
endmodule

`default_nettype wire
