// SPDX-License-Identifier: Apache-2.0
// break_detector -- report a break: a line that has been low for longer than any character at any
// baud rate.
//
// latency   CLK_HZ / 1000 * TIME_US / 1000 cycles from the line going low to found
// rate      found comes once per break.
// source    The break of a UART line: a master that does not know the baud rate of its nodes can
//           still send one.
// model     tb/serial/break_detector.py, equal in every bit of every cycle
// proved    found comes only while the line is low, and only once until it is high again.
// proof     depth 20, CLK_HZ = 1000000, TIME_US = 5
`default_nettype none

module break_detector #(
    parameter int CLK_HZ  = 4_000_000,  // Hz, frequency of clk
    parameter int TIME_US = 2000        // us, shortest break; 9600 baud keep low for 1042 us
) (
    input  wire  clk,
    input  wire  rst,
    input  wire  rx,    // level: the line, synchronous to clk; idles high
    output logic found  // strobe: a break
);
    localparam int LONGEST = CLK_HZ / 1000 * TIME_US / 1000;
    localparam int W = $clog2(LONGEST + 1);

    if (LONGEST < 1) begin : g_check
        TIME_US_MUST_BE_AT_LEAST_ONE_CLK u_error ();
    end

    logic [W-1:0] low;  // cycles that the line has been low; stops at LONGEST

    wire          last = low == W'(LONGEST - 1);

    always_ff @(posedge clk) begin
        if (rx) low <= '0;
        else if (low != W'(LONGEST)) low <= low + 1'b1;
        found <= !rx && last;
        if (rst) begin
            low   <= '0;
            found <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic reported;  // of this break
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        reported <= !rst && !rx && (reported || (low == W'(LONGEST - 1)));
        if (past && !$past(rst)) begin
            assert (low <= W'(LONGEST));
            assert (reported == (low == W'(LONGEST)));
            if (found) assert (!$past(rx) && !$past(reported) && reported);
            cover (found);
        end
    end
`endif
endmodule

`default_nettype wire
