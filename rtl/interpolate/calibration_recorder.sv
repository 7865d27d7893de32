// SPDX-License-Identifier: Apache-2.0
// calibration_recorder -- keep a burst of samples or phases at equal times, for the firmware to
// learn from at its own pace.
//
// latency  full rises 1 clk after the last one kept; word is the first one 2 clk after full, the
//          next one 2 clk after read; the first one again after the last
// rate     one sample or phase per clk while it records; one word per 2 clk while it is read
// model    tb/interpolate/calibration_recorder.py, equal in decimation bit of decimation cycle
// proof    depth 16, W = 8, DEPTH = 2
// proved   full exactly when DEPTH samples or 2 DEPTH phases have been kept since start; nothing is
//          written then; invalid exactly when disturbed was up meanwhile
`default_nettype none

module calibration_recorder #(
    parameter int W     = 8,    // bits of a sample
    parameter int DEPTH = 1024  // samples of a burst, half its phases; a power of two
) (
    input wire clk,
    input wire rst,  // records nothing
    input wire start,  // strobe: a new burst from the next clk on; the old one is lost
    input wire phases,  // 1: phases, 0: samples; stands while a burst is recorded
    input  wire        [15:0]    decimation,     // keep one of so many, the first one at once; 0 is taken as 1; stands meanwhile
    input wire sampled,  // strobe: sin and cos are new
    input wire signed [W-1:0] sin,  // as the converter gave them
    input wire signed [W-1:0] cos,
    input wire phase_valid,  // strobe: phase is new
    input wire [15:0] phase,  // before harmonic_correction
    input wire disturbed,  // level: the signal is not to be learned from
    input wire read,  // strobe: go on to the next word
    output logic       [31:0]    word,      // {cos, sin}, 16 bits each, full scale 2^15; or {later phase, earlier phase}
    output logic full,  // level: the burst is complete
    output logic invalid  // level: disturbed has been up since start
);
    if (W < 8 || W > 16) begin : g_check_w
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end
    if (DEPTH < 2 || (DEPTH & (DEPTH - 1)) != 0) begin : g_check_depth
        DEPTH_MUST_BE_A_POWER_OF_TWO u_error ();
    end

    localparam int A = $clog2(DEPTH);

    logic [31:0] burst     [0:DEPTH-1];
    logic        recording;
    logic [A-1:0] kept, next;  // words kept, the word to be read
    logic [15:0] left;  // strobes to pass over
    logic        half;  // the earlier phase of a word waits
    logic [15:0] earlier;

    wire         strobe = phases ? phase_valid : sampled;
    wire         due = recording && strobe && left == '0;
    wire         keep = due && (!phases || half);
    wire  [15:0] sin_16 = 16'(sin) << (16 - W);
    wire  [15:0] cos_16 = 16'(cos) << (16 - W);

    always_ff @(posedge clk) begin
        if (keep) burst[kept] <= phases ? {phase, earlier} : {cos_16, sin_16};
        word <= burst[next];
    end

    always_ff @(posedge clk) begin
        if (recording && disturbed) invalid <= 1'b1;
        if (recording && strobe)
            left <= left != '0 ? left - 1'b1 : decimation == '0 ? '0 : decimation - 1'b1;
        if (due) begin
            half    <= phases && !half;
            earlier <= phase;
        end
        if (keep) begin
            kept <= kept + 1'b1;
            if (&kept) begin
                recording <= 1'b0;
                full      <= 1'b1;
            end
        end
        if (full && read) next <= next + 1'b1;
        if (start) begin
            recording <= 1'b1;
            full      <= 1'b0;
            invalid   <= 1'b0;
            kept      <= '0;
            next      <= '0;
            left      <= '0;
            half      <= 1'b0;
        end
        if (rst) begin
            recording <= 1'b0;
            full      <= 1'b0;
            invalid   <= 1'b0;
            kept      <= '0;
            next      <= '0;
            left      <= '0;
            half      <= 1'b0;
        end
    end

`ifdef FORMAL
    logic         past = 1'b0;
    (* anyconst *)logic         lawful;  // which of the two is recorded
    logic [A+1:0] count;  // halves of a word kept since start
    logic         seen;  // disturbed since start
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (phases == lawful);
        count <= rst || start ? '0 : count + (due ? (A + 2)'(2 - 32'(phases)) : '0);
        seen  <= rst || start ? 1'b0 : seen || (recording && disturbed);
        if (past) begin
            assert (!(full && recording));
            assert (count <= (A + 2)'(2 * DEPTH));
            assert (full == (count == (A + 2)'(2 * DEPTH)));
            assert (kept == A'(count >> 1) && half == count[0] && (phases || !half));
            assert (invalid == seen);
        end
        if (past && !$past(rst) && !$past(start) && $past(full)) begin
            assert (full && !$past(keep) && invalid == $past(invalid));
            cover (word == 32'h5678_1234);
        end
    end
`endif
endmodule

`default_nettype wire
