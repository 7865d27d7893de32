// SPDX-License-Identifier: Apache-2.0
// segment_map -- subtract the error of equal segments of the turn from a position: straight lines
// between their borders, all round the turn.
//
// latency   3 cycles from step to corrected
// rate      one step per cycle
// accuracy  After 2 rounds at standstill the correction is the error at the angle. In a motion of m
//           counts per round it lags by the change of the table over 2 m counts.
// method    segment_table computes the error at the current angle again and again. A round takes
//           $clog2(2 SEGMENTS + 2) + 23 cycles; the correction is constant until the next answer.
// behaviour Border n is n / SEGMENTS of a turn from the reference mark, and the last border is the
//           first one. There are two sets of points. One is in force, the other can be written, two
//           points per strobe; swap exchanges them and drops the running answer. The sets follow
//           each other in one table in such a way that a turn never reaches from one into the
//           other. Before the first swap nothing is corrected.
// source    S0: table of equal segments; S1: the angle is corrected between the read head and the
//           CNC
// model     tb/compensate/segment_map.py, equal in every bit of every cycle
// proved    Nothing is corrected before the first swap. The correction changes only when an answer
//           has come or enable falls.
// proof     depth 12, SEGMENTS = 3
`default_nettype none

module segment_map #(
    parameter int SEGMENTS = 36,  // number of segments of a turn
    parameter int W        = 32   // bits of position
) (
    input  wire                  clk,
    input  wire                  rst,
    input  wire                  enable,      // level: angle is known; 0: nothing is corrected
    input  wire                  write,       // strobe: write two points of the set not in force
    input  wire         [   4:0] term,        // half the number of the even point
    input  wire signed  [  23:0] even,        // 2^-16 count: error at border 2 term
    input  wire signed  [  23:0] odd,         // 2^-16 count: error at border 2 term + 1
    input  wire                  swap,        // strobe: exchange the sets
    input  wire         [  31:0] angle,       // 2^-32 turn, changes one cycle after step
    input  wire         [ W-1:0] position,    // counts, changes one cycle after step
    output logic signed [  31:0] correction,  // 2^-16 count
    output logic signed [W+15:0] corrected,   // 2^-16 count: position - correction, delayed
    output logic                 refreshed    // strobe: an answer has come in
);
    // An error is the position at a border less the true one. Two write strobes must be at least 3
    // cycles apart. corrected is the difference of one cycle before.
    if (SEGMENTS < 2 || SEGMENTS > 64) begin : g_check
        SEGMENTS_MUST_BE_FROM_2_TO_64 u_error ();
    end

    localparam int POINTS = SEGMENTS + 1;  // of a set
    localparam int INDEX = $clog2(2 * POINTS);
    // 2^-32 turn
    localparam logic [47:0] LENGTH = ((48'd1 << 32) + 48'(SEGMENTS - 1)) / 48'(SEGMENTS);
    localparam logic [47:0] SECOND = LENGTH * 48'(POINTS);  // where the second set begins

    logic page, swapped;  // number of the set in force; a set is in force
    // the odd point is written now; the last border is written now
    logic follows, closes;
    logic [4:0] term_q;
    logic signed [23:0] even_q, odd_q;
    logic         busy;  // the table is busy
    logic [W-1:0] position_q;
    wire done, unused_outside;
    wire signed [47:0] unused_corrected;
    wire signed [23:0] error, unused_read_value;

    wire                    on = enable && swapped;
    wire                    asks = on && !busy;
    wire        [     47:0] table_position = {16'd0, angle} + (page ? SECOND : 48'd0);
    wire        [      6:0] own = follows ? {1'b0, term_q, 1'b1} : {1'b0, term, 1'b0};
    wire        [      6:0] number = closes ? 7'(SEGMENTS) : own;
    wire                    puts = closes || ((follows || write) && number < 7'(SEGMENTS));
    wire        [INDEX-1:0] point = INDEX'(number) + (page ? '0 : INDEX'(POINTS));
    wire signed [     23:0] value = closes ? even_q : follows ? odd_q : even;
    wire                    unused = &{1'b0, unused_outside, unused_corrected, unused_read_value};

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
        .valid         (asks),
        .position      (table_position),
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
        busy      <= (busy || asks) && !done;
        refreshed <= done;
        if (done) correction <= 32'(error);
        if (swap) begin
            page    <= !page;
            swapped <= 1'b1;
            busy    <= 1'b0;
        end
        position_q <= position;
        corrected  <= {position_q, 16'd0} - {{(W-16){correction[31]}}, correction};
        if (rst || !on) begin
            busy       <= 1'b0;
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
            cover (busy && page);
        end
    end
`endif
endmodule

`default_nettype wire
