// SPDX-License-Identifier: Apache-2.0
// count_outlier_filter -- limit how far a count follows its predecessor, as in S0.
//
// latency  1 cycle from valid to done
// rate     one count per cycle
// source   S0, limit filter 2, its equation 9: for a difference of 0 the count is unchanged; for a
//          difference of 1 the preceding count is taken; for more, the mean of both, rounded down.
//          S0 gives no sign: here the magnitude of the difference decides, and the preceding count
//          is the one that came out.
// limits   A readout at rest may stay one count off. At v counts per sample (v of 2 or more) it
//          lags v counts going up and v - 1 going down.
// model    tb/sense/count_outlier_filter.py, equal in every bit of every cycle
// proved   the output lies between the preceding output and the new count, and at most one count,
//          or half the difference, from the new count; with enable = 0 nothing is changed
`default_nettype none

module count_outlier_filter #(
    parameter int W = 32  // bits of a count
) (
    input  wire                 clk,
    input  wire                 rst,       // level: the next count passes unchanged
    input  wire                 enable,    // level: 0: counts pass unchanged
    input  wire                 valid,     // strobe: count is new
    input  wire signed  [W-1:0] count,     // counts, wraps
    output logic                done,      // strobe: count_out is new
    output logic signed [W-1:0] count_out  // counts, wraps
);
    if (W < 2) begin : g_check
        W_MUST_BE_AT_LEAST_2 u_error ();
    end

    logic               known;  // count_out is a count

    wire signed [W-1:0] difference = count - count_out;
    wire signed [W-1:0] half_way = count_out + (difference >>> 1);
    wire                near = difference == W'(1) || difference == '1;

    always_ff @(posedge clk) begin
        done <= valid;
        if (valid) begin
            known <= 1'b1;
            if (!enable || !known) count_out <= count;
            else if (!near) count_out <= half_way;  // half of no difference gives the count
        end
        if (rst) begin
            known <= 1'b0;
            done  <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic limited;  // count_out was computed from two counts
    logic signed [W-1:0] whole, new_count;  // difference from the preceding output to the new count
    wire signed [W-1:0] left = new_count - count_out;
    wire signed [W-1:0] done_part = whole - left;
    always @(posedge clk) begin
        past      <= 1'b1;
        limited   <= enable && known;
        whole     <= difference;
        new_count <= count;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            assert (done == $past(valid));
            if (!done) begin
                assert (count_out == $past(count_out));
            end else if (!limited || whole == 0) begin
                assert (left == 0);
            end else if (whole == 1 || whole == -1) begin
                assert (left == whole);
            end else if (whole > 0) begin
                assert (left > 0 && left - done_part <= 1 && left >= done_part);
            end else begin
                assert (left <= 0 && done_part - left <= 0 && done_part - left >= -1);
            end
            cover (done && limited && whole == 7);
            cover (done && limited && whole == -7);
        end
    end
`endif
endmodule

`default_nettype wire
