// SPDX-License-Identifier: Apache-2.0
// spi_word_sender -- words of 16 bits to a device that takes them at the rising edge of its chip select, such as a display driver.
//
// latency  cs_n falls 1 clk after a word is taken, and rises 33 half periods of sclk later       rate  a word per 35 half periods and 1 clk
// source   MAX7219, Maxim: most significant bit first, taken at rising edges of sclk, the word at that of cs_n; sclk up to 10 MHz, cs_n
//          high for 50 ns
// model    tb/link/spi_word_sender.py, equal in every bit of every cycle
// proof    depth 40, CLK_HZ = 1000000
// proved   sclk is low while cs_n is high or changes; a word has 16 rising edges of sclk; sdi stands while sclk is high, and before
`default_nettype none

module spi_word_sender #(
    parameter int CLK_HZ  = 50_000_000,
    parameter int SCLK_HZ = 1_000_000           // at most
) (
    input  wire                  clk,
    input  wire                  rst,           // drops the word in flight
    input  wire                  valid,         // level: a word stands
    output logic                 ready,         // with valid: taken in this clk
    input  wire        [15:0]    word,
    output logic                 cs_n,          // pin
    output logic                 sclk,          // pin
    output logic                 sdi,           // pin
    output logic                 busy           // level: a word is being sent
);
    if (SCLK_HZ < 1 || CLK_HZ < 1) begin : g_check CLK_HZ_AND_SCLK_HZ_MUST_BE_POSITIVE u_error (); end

    localparam int HALF = CLK_HZ <= 2 * SCLK_HZ ? 1 : (CLK_HZ + 2 * SCLK_HZ - 1) / (2 * SCLK_HZ);   // clk of half a period
    localparam int L    = HALF > 1 ? $clog2(HALF) : 1;
    localparam logic [5:0] RAISE = 6'd33, LAST = 6'd34;                     // halves of a word: 16 bits, 1 of hold, 2 with cs_n high

    logic [L-1:0] left;                         // clk of this half after this one
    logic [5:0]   half;
    logic [15:0]  shifted;                      // the bit on the wire highest

    wire [5:0] next = half + 1'b1;

    assign ready = !busy;
    assign sdi   = shifted[15];

    always_ff @(posedge clk) begin
        if (!busy) begin
            left <= L'(HALF - 1);
            half <= '0;
            if (valid) begin
                busy    <= 1'b1;
                cs_n    <= 1'b0;
                shifted <= word;
            end
        end else if (left != '0) begin
            left <= left - 1'b1;
        end else begin
            left <= L'(HALF - 1);
            half <= next;
            sclk <= next[0] && next < RAISE;
            if (!next[0]) shifted <= {shifted[14:0], 1'b0};
            if (next == RAISE) cs_n <= 1'b1;
            if (half == LAST)  busy <= 1'b0;
        end
        if (rst) begin
            busy    <= 1'b0;
            shifted <= '0;
            cs_n    <= 1'b1;
            sclk    <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [4:0] rises = '0;                     // of sclk in this word
    always @(posedge clk) begin
        past  <= 1'b1;
        rises <= rst || cs_n ? '0 : rises + {4'd0, sclk && !$past(sclk)};
        if (!past) assume (rst);
        if (past) begin
            assert (!(cs_n && sclk));
            assert (!busy || half <= LAST);
            assert (cs_n == (!busy || half >= RAISE));
            assert (!sclk || (half[0] && half < RAISE));
            if (!$past(rst)) begin
                if (cs_n != $past(cs_n)) assert (!sclk && !$past(sclk));
                if (sclk) assert (sdi == $past(sdi));
                if (cs_n && !$past(cs_n)) assert (rises == 5'd16);
                if (busy && !cs_n) assert (sclk == half[0]);
                if (busy && !cs_n) assert (rises + {4'd0, sclk && !$past(sclk)} == (half[5:1] + {4'd0, half[0]}));
            end
            cover (ready && $past(busy) && $past(!rst));
        end
    end
`endif
endmodule

`default_nettype wire
