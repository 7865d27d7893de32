// SPDX-License-Identifier: Apache-2.0
// calibration_recorder -- record a burst of samples or phases at equal intervals, so that the
// firmware can compute a calibration from it in its own time.
//
// latency  1 cycle from the last recorded sample to full; 2 cycles from full to the first word and
//          from read to the next word
// rate     one sample or phase per cycle while it records; one word per 2 cycles while it is read
// behaviour After the last word the first one follows again. A new burst overwrites the old one.
//          phases and decimation must not change while a burst is recorded. Phases are taken
//          before harmonic_correction.
// model    tb/interpolate/calibration_recorder.py, equal in every bit of every cycle
// proved   full is high exactly when DEPTH samples or 2 DEPTH phases have been recorded since
//          start; nothing is written then; invalid is high exactly when disturbed was high
//          meanwhile
// proof    depth 16, W = 8, DEPTH = 2
//
// A word is {cos, sin} of 16 bits each with full scale 2^15, or {later phase, earlier phase}.
`default_nettype none

module calibration_recorder #(
    parameter int W     = 8,    // bits of a sample, 8 to 16
    parameter int DEPTH = 1024  // samples of a burst, half its phases; a power of two
) (
    input  wire                clk,
    input  wire                rst,          // level: recording stops, the burst is lost
    input  wire                start,        // strobe: record a new burst from the next cycle on
    input  wire                phases,       // level: 1: record phases, 0: samples
    input  wire        [ 15:0] decimation,   // keep one in this many, the first too; 0 acts as 1
    input  wire                sampled,      // strobe: sin and cos are new
    input  wire signed [W-1:0] sin,          // counts of the ADC, full scale = 2^(W-1)
    input  wire signed [W-1:0] cos,          // counts of the ADC, full scale = 2^(W-1)
    input  wire                phase_valid,  // strobe: phase is new
    input  wire        [ 15:0] phase,        // 2^-16 period
    input  wire                disturbed,    // level: the signal is not fit for a calibration
    input  wire                read,         // strobe: go on to the next word
    output logic       [ 31:0] word,         // two samples or two phases of 16 bits
    output logic               full,         // level: the burst is complete
    output logic               invalid       // level: disturbed was high during the burst
);
    if (W < 8 || W > 16) begin : g_check_w
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end
    if (DEPTH < 2 || (DEPTH & (DEPTH - 1)) != 0) begin : g_check_depth
        DEPTH_MUST_BE_A_POWER_OF_TWO u_error ();
    end

    localparam int A = $clog2(DEPTH);

    logic [ 31:0] burst                                                                [0:DEPTH-1];
    logic         recording;
    logic [A-1:0] place;  // words recorded; then the address of the word to be read
    logic         first;  // nothing has been recorded since start
    logic [ 15:0] passed;  // strobes since the last one that was recorded
    logic         half;  // the earlier phase of a word has been recorded
    logic [ 15:0] earlier;

    wire  [ 15:0] sin_16 = 16'(sin) << (16 - W);
    wire  [ 15:0] cos_16 = 16'(cos) << (16 - W);
    wire          strobe = recording && (phases ? phase_valid : sampled);
    wire  [ 15:0] passing = passed + 1'b1;
    wire          due = strobe && (first || passing == decimation || decimation == '0);
    wire          keep = due && (!phases || half);

    always_ff @(posedge clk) begin
        // one port: a burst is read when it is complete
        if (keep) burst[place] <= phases ? {phase, earlier} : {cos_16, sin_16};
        else word <= burst[place];
    end

    always_ff @(posedge clk) begin
        if (recording && disturbed) invalid <= 1'b1;
        if (strobe) passed <= due ? '0 : passing;
        if (due) begin
            first <= 1'b0;
            half  <= phases && !half;
            earlier <= phase;
        end
        if (keep && &place) begin
            recording <= 1'b0;
            full      <= 1'b1;
        end
        if (keep || (full && read)) place <= place + 1'b1;
        if (start) begin
            recording <= 1'b1;
            full      <= 1'b0;
            invalid   <= 1'b0;
            place     <= '0;
            passed    <= '0;
            first     <= 1'b1;
            half      <= 1'b0;
        end
        if (rst) begin
            recording <= 1'b0;
            full      <= 1'b0;
            invalid   <= 1'b0;
            place     <= '0;
            passed    <= '0;
            half      <= 1'b0;
        end
    end

`ifdef FORMAL
    logic         past = 1'b0;
    (* anyconst *)logic         of_phases;  // phases are recorded, not samples
    logic [A+1:0] count;  // halves of words recorded since start
    logic         seen;  // disturbed since start
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (phases == of_phases);
        count <= rst || start ? '0 : count + (due ? (A + 2)'(2 - 32'(phases)) : '0);
        seen  <= rst || start ? 1'b0 : seen || (recording && disturbed);
        if (past) begin
            assert (!(full && recording));
            assert (count <= (A + 2)'(2 * DEPTH));
            assert (full == (count == (A + 2)'(2 * DEPTH)));
            if (!full) assert (place == A'(count >> 1));
            assert (half == count[0] && (phases || !half));
            assert (invalid == seen);
        end
        if (past && !$past(rst) && !$past(start) && $past(full)) begin
            assert (full && !keep && invalid == $past(invalid));
            cover (word == 32'h5678_1234);
        end
    end
`endif
endmodule

`default_nettype wire
