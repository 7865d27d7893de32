// SPDX-License-Identifier: Apache-2.0
// arctan_pipelined -- compute phase and amplitude of a sine and a cosine sample: 2^16 atan2(sin,
// cos) / 2 pi, and their length.
//
// latency  24, 28 or 29 cycles from valid to done for W of 8, 9 or 10; 23 cycles for wider samples;
//          divided by STEPS and rounded up
// rate     one sample per cycle
// accuracy phase: every sample of 8, 9 and 10 bits is correctly rounded; wider ones are within
//          0.548 LSB of the true phase from a quarter of full scale on (all samples of 12 bits
//          were tried: 0.510). amplitude: within 1.5 counts plus 0.00015 of itself. (0, 0) gives 0
//          and 0.
// method   CORDIC in vectoring mode, after TURNS digits as a division. The shorter component is
//          doubled at each digit (Y = 2^i y), so both components lose one bit per digit; the
//          angles of four or five digits come from one look-up.
// source   Volder, IRE Trans. EC-8 (1959) 330
// model    tb/interpolate/arctan_pipelined.py, equal in every bit of every cycle; bound and angles
//          from tables/arctan_rotation.py
`default_nettype none

module arctan_pipelined #(
    parameter int W     = 12,  // bits of a sample, 8 to 16
    parameter int STEPS = 1    // steps from one register to the next
) (
    input  wire                clk,
    input  wire                rst,       // level: drops all samples, outputs become 0
    input  wire                valid,     // strobe: sin and cos are a new sample
    input  wire signed [W-1:0] sin,       // counts, full scale = 2^(W-1)
    input  wire signed [W-1:0] cos,       // counts, full scale = 2^(W-1)
    output logic               done,      // strobe: phase and amplitude are new
    output logic       [ 15:0] phase,     // 2^-16 period; held until the next sample
    output logic       [W-1:0] amplitude  // counts of the ADC; held until the next sample
);
    if (W < 8 || W > 16) begin : g_check_w
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end
    if (STEPS < 1) begin : g_check_steps
        STEPS_MUST_BE_AT_LEAST_1 u_error ();
    end

    // made by tables/arctan_rotation.py, not to be edited
    localparam int TURNS = W == 8 ? 8 : W == 9 ? 9 : W == 10 ? 10 : 6;
    localparam int DIGITS = W == 8 ? 23 : W == 9 ? 27 : W == 10 ? 28 : 22;
    localparam int GUARD = W == 8 ? 12 : W == 9 ? 15 : W == 10 ? 16 : 9;
    localparam int ROW = 232 * (W - 8);  // one row per W, one signed byte per step
    // fraction bits of longer after each step, step 0 at the right
    // (a negative number: integer bits that are dropped)
    localparam [9*232-1:0] LONGER = {
        232'h000000000000f4f5f6f7f8f9fafbfcfdfeff0001020203040503010000,  // W = 16
        232'h000000000000f5f6f7f8f9fafbfcfdfeff000102030304050603010000,  // W = 15
        232'h000000000000f6f7f8f9fafbfcfdfeff00010203040405060603010000,  // W = 14
        232'h000000000000f7f8f9fafbfcfdfeff0001020304050506070603010000,  // W = 13
        232'h000000000000f8f9fafbfcfdfeff000102030405060607080603010000,  // W = 12
        232'h000000000000f9fafbfcfdfeff00010203040506070708090603010000,  // W = 11
        232'hfcfdfeff000102030405060708090a0b0c0c0d0e0f100f0a0603010000,  // W = 10
        232'h00fbfcfdfeff000102030405060708090a0b0b0c0d0e0f0a0603010000,  // W = 9
        232'h0000000000fcfdfeff00010203040506070809090a0b0c0a0603010000  // W = 8
    };
    // fraction bits of shorter after each step
    localparam [9*232-1:0] SHORTER = {
        232'h000000000000f4f5f6f7f8f9fafbfcfdfeff0001020304050301000000,  // W = 16
        232'h000000000000f5f6f7f8f9fafbfcfdfeff000102030405060301000000,  // W = 15
        232'h000000000000f6f7f8f9fafbfcfdfeff00010203040506060301000000,  // W = 14
        232'h000000000000f7f8f9fafbfcfdfeff0001020304050607060301000000,  // W = 13
        232'h000000000000f8f9fafbfcfdfeff000102030405060708060301000000,  // W = 12
        232'h000000000000f9fafbfcfdfeff00010203040506070809060301000000,  // W = 11
        232'hfcfdfeff000102030405060708090a0b0c0d0e0f100f0a060301000000,  // W = 10
        232'h00fbfcfdfeff000102030405060708090a0b0c0d0e0f0a060301000000,  // W = 9
        232'h0000000000fcfdfeff000102030405060708090a0b0c0a060301000000  // W = 8
    };
    // digits whose angles are in the sum after each step
    localparam [9*232-1:0] SUMMED = {
        232'h000000000000111111110c0c0c0c0c0808080804040404000000000000,  // W = 16
        232'h000000000000111111110c0c0c0c0c0808080804040404000000000000,  // W = 15
        232'h000000000000111111110c0c0c0c0c0808080804040404000000000000,  // W = 14
        232'h000000000000111111110c0c0c0c0c0808080804040404000000000000,  // W = 13
        232'h000000000000111111110c0c0c0c0c0808080804040404000000000000,  // W = 12
        232'h000000000000111111110c0c0c0c0c0808080804040404000000000000,  // W = 11
        232'h1717171712121212120e0e0e0e0a0a0a0a060606060202020200000000,  // W = 10
        232'h001616161611111111110d0d0d0d090909090505050501010101000000,  // W = 9
        232'h0000000000121212120d0d0d0d0d090909090505050501010101000000  // W = 8
    };
    // end of the made constants

    localparam int LAST = DIGITS + 1;  // the last step
    localparam int LATENCY = (LAST + STEPS - 1) / STEPS;
    localparam int Z = 16 + GUARD;

    logic [LATENCY-1:0] coming;
    wire  [  LATENCY:0] strobes = {coming, valid};

    for (genvar t = 1; t < LAST; t++) begin : g_step
        localparam int L = 32'($signed(LONGER[ROW+8*t+:8]));
        localparam int L_IN = 32'($signed(LONGER[ROW+8*(t-1)+:8]));
        localparam int S = 32'($signed(SHORTER[ROW+8*t+:8]));
        localparam int S_IN = 32'($signed(SHORTER[ROW+8*(t-1)+:8]));
        localparam int SUM = 32'(SUMMED[ROW+8*t+:8]);
        localparam int SUM_IN = 32'(SUMMED[ROW+8*(t-1)+:8]);
        /* verilator lint_off UNUSEDSIGNAL */  // the synthesis removes what no later step needs
        // rotated to the axis it becomes the amplitude
        logic [W+L-1:0] longer, longer_q;
        // 2^(t-2) times the component across, less 1 (less 1/2 from TURNS + 3 on)
        logic signed [W+S:0] shorter, shorter_q;
        logic [DIGITS:1] turned, turned_q;  // one bit per digit: 1 is a negative one
        // angle at which the digits start, and their direction
        logic [1:0] quadrant, quadrant_q;
        logic zero, zero_q;  // the sample is (0, 0)
        logic [Z-1:0] angle, angle_q;  // sum of the angles, including half an LSB
        logic [W:0] size, size_q;  // amplitude in halves
        // to be subtracted from it for the gain of the rotations
        logic [W-2:0] part, part_q;
        /* verilator lint_on UNUSEDSIGNAL */

        if (t % STEPS == 0) begin : g_held
            always_ff @(posedge clk)
                if (strobes[t/STEPS-1]) begin
                    longer_q   <= longer;
                    shorter_q  <= shorter;
                    turned_q   <= turned;
                    quadrant_q <= quadrant;
                    zero_q     <= zero;
                    angle_q    <= angle;
                    size_q     <= size;
                    part_q     <= part;
                end
        end else begin : g_passed
            assign longer_q   = longer;
            assign shorter_q  = shorter;
            assign turned_q   = turned;
            assign quadrant_q = quadrant;
            assign zero_q     = zero;
            assign angle_q    = angle;
            assign size_q     = size;
            assign part_q     = part;
        end

        if (t == 1) begin : g_fold
            wire [W-1:0] sin_size = sin ^ {W{sin[W-1]}};  // one too small if negative
            wire [W-1:0] cos_size = cos ^ {W{cos[W-1]}};
            wire steep = 1'(({1'b0, cos_size, cos[W-1]} - {1'b0, sin_size, sin[W-1]}) >> (W + 1));
            assign longer   = sin_size + W'(sin[W-1]);              // not yet sorted
            assign shorter  = {1'b0, cos_size + W'(cos[W-1])};
            assign turned   = {{(DIGITS - 1){1'b0}}, steep ^ sin[W-1] ^ cos[W-1]};
            assign quadrant = {steep ? sin[W-1] : cos[W-1], steep};
            assign zero     = 1'b0;
        end else begin : g_later
            assign quadrant = g_step[t-1].quadrant_q;
            assign zero     = t == 3 ? g_step[t-1].longer_q == '0 : g_step[t-1].zero_q;
        end

        // digit 1 is the direction: above the axis it is positive
        if (t == 2) begin : g_first
            wire [W-1:0] x = quadrant[0] ? g_step[1].longer_q : g_step[1].shorter_q[W-1:0];
            wire [W-1:0] y = quadrant[0] ? g_step[1].shorter_q[W-1:0] : g_step[1].longer_q;
            assign longer  = {x, 1'b0} + {1'b0, y};
            assign shorter = (W+1)'(({y, 2'b00} - {1'b0, x, 1'b1}) >> 1);
            assign turned  = g_step[1].turned_q;
        end

        if (t > 2) begin : g_digit
            wire [W+L_IN-1:0] x = g_step[t-1].longer_q;
            wire              negative = g_step[t-1].shorter_q[W+S_IN];
            wire [W+S_IN-1:0] y = g_step[t-1].shorter_q[W+S_IN-1:0] ^ {(W + S_IN) {negative}};
            wire [     W+S:0] y_twice = (W + S + 1)'({y, {20{!negative}}} >> (19 + S_IN - S));
            wire [     W+S:0] x_once = (W + S + 1)'({x, 20'd0} >> (20 + L_IN - S));
            wire              x_half = 1'({x, 20'd0} >> (19 + L_IN - S));
            wire              less = t <= TURNS + 3 ? negative : x_half;
            assign shorter = (W + S + 1)'(({y_twice, 1'b0} - {x_once, less}) >> 1);
            wire [DIGITS-1:0] new_digit = DIGITS'(g_step[t-1].turned_q[t-2] ^ negative);
            assign turned = g_step[t-1].turned_q | new_digit << (t - 2);
            if (t <= TURNS + 1) begin : g_turn
                localparam int DOWN = S_IN + 2 * t - 3 - L;
                wire [W+L-1:0] x_now = (W + L)'({x, 20'd0} >> (20 + L_IN - L));
                wire           more = DOWN == 0 ? !negative : 1'({y, 1'b0} >> DOWN);
                assign longer = (W + L)'(({x_now, 1'b1} + {(W + L)'(y >> DOWN), more}) >> 1);
            end else begin : g_turned
                assign longer = (W + L)'(x >> (L_IN - L));
            end
        end

        if (SUM == 0) begin : g_none
            assign angle = '0;
        end else if (SUM == SUM_IN) begin : g_keep
            assign angle = g_step[t-1].angle_q;
        end else begin : g_sum
            wire signed [Z-SUM_IN-2:0] sum;
            arctan_rotation_rom #(
                .TURNS(TURNS),
                .FIRST(SUM_IN + 1),
                .COUNT(SUM - SUM_IN),
                .GUARD(GUARD)
            ) u_rom (
                .negative(g_step[t-1].turned_q[SUM:SUM_IN+1]),
                .sum
            );
            if (SUM_IN == 0) begin : g_base
                assign angle = {quadrant - 2'(sum[Z-2]), sum[Z-3:0]};
            end else begin : g_more
                assign angle = g_step[t-1].angle_q + Z'(sum);
            end
        end

        if (t < TURNS + 2) begin : g_turning
            assign size = '0;
            assign part = '0;
        end else if (t == TURNS + 2) begin : g_part
            // 1 / gain of the rotations = 1 - 2^-3 - 2^-6 - 2^-11
            assign size = (W+1)'(g_step[t-1].longer_q >> (L_IN - 1));
            assign part = (W-1)'((W-4)'(size >> 6) + (W-4)'(size >> 11));
        end else if (t == TURNS + 3) begin : g_parts
            assign size = g_step[t-1].size_q;
            assign part = g_step[t-1].part_q + (W-1)'(size >> 3);
        end else if (t == TURNS + 4) begin : g_less
            assign size = g_step[t-1].size_q - (W+1)'(g_step[t-1].part_q);
            assign part = '0;
        end else begin : g_sized
            assign size = g_step[t-1].size_q;
            assign part = '0;
        end
    end

    wire signed [Z-DIGITS+3:0] last_sum;
    localparam int S_LAST = 32'($signed(SHORTER[ROW+8*(LAST-1)+:8]));
    wire negative = g_step[LAST-1].shorter_q[W+S_LAST];
    arctan_rotation_rom #(
        .TURNS(TURNS),
        .FIRST(DIGITS - 4),
        .COUNT(5),
        .GUARD(GUARD)
    ) u_rest (
        .negative({
            g_step[LAST-1].turned_q[DIGITS-1] ^ negative, g_step[LAST-1].turned_q[DIGITS-1:DIGITS-4]
        }),
        .sum(last_sum)
    );
    wire [Z-1:0] total = g_step[LAST-1].angle_q + Z'(last_sum);

    always_ff @(posedge clk) begin
        coming <= strobes[LATENCY-1:0];
        if (strobes[LATENCY-1]) begin
            phase     <= 16'(total >> GUARD);
            amplitude <= g_step[LAST-1].size_q[W:1];
        end
        if (rst || (strobes[LATENCY-1] && g_step[LAST-1].zero_q)) begin
            phase     <= '0;
            amplitude <= '0;
        end
        if (rst) coming <= '0;
    end
    assign done = coming[LATENCY-1];
endmodule

`default_nettype wire
