// SPDX-License-Identifier: Apache-2.0
// arctan_table -- compute the phase of a sine and a cosine sample by a table: 2^16 atan2(sin, cos)
// / 2 pi, from 0 to one LSB below a period.
//
// latency  23 cycles from valid to done
// rate     one sample per 23 cycles; a sample that arrives sooner is ignored
// accuracy within 0.633 LSB of the true phase of any sample except (0, 0), for any W; exact at
//          every octant border; (0, 0) gives 0
// method   The ratio of the components comes from a restoring division, one bit per cycle; a table
//          of chords gives the arctangent.
// source   S0: octant-folded arctan look-up with the constants 0, n/4, n/2, 3n/4
// model    tb/interpolate/arctan_table.py, equal in every bit of every cycle; bound and table from
//          tables/arctan.py
`default_nettype none

module arctan_table #(
    parameter int W = 8  // bits of a sample, 8 to 16
) (
    input  wire                clk,
    input  wire                rst,    // level: drops the sample in progress; phase becomes 0
    input  wire                valid,  // strobe: sin and cos are a new sample
    input  wire signed [W-1:0] sin,    // counts, full scale = 2^(W-1)
    input  wire signed [W-1:0] cos,    // counts, full scale = 2^(W-1)
    output logic               done,   // strobe: phase is new
    output logic       [ 15:0] phase   // 2^-16 period; held until the next sample
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    // made by tables/arctan.py, not to be edited
    localparam int RATIO = 16;  // fraction bits of the ratio
    localparam int FRACTION = 9;  // bits of the ratio along the chord
    localparam int GUARD = 5;  // bits of base and slope below the phase LSB
    // end of the made constants

    localparam [4:0] IDLE = 5'd0, FOLD = 5'd1, DIVIDE = 5'd2;
    localparam [4:0] LOOK_UP = DIVIDE + 5'(RATIO + 1);
    localparam [4:0] MULTIPLY = LOOK_UP + 5'd1;
    localparam [4:0] ADD = MULTIPLY + 5'd1;
    localparam [4:0] UNFOLD = ADD + 5'd1;

    logic [4:0] stage;
    // steep: |sin| > |cos|, in octants 2, 3, 6, 7
    logic sin_negative, cos_negative, steep;
    logic [W-1:0] sin_size, cos_size, divisor;  // |-2^(W-1)| fits without a sign
    logic [    W:0] remainder;
    logic [RATIO:0] ratio;  // smaller / larger, 1.0 = 2^RATIO
    // along the chord, LSB / 2^(GUARD + FRACTION)
    logic [   27:0] product;
    logic [   13:0] octant;  // LSB of phase, 0 to 2^13

    wire            steeper = sin_size > cos_size;
    wire  [  W-1:0] larger = steeper ? sin_size : cos_size;
    wire            goes = remainder >= {1'b0, divisor};
    wire  [  W-1:0] reduced = W'(goes ? remainder - {1'b0, divisor} : remainder);

    wire  [   18:0] base;
    wire  [   11:0] slope;
    arctan_rom u_rom (
        .clk,
        .index(ratio[RATIO:FRACTION]),
        .base,
        .slope
    );

    wire [27:0] chord = {base, FRACTION'(0)} + product;
    wire [15:0] first = steep ? 16'h4000 - 16'(octant) : 16'(octant);
    wire [15:0] half = cos_negative ? 16'h8000 - first : first;

    always_ff @(posedge clk) begin
        done  <= stage == UNFOLD;
        stage <= stage == IDLE || stage == UNFOLD ? IDLE : stage + 1'b1;
        if (stage == IDLE && valid) begin
            sin_negative <= sin[W-1];
            cos_negative <= cos[W-1];
            sin_size     <= sin[W-1] ? -sin : sin;
            cos_size     <= cos[W-1] ? -cos : cos;
            stage        <= FOLD;
        end
        if (stage == FOLD) begin
            steep     <= steeper;
            remainder <= {1'b0, steeper ? cos_size : sin_size};
            divisor   <= larger | W'(larger == '0);         // (0, 0): 0 / 1
        end
        if (stage >= DIVIDE && stage < LOOK_UP) begin
            ratio     <= {ratio[RATIO-1:0], goes};
            remainder <= {reduced, 1'b0};
        end
        if (stage == MULTIPLY) product <= 28'(slope) * 28'(ratio[FRACTION-1:0]);
        if (stage == ADD) octant <= 14'(chord >> (GUARD + FRACTION));
        if (stage == UNFOLD) phase <= sin_negative ? -half : half;
        if (rst) begin
            stage <= IDLE;
            done  <= 1'b0;
            phase <= '0;
        end
    end
endmodule

`default_nettype wire
