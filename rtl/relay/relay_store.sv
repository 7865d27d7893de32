// SPDX-License-Identifier: Apache-2.0
// relay_store -- read the set of a relay from SPI flash at power-up: the first copy, and if that is
// broken the second.
//
// latency  2048 + 66 (LENGTH + 5) clk from reset to the last byte of the first copy; 2048 + 66
//          (LENGTH + 4) clk from `bad` to that of the second
// rate     one bit per 8 clk, one byte per 66 clk
// fits     any serial flash with command 03 (read, 24-bit address) and AB (wake), SPI mode 0: the
//          chip that an iCE40 boots from
// copies   who saves writes the second copy first, looks whether it stands, then the first:
//          whenever power fails, one of the two is whole, and what is read is all old or all new
// through  afterwards bytes go to the flash and back for whoever holds pass_select: that is how it
//          is written
// model    tb/relay/flash.py is the chip; the bytes are those that it holds
// proved   chip_n rises and falls only while sclk is low; sclk rises only while the chip is
//          selected
`default_nettype none

module relay_store #(
    parameter int LENGTH = 156,      // bytes of a set
    parameter int FIRST  = 1048576,  // address of the first copy
    parameter int SECOND = 1052672   // address of the second: another sector
) (
    input  wire        clk,
    input  wire        rst,          // reads again
    input  wire        good,         // strobe: the set was whole
    input  wire        bad,          // strobe: it was not
    input  wire        pass_select,  // level: the chip is wanted
    output logic       pass_ready,   // level: the chip is selected and waits for a byte
    input  wire        pass_valid,   // strobe: send pass_data; only while ready
    input  wire  [7:0] pass_data,
    output logic       start,        // strobe: a copy begins
    output logic       valid,        // strobe
    output logic [7:0] data,         // of the copy, or the answer to pass_data
    output logic       pass_done,    // strobe: data is the answer
    output logic       busy,         // level: reading a copy
    output logic [1:0] source,       // 0 no copy was whole, 1 the first, 2 the second
    output logic       chip_n,       // pins
    output logic       sclk,
    output logic       sdo,
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
    logic [5:0] bit_clk;  // 1/8 bit
    logic [7:0] shifted;
    logic [10:0] left;  // bytes, or clk of the pause
    logic byte_done;

    wire [31:0] call = {READ_FROM, second ? 24'(SECOND) : 24'(FIRST)};
    wire [1:0] place = left[1:0];
    wire [7:0]  called = place == 2'd3 ? call[31:24] : place == 2'd2 ? call[23:16] : place == 2'd1 ? call[15:8] : call[7:0];
    wire idle = !shifting && !byte_done;
    wire        send   = idle && (state == WAKE || state == ADDRESS || state == READ || (pass_ready && pass_valid));

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
            shifted  <= state == WAKE ? WAKE_UP : state == ADDRESS ? called : state == READ ? 8'd0 : pass_data;
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
