// SPDX-License-Identifier: Apache-2.0
// count_phase_check -- compare the interpolated position with the x4 count of the same signals, so
// that a lost fringe is detected.
//
// latency  3 cycles from valid to disagreement
// rate     one step per cycle
// method   The steps of the position are added up, and the count is subtracted. The difference is 0
//          when both move alike, wherever the origin is: a shift of the origin changes nothing. It
//          is exact modulo 2^16 periods; so many lost ones in a row would not be seen.
// behaviour  The position at which both agree is learned from the first step after reset or after
//          `learn`, and from every step while limit is 0. `learn` also ends a disagreement, in the
//          next cycle. With AXES above 1 it serves several axes; step, count and limit must be
//          those of the axis of the step.
// limits   `limit` must cover the quarter period between two counts, the offset of the two
//          comparators, and twice the distance travelled while the deglitchers delay an edge: the
//          count lags that distance in each direction.
// source   S0: the fringe count and the arctangent come from the same two photodetectors
// model    tb/position/count_phase_check.py, equal in every bit of every cycle
// proved   there is no disagreement while limit is 0, none while the steps move the position by as
//          much as the count, and none of steps until `learn`
// proof    depth 8
`default_nettype none

module count_phase_check #(
    parameter  int AXES = 1,                            // axes that are served
    // bits of the number of an axis
    localparam int A    = AXES == 1 ? 1 : $clog2(AXES)
) (
    input  wire                   clk,
    input  wire                   rst,          // level: clears disagreement, learns again
    input  wire        [AXES-1:0] learn,        // levels: learn at the next step of axis n
    input  wire                   valid,        // strobe: the position moves by step
    input  wire        [   A-1:0] axis,         // number of its axis; 0 for one axis
    input  wire signed [    16:0] step,         // 2^-16 period
    input  wire signed [    31:0] count,        // 1/4 period, wraps
    input  wire        [    19:0] limit,        // 2^-16 period; 0: not checked
    output logic       [AXES-1:0] disagreement  // levels: the two differ by more than limit
);
    localparam int D = 32;  // bits of the difference, which wraps at 2^16 periods

    logic [AXES-1:0] known;
    logic measured, compared, learned, learned_q;
    logic [A-1:0] axis_q, axis_qq;
    logic [D-15:0] count_q;
    logic [19:0] limit_q, limit_qq;
    logic        [D-1:0] moved_q;
    logic signed [D-1:0] difference;

    // the sum of the steps, from the count at which it was learned
    wire         [D-1:0] travelled;
    wire         [D-1:0] moved = travelled + D'(step);
    wire                 learns = !known[axis] || limit == '0;
    wire                 negative = difference[D-1];
    // the size; one less if negative
    wire         [D-1:0] size = negative ? ~difference : difference;
    // beyond 2^20 it is too large for any limit
    wire                 far = size[D-1:20] != '0;
    wire                 beyond = {size[19:0], negative} > {limit_qq, 1'b0};

    axis_memory #(
        .AXES (AXES),
        .WIDTH(D)
    ) u_travelled (
        .clk,
        .write     (valid),
        .write_axis(axis),
        .value     (learns ? {count[D-15:0], 14'b0} : moved),
        .axis,
        .stored    (travelled)
    );

    always_ff @(posedge clk) begin
        measured   <= valid;
        axis_q     <= axis;
        learned    <= learns || learn[axis];
        moved_q    <= moved;
        count_q    <= count[D-15:0];
        limit_q    <= limit;
        compared   <= measured;
        axis_qq    <= axis_q;
        learned_q  <= learned || learn[axis_q];
        limit_qq   <= limit_q;
        difference <= {moved_q[D-1:14] - count_q, moved_q[13:0]};
        if (compared) disagreement[axis_qq] <= !learned_q && (far || beyond);
        for (int n = 0; n < AXES; n++) if (learn[n]) disagreement[n] <= 1'b0;
        known <= (known | (AXES'(valid) << axis)) & ~learn;
        if (rst) begin
            known        <= '0;
            measured     <= 1'b0;
            compared     <= 1'b0;
            disagreement <= '0;
        end
    end

    wire unused = &{1'b0, count[31:D-14]};

`ifdef FORMAL
    (* anyconst *)logic          alike;  // the steps are those of the count
    logic          past = 1'b0;
    logic [  31:0] last;  // count at the last step
    wire  [  45:0] travelled_count = {count - last, 14'b0};
    wire  [D-15:0] last_q = last[D-15:0];
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (axis == '0);
        if (valid) last <= count;
        if (alike && valid) assume (46'(step) == travelled_count);
        if (past) begin
            if (compared && limit_qq == 0) assert (learned_q);
            if ($past(compared) && $past(limit_qq) == 0) assert (!disagreement);
            if ($past(learn)) assert (!disagreement && (!compared || learned_q));
            if ($past(learn)) assert (!measured || learned);
            if (alike) begin
                if (known) assert (travelled == {last_q, 14'b0});
                if (measured && !learned) assert (moved_q == {count_q, 14'b0});
                if (compared && !learned_q) assert (difference == 0);
                assert (!disagreement);
            end
            cover (disagreement);
            cover (alike && compared && !learned_q && step != 0 && valid);
        end
    end
`endif
endmodule

`default_nettype wire
