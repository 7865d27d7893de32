// SPDX-License-Identifier: Apache-2.0
// count_phase_check -- compare the interpolated position with the x4 count of the same signals, so
// that a lost fringe is detected.
//
// latency  3 cycles from valid to disagreement
// rate     one position per cycle
// behaviour The constant difference between position and count is learned from the first position
//          after reset, from every position while limit is 0, and from the next position after a
//          shift by 0 periods. A shift by any other number of periods is added to the constant
//          exactly: moving the origin hides no disagreement.
// limits   `limit` must cover the quarter period between two counts, the offset of the two
//          comparators, and twice the distance travelled while the deglitchers delay an edge: the
//          count lags that distance in each direction.
// source   S0: the fringe count and the arctangent come from the same two photodetectors
// model    tb/position/count_phase_check.py, equal in every bit of every cycle
// proved   there is no disagreement while limit is 0, and no shift ever causes one
`default_nettype none

module count_phase_check (
    input  wire               clk,
    input  wire               rst,            // level: clears disagreement, learns the constant
    input  wire        [19:0] limit,          // 2^-16 period; 0: not checked
    input  wire               valid,          // strobe: position belongs to a new sample
    /* verilator lint_off UNUSEDSIGNAL */  // the count has no more than 46 bits to compare with
    input  wire signed [47:0] position,       // Q32.16 periods
    /* verilator lint_on UNUSEDSIGNAL */
    input  wire signed [31:0] count,          // 1/4 period, wraps
    input  wire               shift,          // strobe: shift_periods is added in the next cycle
    input  wire signed [31:0] shift_periods,  // periods; 0: learn the constant again
    output logic              disagreement    // level: the two differ by more than limit
);
    localparam int D = 46;  // bits of the difference; the count wraps at 2^32 / 4 periods

    logic known, measured, compared;
    logic signed [D-1:0] between, constant, difference;

    wire signed [D-1:0] moved = shift ? {shift_periods[D-17:0], 16'b0} : '0;
    wire                learn = !known || limit == '0;
    wire        [D-1:0] size = difference < 0 ? -difference : difference;

    always_ff @(posedge clk) begin
        measured   <= valid;
        between    <= position[D-1:0] - {count, 14'b0} + moved;
        constant   <= (measured && learn ? between : constant) + moved;
        compared   <= measured && !learn;
        difference <= between - constant;
        if (compared) disagreement <= size > D'(limit);
        if (measured) known <= 1'b1;
        if (shift && shift_periods == 0) known <= 1'b0;
        if (limit == '0 || (measured && learn)) disagreement <= 1'b0;
        if (rst) begin
            known        <= 1'b0;
            measured     <= 1'b0;
            compared     <= 1'b0;
            disagreement <= 1'b0;
        end
    end

`ifdef FORMAL
    (* anyconst *)logic              still;  // only the origin moves
    wire signed [47:0] by = shift ? $signed({shift_periods, 16'b0}) : 48'sd0;
    wire signed [47:0] next_position = position + by;
    logic              past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && still) begin
            assume (count == $past(count));
            assume (position == $past(next_position));
        end
        if (past) begin
            if ($past(limit) == 0) assert (!disagreement);
            if (still) begin
                assert (!disagreement);
                if (measured) assert (between == position[D-1:0] - {count, 14'b0});
                if (known) assert (constant == position[D-1:0] - {count, 14'b0});
                if (compared) assert (difference == 0);
            end
            cover (disagreement);
            cover (compared && still && position < 0 && limit == 1);
        end
    end
`endif
endmodule

`default_nettype wire
