// SPDX-License-Identifier: Apache-2.0
// segment_map -- take the error of equal segments of the turn off a position: straight lines
// between their borders, round and round.
//
// latency  3 clk from step to corrected
// rate     one step per clk
// method   segment_table is asked for the angle of that clk, again and again, $clog2(2 SEGMENTS +
//          2) + 23 clk a round; until the next answer the correction stands. At rest it is that of
//          the angle after 2 rounds; moving m counts a round it is behind by what the table changes
//          over 2 m counts
// points   border n is n / SEGMENTS of the turn from the index, and the last border is the first
//          one. Two sets: one is in force, the other is written, two points a strobe; swap
//          exchanges them and drops the answer under way. They lie one behind the other in one
//          table, so that a turn never reaches from one into the other. Until the first swap
//          nothing is corrected
// source   S0: table of equal segments; S1: the angle is corrected between the read head and the
//          CNC
// model    tb/compensate/segment_map.py, equal in every bit of every cycle
// proved   nothing is corrected before the first swap; the correction changes only when an answer
//          has come or enable falls
// proof    depth 12, SEGMENTS = 3
`default_nettype none

module segment_map #(
    parameter int SEGMENTS = 36,
    parameter int W        = 32   // bits of position
) (
    input wire clk,
    input wire rst,
    input wire enable,  // level: angle is known; 0: nothing is corrected
    input  wire                   write,            // strobe: two points go into the set not in force; the next 3 clk later or more
    input wire [4:0] term,  // they are 2 term and 2 term + 1
    input wire signed [23:0] even,  // 2^-16 count: position at that border less the true one
    input wire signed [23:0] odd,
    input wire swap,  // strobe: exchange the sets
    input wire [31:0] angle,  // 2^-32 turn; changes one clk after step, as position does
    input wire [W-1:0] position,  // counts
    output logic signed [31:0] correction,  // 2^-16 count
    output logic signed [W+15:0] corrected,  // 2^-16 count: position - correction of one clk before
    output logic refreshed  // strobe: an answer has come in
);
    if (SEGMENTS < 2 || SEGMENTS > 64) begin : g_check
        SEGMENTS_MUST_BE_FROM_2_TO_64 u_error ();
    end

    localparam int POINTS = SEGMENTS + 1;  // of a set
    localparam int INDEX = $clog2(2 * POINTS);
    localparam logic [47:0] LENGTH = ((48'd1 << 32) + 48'(SEGMENTS - 1)) / 48'(SEGMENTS);      // 2^-32 turn
    localparam logic [47:0] SECOND = LENGTH * 48'(POINTS);  // where the second set begins

    logic page, swapped;  // the set in force; there is one
    // the odd point is to be written; the last border is
    logic follows, closes;
    logic [4:0] term_q;
    logic signed [23:0] even_q, odd_q;
    logic         asked;  // the table works
    logic [W-1:0] position_q;
    wire done, unused_outside;
    wire signed [47:0] unused_corrected;
    wire signed [23:0] error, unused_read_value;

    wire on = enable && swapped;
    wire asking = on && !asked;
    wire [47:0] place = {16'd0, angle} + (page ? SECOND : 48'd0);
    wire [6:0] number = closes ? 7'(SEGMENTS) : follows ? {1'b0, term_q, 1'b1} : {1'b0, term, 1'b0};
    wire puts = closes || (follows ? number < 7'(SEGMENTS) : write && number < 7'(SEGMENTS));
    wire [INDEX-1:0] point = INDEX'(number) + (page ? '0 : INDEX'(POINTS));
    wire signed [23:0] value = closes ? even_q : follows ? odd_q : even;
    wire unused = &{1'b0, unused_outside, unused_corrected, unused_read_value};

    segment_table #(
        .INDEX(INDEX)
    ) u_table (
        .clk,
        .rst           (rst || swap || !on),
        .enable        (1'b1),
        .linear        (1'b1),
        .origin        (48'sd0),
        .segment_length(LENGTH),
        .segments      (INDEX'(2 * POINTS - 1)),
        .write         (puts),
        .point,
        .value,
        .read_point    ('0),
        .valid         (asking),
        .position      (place),
        .done,
        .corrected     (unused_corrected),
        .outside       (unused_outside),
        .error,
        .read_value    (unused_read_value)
    );

    always_ff @(posedge clk) begin
        follows <= write;
        closes  <= follows && term_q == '0;
        if (write) begin
            term_q <= term;
            even_q <= even;
            odd_q  <= odd;
        end
        asked <= (asked || asking) && !done;
        refreshed <= done;
        if (done) correction <= 32'(error);
        if (swap) begin
            page    <= !page;
            swapped <= 1'b1;
            asked   <= 1'b0;
        end
        position_q <= position;
        corrected  <= {position_q, 16'd0} - {{(W-16){correction[31]}}, correction};
        if (rst || !on) begin
            asked      <= 1'b0;
            correction <= '0;
            refreshed  <= 1'b0;
        end
        if (rst) begin
            page    <= 1'b0;
            swapped <= 1'b0;
            follows <= 1'b0;
            closes  <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (!swapped) assert (correction == '0);
            if (page != $past(page)) assert ($past(swap));
            if (correction != $past(correction)) assert (refreshed || !$past(on));
            cover (asked && page);
        end
    end
`endif
endmodule

`default_nettype wire
