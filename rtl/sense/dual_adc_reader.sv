// SPDX-License-Identifier: Apache-2.0
// dual_adc_reader -- read both channels of a simultaneously sampling serial ADC, and convert its
// straight binary codes to signed ones.
//
// latency  2 * (LEADING + W) cycles from start to valid; 1 cycle from start to the falling edge of
//          cs_n, at which the ADC samples
// rate     one conversion per 2 * FRAME + 1 cycles: 29 for a frame of 14 clocks, 33 for one of 16
// source   AD7352, AD7356 (12 bit: LEADING 2, FRAME 14) and AD7357 (14 bit: LEADING 2, FRAME 16),
//          Analog Devices: cs_n brings the first leading zero, each falling edge of sclk the next
//          bit; bit n is read at falling edge n
// model    tb/sense/dual_adc_reader.py, equal in every bit of every cycle
// proved   sclk is high outside a frame, a frame has FRAME falling edges, and the first follows
//          one cycle after the falling edge of cs_n
`default_nettype none

module dual_adc_reader #(
    parameter int W       = 8,  // bits of a sample, the top ones of the ADC
    parameter int LEADING = 2,  // bits before the most significant one
    parameter int FRAME   = 14  // sclk periods of a conversion
) (
    input  wire                 clk,      // twice sclk: a bit has one sclk period to arrive
    input  wire                 rst,      // level: ends a frame at once
    input  wire                 start,    // strobe: convert; ignored during a conversion
    input  wire                 sdata_a,  // serial data of channel A, the sine
    input  wire                 sdata_b,  // serial data of channel B, the cosine
    output logic                cs_n,     // level: the ADC samples at its falling edge
    output logic                sclk,     // half of clk while cs_n is low, else high
    output logic                valid,    // strobe: sin and cos are new
    output logic signed [W-1:0] sin,      // counts, full scale = 2^(W-1); held until the next valid
    output logic signed [W-1:0] cos       // counts, sampled together with sin
);
    if (W < 3) begin : g_check_w
        W_MUST_BE_AT_LEAST_3 u_error ();
    end
    if (LEADING < 0) begin : g_check_leading
        LEADING_MUST_NOT_BE_NEGATIVE u_error ();
    end
    if (FRAME < LEADING + W) begin : g_check_frame
        FRAME_MUST_HOLD_LEADING_AND_W u_error ();
    end

    localparam int B = $clog2(FRAME + 1);

    logic [B-1:0] bits;  // falling edges of sclk so far
    logic [W-2:0] word_a, word_b;  // the last bits received

    wire bit_now = !cs_n && sclk;  // sclk falls at the end of this cycle: the bit is valid
    wire last = bits == B'(LEADING + W - 1);

    always_ff @(posedge clk) begin
        valid <= bit_now && last;
        if (cs_n) begin
            cs_n <= !start;
            bits <= '0;
        end else begin
            sclk <= !sclk;
            if (!sclk && bits == B'(FRAME)) cs_n <= 1'b1;
        end
        if (bit_now) begin
            bits <= bits + 1'b1;
            if (last) begin
                sin <= {~word_a[W-2], word_a[W-3:0], sdata_a};
                cos <= {~word_b[W-2], word_b[W-3:0], sdata_b};
            end
            word_a <= {word_a[W-3:0], sdata_a};
            word_b <= {word_b[W-3:0], sdata_b};
        end
        if (rst) begin
            cs_n  <= 1'b1;
            sclk  <= 1'b1;
            valid <= 1'b0;
            bits  <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (!cs_n || sclk);
            assert (bits <= FRAME);
            assert (cs_n || !sclk || bits < FRAME);
            if (valid) assert (bits == LEADING + W && !cs_n && !sclk);
        end
        if (past && !$past(rst)) begin
            if ($past(sclk) && !sclk) assert ($past(!cs_n) && !cs_n && bits == $past(bits) + 1);
            if ($past(!cs_n) && cs_n) assert (bits == FRAME);
            if ($past(cs_n) && !cs_n) assert (sclk && bits == 0 && $past(start));
            cover (bits == 4);
        end
    end
`endif
endmodule

`default_nettype wire
