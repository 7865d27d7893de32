// SPDX-License-Identifier: Apache-2.0
// arctan_iterative -- compute phase and amplitude of a sine and a cosine sample, one digit per
// cycle, in a small area.
//
// latency  24, 28 or 30 cycles from valid to done for W of 8, 9 or 10; 23 cycles for wider samples
// rate     one sample per latency; a sample that arrives sooner is ignored
// accuracy phase: every sample of 8, 9 and 10 bits is correctly rounded; wider ones are within
//          0.517 LSB of the true phase from a quarter of full scale on. amplitude: within 1.5
//          counts plus 0.00015 of itself. (0, 0) gives 0 and 0.
// method   CORDIC in vectoring mode, after TURNS digits as a division; the shorter component is
//          doubled at each digit (Y = 2^i y)
// source   Volder, IRE Trans. EC-8 (1959) 330
// model    tb/interpolate/arctan_iterative.py, equal in every bit of every cycle; bound and angles
//          from tables/arctan_rotation.py
`default_nettype none

module arctan_iterative #(
    parameter int W = 8  // bits of a sample, 8 to 16
) (
    input  wire                clk,
    input  wire                rst,       // level: drops the sample, outputs become 0
    input  wire                valid,     // strobe: sin and cos are a new sample
    input  wire signed [W-1:0] sin,       // counts, full scale = 2^(W-1)
    input  wire signed [W-1:0] cos,       // counts, full scale = 2^(W-1)
    output logic               done,      // strobe: phase and amplitude are new
    output logic       [ 15:0] phase,     // 2^-16 period; held until the next sample
    output logic       [W-1:0] amplitude  // counts of the ADC; held until the next sample
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    // made by tables/arctan_rotation.py, not to be edited
    localparam int TURNS = W == 8 ? 7 : W == 9 ? 9 : W == 10 ? 9 : 7;
    localparam int DIGITS = W == 8 ? 23 : W == 9 ? 27 : W == 10 ? 29 : 22;
    localparam int F = W == 8 ? 12 : W == 9 ? 14 : W == 10 ? 16 : 10;
    localparam int GUARD = W == 8 ? 14 : W == 9 ? 16 : W == 10 ? 17 : 11;
    // end of the made constants

    localparam int Z = 16 + GUARD;
    localparam int P = $clog2(TURNS);

    logic        [    4:0] digit;  // found in this cycle; 0: idle
    logic        [W+F-1:0] longer;  // rotated to the axis it becomes the amplitude
    // 2^(digit - 2) times the component across, less 1; at digit 1 the component itself
    logic signed [  W+F:0] shorter;
    logic frame, zero;  // frame: sign of the preceding digit; zero: the sample is (0, 0)
    logic [Z-1:0] angle;  // sum of the angles, including half an LSB
    logic [W+2:0] size;  // amplitude in eighths

    wire [W-1:0] sin_size = sin[W-1] ? -sin : sin;
    wire [W-1:0] cos_size = cos[W-1] ? -cos : cos;
    wire steep = sin_size > cos_size;

    wire first = digit == 5'd1;
    wire negative = shorter[W+F];
    // with `one` added: the magnitude of shorter
    wire [W+F-1:0] magnitude = shorter[W+F-1:0] ^ {(W + F) {negative}};
    wire one = !negative && !first;
    wire turned = frame ^ negative;
    wire [P-1:0] passed = P'(digit - 5'd1);  // digits found; used up to TURNS
    // in halves: the last bit rounds
    wire [W+F:0] along = {1'b0, magnitude} >> {passed, 1'b0};

    wire [Z-1:0] turn[0:31];  // the angle of each digit
    for (genvar n = 0; n < 32; n++) begin : g_turn
        if (n > 0 && n <= DIGITS) begin : g_digit
            wire signed [Z-n-1:0] by;
            arctan_rotation_rom #(
                .TURNS(TURNS),
                .FIRST(n),
                .COUNT(1),
                .GUARD(GUARD)
            ) u_rom (
                .negative(1'b0),
                .sum     (by)
            );
            assign turn[n] = Z'(by) - Z'(n == 1 ? 1 << (GUARD - 1) : 0);
        end else begin : g_none
            assign turn[n] = '0;
        end
    end
    wire [Z-1:0] sum = Z'(({angle, 1'b1} + {turn[digit] ^ {Z{turned}}, turned}) >> 1);

    wire [W+2:0] eighths = longer[W+F-1:F-3];
    wire [  3:0] shift = digit == 5'(TURNS + 2) ? 4'd3 : digit == 5'(TURNS + 3) ? 4'd6 : 4'd11;
    wire [W-1:0] part = W'(eighths >> shift);

    always_ff @(posedge clk) begin
        done <= 1'b0;
        if (digit == '0) begin
            longer  <= {steep ? sin_size : cos_size, F'(0)};
            shorter <= {1'b0, steep ? cos_size : sin_size, F'(0)};
            frame   <= steep ^ sin[W-1] ^ cos[W-1];
            angle   <= {steep ? sin[W-1] : cos[W-1], steep, 14'd0, 1'b1, (GUARD-1)'(0)};
            zero    <= sin == '0 && cos == '0;
            if (valid) digit <= 5'd1;
        end else begin
            digit   <= digit + 5'd1;
            frame   <= turned;
            angle   <= sum;
            shorter <= (W+F+1)'(({magnitude, one, 1'b0} - {1'b0, longer, !one}) >> 1);
            if (digit <= 5'(TURNS)) longer <= (W + F)'(({longer, 1'b1} + along) >> 1);
            // 1 / gain of the rotations = 1 - 2^-3 - 2^-6 - 2^-11
            if (digit == 5'(TURNS + 1)) size <= {eighths[W+2:3], 3'd4};
            else if (digit <= 5'(TURNS + 4)) size <= size - (W + 3)'(part);
            if (digit == 5'(DIGITS)) begin
                digit     <= '0;
                done      <= 1'b1;
                phase     <= 16'(sum >> GUARD);
                amplitude <= size[W+2:3];
            end
        end
        if (rst || (zero && digit == 5'(DIGITS))) begin
            phase     <= '0;
            amplitude <= '0;
        end
        if (rst) begin
            digit <= '0;
            done  <= 1'b0;
        end
    end
endmodule

`default_nettype wire
