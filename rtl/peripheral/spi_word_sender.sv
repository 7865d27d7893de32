// SPDX-License-Identifier: Apache-2.0
// spi_word_sender -- send words of 16 bits to a device that takes them at the rising edge of its
// chip select, such as a DAC or a display driver.
//
// latency  33 * half_period + 1 cycles from valid and ready to the rising edge of cs_n; cs_n falls
//          1 cycle after them
// rate     one word per 36 * half_period + 1 cycles; cs_n is high for 3 half_period of them
// source   AD5542A, Analog Devices, and MAX7219, Maxim: most significant bit first, taken at rising
//          edges of sclk while cs_n is low, the word at the rising edge of cs_n; sclk up to 50 and
//          10 MHz, cs_n high for 50 ns
// model    tb/peripheral/spi_word_sender.py, equal in every bit of every cycle
// proof    depth 40
// proved   sclk is low while cs_n is high or changes; a word has 16 rising edges of sclk; sdi is
//          stable from one cycle before each of them to the falling edge
`default_nettype none

module spi_word_sender (
    input wire clk,
    input wire rst,  // drops the word being sent
    input wire [7:0] half_period,  // cycles of half a sclk period, taken with a word; 0 acts as 1
    input wire valid,  // level: a word waits
    output logic ready,  // with valid: taken in this cycle
    input wire [15:0] word,  // word to send
    output logic cs_n,  // pin, low during a word
    output logic sclk,  // pin, idles low
    output logic sdi,  // pin, data of the device
    output logic sent  // strobe: the device has taken a word
);
    // halves of sclk in a word: 0 set-up, 16 bits, 32 hold, 3 with cs_n high
    localparam [5:0] RAISE = 6'd33, LAST = 6'd35;

    logic [5:0] half;
    logic [7:0] length, elapsed;  // cycles of a half; of those, the ones up to this one
    logic [15:0] shifted;  // the highest bit is on sdi

    wire  [ 5:0] next = half + 1'b1;
    wire         ends = elapsed >= length;  // the half ends

    assign sdi = shifted[15];

    always_ff @(posedge clk) begin
        sent <= 1'b0;
        elapsed <= ready || ends ? 8'd1 : elapsed + 1'b1;
        if (ready) begin
            half   <= '0;
            length <= half_period;
            if (valid) begin
                ready   <= 1'b0;
                cs_n    <= 1'b0;
                shifted <= word;
            end
        end else if (ends) begin
            half <= next;
            sclk <= next[0] && next < RAISE;
            if (!next[0] && next < RAISE - 1'b1) shifted <= shifted << 1;
            if (next == RAISE) begin
                cs_n <= 1'b1;
                sent <= 1'b1;
            end
            if (half == LAST) ready <= 1'b1;
        end
        if (rst) begin
            ready   <= 1'b1;
            shifted <= '0;
            cs_n    <= 1'b1;
            sclk    <= 1'b0;
            sent    <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [4:0] rises = '0;  // of sclk in this word
    always @(posedge clk) begin
        past  <= 1'b1;
        rises <= rst || cs_n ? '0 : rises + {4'd0, sclk && !$past(sclk)};
        if (!past) assume (rst);
        if (past) begin
            assert (!(cs_n && sclk));
            assert (ready || half <= LAST);
            assert (cs_n == (ready || half >= RAISE));
            assert (!sclk || (half[0] && half < RAISE));
            if (!$past(rst)) begin
                if (cs_n != $past(cs_n)) assert (!sclk && !$past(sclk));
                if (sclk) assert (sdi == $past(sdi));
                if (cs_n && !$past(cs_n)) assert (rises == 5'd16);
                if (!ready && !cs_n) assert (sclk == half[0]);
                if (!ready && !cs_n)
                    assert (rises + {4'd0, sclk && !$past(sclk)} == (half[5:1] + {4'd0, half[0]}));
            end
            cover (sent && length == 8'd1);
        end
    end
`endif
endmodule

`default_nettype wire
