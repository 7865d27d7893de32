// SPDX-License-Identifier: Apache-2.0
// link_pll -- follow the arrivals of the cyclic requests of the real-time link with a digital PLL,
// and trigger a capture a set time before each arrival that is expected.
//
// latency   1 cycle from an arrival to the first cycle of its error; capture comes exactly `lead`
//           cycles before the cycle in which an arrival has the error 0
// rate      one arrival per period; further ones in the same period are ignored
// behaviour The first arrival starts the period. Each later one, unless it is missing, shifts the
//           next expected arrival by 2^-8 of its error, and the period by 2^-18 of its error. As
//           an error is half a period at most, one arrival shifts the next one by 2^-9 of the
//           period at most; the period stays within 512 cycles of its setting. The score
//           of the lock grows by 1 with an error below a quarter of the period, up to 63, and
//           falls by 3 with another one. `locked` rises with one more such error at 63. It falls
//           when the score falls to 0, or when 16 arrivals in a row are missing; then the next
//           arrival starts from scratch. While fewer are missing, the period runs on as it was.
//           While it is off, no register changes.
// limits    A period has from 2048 cycles up to 2^20 - 1; `lead` is 3/8 of it at most. Both change
//           only while enable is low, or with a pause of 16 periods. Arrivals that jitter by more
//           than about 30 % of the period, either way, do not lock.
// source    second-order digital PLL, critically damped: natural frequency 2^-9 rad per period
// model     tb/link/link_pll.py, equal in every bit of every cycle
// proved    Captures come only while the PLL is on, and locked in the cycle before. The PLL is
//           locked only while it is on and runs. The phase never leaves its range, so the period
//           cannot be lost, whatever the arrivals are.
// proof     depth 6
`default_nettype none

module link_pll (
    input  wire         clk,
    input  wire         rst,
    // settings
    input  wire         enable,   // level: the link is on
    input  wire  [19:0] period,   // cycles, expected from one request to the next; 0: off
    input  wire  [18:0] lead,     // cycles, from a capture to the expected arrival
    // requests
    input  wire         arrived,  // strobe: a request has been accepted
    // results
    output logic        locked,   // level: the arrivals are as expected
    output logic [20:0] error,    // cycles, signed: how late the last arrival was
    output logic        capture   // strobe: capture the feedback
);
    localparam int PROPORTIONAL = 8;  // 2^-8 of an error
    localparam int FRACTION = 18;  // bits of the correction of the period below one cycle
    localparam logic [5:0] MOST_SCORE = 6'd63;
    localparam logic [5:0] PENALTY = 6'd3;
    localparam logic [3:0] MOST_MISSED = 4'd15;  // and one more

    logic [20:0] phase;  // cycles, signed; 0 where an arrival is expected
    logic [27:0] trim;  // 2^-18 cycle, signed: correction of every period
    logic [17:0] fraction;  // 2^-18 cycle, of the correction that is left for the next period
    logic runs;
    logic seen;  // an arrival came in this period
    logic [5:0] score;
    logic [3:0] missed;

    wire on = enable && period != '0;
    wire starts = on && !runs && arrived;
    wire takes = on && runs && arrived && !seen;

    // the period ends half a period after the expected arrival
    wire [20:0] half = {2'b00, period[19:1]};
    wire [20:0] next = phase + 21'd1;
    wire wraps = on && $signed(next) >= $signed(half);

    // Correction of the next period. A late arrival makes it longer: it begins earlier.
    wire  [31:0] sum = {{4{trim[27]}}, trim} + {14'd0, fraction}
        + (seen ? {{(11 - (FRACTION - PROPORTIONAL)){error[20]}}, error,
                   {(FRACTION - PROPORTIONAL){1'b0}}} : 32'd0);
    wire [20:0] correction = {{7{sum[31]}}, sum[31:FRACTION]};
    wire [20:0] begins = ~half + {20'd0, !period[0]} - correction;

    wire [28:0] trimmed = {trim[27], trim} + {{8{error[20]}}, error};
    wire in_range = trimmed[28] == trimmed[27];

    wire [20:0] size = error ^ {21{error[20]}};  // one less if it is negative
    wire near = size < {3'b000, period[19:2]};
    wire gives_up = !seen && !arrived && missed == MOST_MISSED;
    wire ends_lock = seen ? !near && score <= PENALTY : gives_up;

    always_ff @(posedge clk) begin
        phase   <= wraps ? begins : next;
        capture <= on && locked && ~phase == {2'b00, lead};
        if (wraps) begin
            fraction <= sum[17:0];
            seen     <= 1'b0;
            missed   <= seen ? 4'd0 : missed + 4'd1;
            if (seen) begin
                if (in_range) trim <= trimmed[27:0];
                if (!near) score <= score < PENALTY ? 6'd0 : score - PENALTY;
                else if (score != MOST_SCORE) score <= score + 6'd1;
                if (near && score == MOST_SCORE) locked <= 1'b1;
            end
            if (ends_lock) locked <= 1'b0;
            if (gives_up) runs <= 1'b0;
        end
        if (takes) begin
            error <= phase;
            seen  <= 1'b1;
        end
        if (starts) begin
            phase    <= 21'd1;
            trim     <= '0;
            fraction <= '0;
            error    <= '0;
            seen     <= 1'b1;
            score    <= '0;
            missed   <= '0;
            runs     <= 1'b1;
        end
        if (rst || !on) begin
            phase  <= '0;
            error  <= '0;
            seen   <= 1'b0;
            runs   <= 1'b0;
            locked <= 1'b0;
        end
    end

`ifdef FORMAL
    logic              past = 1'b0;
    logic       [19:0] setting;
    wire signed [20:0] at = phase;
    wire signed [20:0] late = error;
    wire signed [20:0] early = -21'sd514 - $signed(half) - $signed(half >>> 7);
    always @(posedge clk) begin
        past    <= 1'b1;
        setting <= period;
        if (!past) assume (rst);
        assume (period == '0 || period >= 20'd2048);
        if (past && enable && $past(enable)) assume (period == setting);
        if (past && !$past(rst)) begin
            if (on && $past(on)) begin
                assert (at >= early && at < $signed(half));
                assert (late >= early && late < $signed(half));
            end
            if (locked) assert (runs && $past(on));
            if (runs) assert ($past(on));
            if (!runs) assert (!seen);
            if (capture) assert ($past(on && locked));
            if (capture && !$past(wraps) && $past(on && !starts))
                assert (phase == -{2'b00, $past(lead)});
            if ($past(on && runs && arrived && !seen)) assert (seen && error == $past(phase));
            cover (runs && phase == 21'd3);
            cover (!runs && phase == 21'd3);
        end
    end
`endif
endmodule

`default_nettype wire
