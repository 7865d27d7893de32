// SPDX-License-Identifier: Apache-2.0
// arctan_quotient -- compute the phase of a sine and a cosine sample by a division and a table of
// parabolas: 2^16 atan2(sin, cos) / 2 pi.
//
// latency  12 cycles from valid to done
// rate     one sample per cycle; one per 12 cycles with SAMPLE_CYCLES of 12 or more
// behaviour  Both forms give the same bits. With SAMPLE_CYCLES of 12 or more one pair of adders
//          finds all digits, and a sample that comes too soon replaces the one in progress.
// accuracy within 0.542 LSB of the true phase of any sample except (0, 0), whatever its amplitude;
//          exact at every octant border; (0, 0) gives 0
// method   The smaller component is divided by the larger one, two digits per cycle. A digit is 1
//          or -1, by the signs of remainder and divisor, so no magnitude is needed. The first six
//          digits choose a parabola of the arctangent, the others are the distance from its middle.
// source   non-restoring division of signed numbers: Robertson, IRE Trans. EC-7 (1958) 218
// model    tb/interpolate/arctan_quotient.py, equal in every bit of every cycle; bound and table
//          from tables/arctan_quotient.py
`default_nettype none

module arctan_quotient #(
    parameter int SAMPLE_CYCLES = 1  // fewest cycles from a sample to the next one
) (
    input  wire               clk,
    input  wire               rst,    // level: drops all samples, phase becomes 0
    input  wire               valid,  // strobe: sin and cos are a new sample
    input  wire signed [15:0] sin,    // counts, full scale = 2^15
    input  wire signed [15:0] cos,    // counts, full scale = 2^15
    output logic              done,   // strobe: phase is new
    output logic       [15:0] phase   // 2^-16 period; held until the next sample
);
    if (SAMPLE_CYCLES < 1) begin : g_check
        SAMPLE_CYCLES_MUST_BE_AT_LEAST_1 u_error ();
    end

    localparam int LATENCY = 12;
    localparam int PAIRS = 9;  // of digits; the sign of the last remainder gives one more
    localparam bit SERIAL = SAMPLE_CYCLES >= LATENCY;

    wire                differ = sin[15] ^ cos[15];
    // the sign of |sin| - |cos| times the sign of sin; of 1 less if both signs are equal
    wire                gap = 1'((17'(sin) + (17'(cos) ^ {17{!differ}})) >> 16);
    wire                steep = gap == sin[15];  // sin is the larger component
    wire  [       15:0] larger = steep ? sin : cos;
    wire  [       15:0] smaller = steep ? cos : sin;

    logic [LATENCY-1:0] coming;  // the sample is that many cycles old, less one
    wire                works = !SERIAL || valid || coming != '0;  // else the registers rest

    // The state of the division after n pairs of digits. If SERIAL, it is one state for all n.
    for (genvar n = 0; n <= PAIRS; n++) begin : g_step
        /* verilator lint_off UNUSEDSIGNAL */  // the synthesis removes what no later step needs
        logic signed [16:0] remainder;  // at most as large as divisor
        logic        [15:0] divisor;
        logic negative, steep_q;  // negative: the quotient is
        // digits of the magnitude of the quotient, 1 for a positive one
        logic       [ 5:0] head;  // the first ones
        logic       [11:0] tail;  // the last ones so far
        // after the next two digits
        wire               once = remainder[16] == divisor[15];
        wire signed [16:0] divisor_once = {divisor[15], divisor} ^ {17{once}};
        wire signed [16:0] halfway = {remainder[15:0], once} + divisor_once;
        wire               twice = halfway[16] == divisor[15];
        wire signed [16:0] divisor_twice = {divisor[15], divisor} ^ {17{twice}};
        wire signed [16:0] next_remainder = {halfway[15:0], twice} + divisor_twice;
        wire        [ 1:0] pair = {once, twice} ^ {2{negative}};
        wire        [ 5:0] next_head = {head[3:0], pair};
        wire        [11:0] next_tail = {tail[9:0], pair};
        /* verilator lint_on UNUSEDSIGNAL */

        if (!SERIAL && n == 0) begin : g_first
            always_ff @(posedge clk) begin
                remainder <= {smaller[15], smaller};
                divisor   <= larger;
                negative  <= differ;
                steep_q   <= steep;
                head      <= '0;
                tail      <= '0;
            end
        end else if (!SERIAL) begin : g_next
            always_ff @(posedge clk) begin
                remainder <= g_step[n-1].next_remainder;
                divisor   <= g_step[n-1].divisor;
                negative  <= g_step[n-1].negative;
                steep_q   <= g_step[n-1].steep_q;
                head      <= n <= 3 ? g_step[n-1].next_head : g_step[n-1].head;
                tail      <= g_step[n-1].next_tail;
            end
        end else if (n == 0) begin : g_one
            always_ff @(posedge clk) begin
                if (works) begin
                    remainder <= valid ? {smaller[15], smaller} : next_remainder;
                    tail      <= next_tail;
                end
                if (coming[2:0] != '0) head <= next_head;
                if (valid) begin
                    divisor  <= larger;
                    negative <= differ;
                    steep_q  <= steep;
                end
            end
        end else begin : g_same
            assign remainder = g_step[0].remainder;
            assign divisor   = g_step[0].divisor;
            assign negative  = g_step[0].negative;
            assign steep_q   = g_step[0].steep_q;
            assign head      = g_step[0].head;
            assign tail      = g_step[0].tail;
        end
    end

    // The parts of a parabola are taken when they are needed.
    wire  [18:0] base_now;
    wire  [15:0] slope_now;
    wire  [ 7:0] bend_now;
    logic [18:0] base;
    logic [15:0] slope;
    logic [ 7:0] bend;
    if (SERIAL) begin : g_table
        arctan_quotient_rom u_parabolas (
            .index(g_step[0].head[4:0]),
            .base (base_now),
            .slope(slope_now),
            .bend (bend_now)
        );
    end else begin : g_tables
        wire [18:0] early_base, later_base;
        wire [15:0] early_slope, late_slope;
        wire [7:0] later_bend, late_bend;
        arctan_quotient_rom u_bend (
            .index(g_step[6].head[4:0]),
            .base (early_base),
            .slope(early_slope),
            .bend (bend_now)
        );
        arctan_quotient_rom u_slope (
            .index(g_step[7].head[4:0]),
            .base (later_base),
            .slope(slope_now),
            .bend (later_bend)
        );
        arctan_quotient_rom u_base (
            .index(g_step[9].head[4:0]),
            .base (base_now),
            .slope(late_slope),
            .bend (late_bend)
        );
        wire unused = &{
            1'b0, early_base, later_base, early_slope, late_slope, later_bend, late_bend
        };
    end

    // distance from the middle of the parabola: its first 8 digits, and all of them
    wire signed [8:0] near = {!g_step[7].tail[7], g_step[7].tail[6:0], 1'b1};
    wire last = (g_step[9].remainder[16] == g_step[9].divisor[15]) ^ g_step[9].negative;
    wire signed [13:0] along = {!g_step[9].tail[11], g_step[9].tail[10:0], last, 1'b1};
    logic signed [16:0] bent;
    logic signed [16:0] tangent;
    logic signed [30:0] rise;
    logic [1:0] quarter;
    logic falls, zero;
    wire signed [19:0] risen = 20'(rise >>> 15);
    wire        [15:0] octant = 16'(({1'b0, base} + risen) >> 6);

    always_ff @(posedge clk) begin
        coming <= {coming[LATENCY-2:0], valid};
        if (works) begin
            base    <= base_now;
            slope   <= slope_now;
            bend    <= bend_now;
            bent    <= $signed({1'b0, bend}) * near;
            tangent <= $signed({1'b0, slope}) - 17'(bent >>> 8);
            rise    <= tangent * along;
            quarter <= {g_step[9].divisor[15], g_step[9].steep_q};
            falls   <= g_step[9].steep_q ^ g_step[9].negative;
            zero    <= g_step[9].divisor == '0;
        end
        if (coming[LATENCY-2]) begin
            phase <= 16'(({quarter, 14'd0, 1'b1} + {octant ^ {16{falls}}, falls}) >> 1);
            if (zero) phase <= '0;
        end
        if (SERIAL && valid) coming[LATENCY-2:1] <= '0;
        if (rst) begin
            coming <= '0;
            phase  <= '0;
        end
    end
    assign done = coming[LATENCY-1];
endmodule

`default_nettype wire
