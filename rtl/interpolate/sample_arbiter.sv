// SPDX-License-Identifier: Apache-2.0
// sample_arbiter -- hand the samples of several axes to one chain, one sample per cycle.
//
// latency  1 cycle from valid to done for the axis that is served first; 1 cycle more for each axis
//          with a lower number whose sample waits, too
// rate     one sample per cycle, of all axes together
// behaviour  The sample of the axis with the lowest number is served first. A sample must hold its
//          value until the next one of its axis. If that one comes while its predecessor waits, the
//          predecessor is lost and overrun reports it.
// model    tb/interpolate/sample_arbiter.py, equal in every bit of every cycle
// proved   If the samples of each axis are at least AXES cycles apart, none is lost, and axis n is
//          served n + 1 cycles after valid at the latest. In any case each sample is either served
//          once or reported as lost.
// proof    depth 6, AXES = 8, W = 1
`default_nettype none

module sample_arbiter #(
    parameter  int AXES = 8,                            // axes that are served, 2 to 16
    parameter  int W    = 8,                            // bits of a sample
    // bits of the number of an axis
    localparam int A    = AXES == 1 ? 1 : $clog2(AXES)
) (
    input  wire                      clk,
    input  wire                      rst,      // level: drops the samples that wait
    // samples, bit n or the bits from W n on: axis n
    input  wire         [  AXES-1:0] valid,    // strobes: a new sample
    input  wire         [W*AXES-1:0] sin,      // counts; held until the next sample
    input  wire         [W*AXES-1:0] cos,      // counts; held until the next sample
    // sample that is served
    output logic                     done,     // strobe: axis, sin_out and cos_out are new
    output logic        [     A-1:0] axis,     // number of its axis
    output logic signed [     W-1:0] sin_out,  // counts
    output logic signed [     W-1:0] cos_out,  // counts
    output logic        [  AXES-1:0] overrun   // strobes: a sample of axis n was lost
);
    if (AXES < 2 || AXES > 16) begin : g_check
        AXES_MUST_BE_FROM_2_TO_16 u_error ();
    end

    logic [AXES-1:0] waiting;
    wire  [AXES-1:0] due = waiting | valid;
    wire  [AXES-1:0] first = due & -due;  // the lowest bit that is set

    logic [   A-1:0] number;
    logic [W-1:0] first_sin, first_cos;
    always_comb begin
        number    = '0;
        first_sin = '0;
        first_cos = '0;
        for (int n = 0; n < AXES; n++) begin
            number    = number | ({A{first[n]}} & A'(n));
            first_sin = first_sin | ({W{first[n]}} & sin[W*n+:W]);
            first_cos = first_cos | ({W{first[n]}} & cos[W*n+:W]);
        end
    end

    always_ff @(posedge clk) begin
        waiting <= due & ~first;
        done    <= due != '0;
        axis    <= number;
        sin_out <= $signed(first_sin);
        cos_out <= $signed(first_cos);
        overrun <= valid & waiting;
        if (rst) begin
            waiting <= '0;
            done    <= 1'b0;
            overrun <= '0;
        end
    end

`ifdef FORMAL
    (* anyconst *)logic              spaced;  // the samples of each axis are AXES cycles apart
    logic              past = 1'b0;
    logic [5*AXES-1:0] since;  // cycles since the last sample of each axis, up to AXES
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        cover (past && spaced && done && axis == 3 && overrun == '0);
        cover (past && overrun != '0);
    end
    for (genvar n = 0; n < AXES; n++) begin : g_axis
        logic [1:0] held;  // samples that came and were neither served nor lost
        wire        served = done && axis == A'(n);
        wire  [4:0] age = since[5*n+:5];
        always @(posedge clk) begin
            since[5*n+:5] <= valid[n] ? 5'd1 : age == 5'(AXES) ? age : age + 1'b1;
            held          <= held + 2'(valid[n]) - 2'(served) - 2'(overrun[n]);
            if (spaced && valid[n]) assume (age == 5'(AXES));
            if (rst) begin
                since[5*n+:5] <= 5'(AXES);
                held          <= '0;
            end
            if (past) begin
                assert (age >= 1 && age <= AXES);
                assert (held == 2'(waiting[n]) + 2'(served) + 2'(overrun[n]));
                if (served) assert (sin_out == $signed($past(sin[W*n+:W])));
                // the claim
                if (spaced) begin
                    assert (!overrun[n]);
                    if (waiting[n]) assert (age <= 5'(n));
                    if (served) assert (age <= 5'(n + 1));
                end
            end
        end
    end
    // An axis waits while axes with lower numbers are served. As long as one of the axes 0 to m is
    // due, each of them sends one sample at most, so they keep the chain busy for m + 1 cycles.
    for (genvar m = 0; m < AXES - 1; m++) begin : g_busy
        logic [4:0] busy;  // cycles in a row in which one of them was due
        logic [4:0] came, left;  // their samples in that time; those that still wait
        always_comb begin
            came = '0;
            left = '0;
            for (int n = 0; n <= m; n++) begin
                came = came + 5'(since[5*n+:5] <= busy);
                left = left + 5'(waiting[n]);
            end
        end
        always @(posedge clk) begin
            busy <= due[m:0] != '0 ? busy + 1'b1 : '0;
            if (rst) busy <= '0;
            if (past && spaced) begin
                assert (came == busy + left);
                if (waiting[m+1]) assert (since[5*(m+1)+:5] <= busy);
            end
        end
    end
`endif
endmodule

`default_nettype wire
