// SPDX-License-Identifier: Apache-2.0
// count_to_phase -- turn quadrature counts into steps and phases, so that scales without sine and
// cosine use the same position path.
//
// latency  1 cycle from count_step, align or tick to valid
// rate     one count per cycle
// behaviour align moves the phase, and with it the position, by whole counts: the zero of a scale
//          can so be put on any of its edges.
// source   four counts are one period (S2: 0.5 um scales, S3: 1 um scale); a count is a step of a
//          quarter period
// model    tb/position/count_to_phase.py, equal in every bit of every cycle
// proved   the phase changes by exactly step; only the two top bits of phase are ever set
`default_nettype none

module count_to_phase (
    input  wire                clk,
    input  wire                rst,           // level: phase becomes 0
    input  wire                tick,          // strobe: a phase is required, even without a count
    input  wire signed  [ 1:0] count_step,    // counts: -1, 0, 1
    input  wire                align,         // strobe: move by align_counts
    input  wire signed  [ 2:0] align_counts,  // counts, -2 to 2
    output logic               valid,         // strobe: step and phase are new
    output logic signed [16:0] step,          // 2^-16 period, the change of phase
    output logic        [15:0] phase          // 2^-16 period
);
    wire signed [3:0] counts = 4'(count_step) + (align ? 4'(align_counts) : 4'sd0);

    always_ff @(posedge clk) begin
        valid <= tick || counts != 4'sd0;
        step  <= {counts[2:0], 14'b0};
        phase <= phase + {counts[1:0], 14'b0};
        if (rst) begin
            valid <= 1'b0;
            phase <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (count_step != -2'sd2);
        if (align) assume (align_counts >= -3'sd2 && align_counts <= 3'sd2);
        if (past && !$past(rst)) begin
            assert (phase[13:0] == '0 && phase == 16'($past(phase) + step[15:0]));
            assert (valid || step == '0);
            cover (valid && step == 17'sd3 * 17'sd16384);
        end
    end
`endif
endmodule

`default_nettype wire
