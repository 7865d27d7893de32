// SPDX-License-Identifier: Apache-2.0
// harmonic_map -- take a sum of harmonics of the angle off a position: sum over k = 1..K of
// amplitude sin(k angle + phase).
//
// latency  3 clk from step to corrected
// rate     one step per clk
// method   the whole sum is worked out again and again, each time anew for the angle of that clk,
//          (STEPS + 2) K + 35 clk a round, K one more if it is odd: two terms share the rotator,
//          one is shifted while the other is added; between two sums each step adds the slope of
//          the last one. After T = 2 rounds at rest the correction is that of the angle to 2^-17
//          count plus the arithmetic; moving m counts a round it is behind by at most 3 m^2 sum(k^2
//          amplitude) (2 pi / counts_per_turn)^2 counts, which is of second order
// terms    two sets. One is in force, the other is written; swap exchanges them and begins a round
//          anew, so no sum ever mixes them. Until the first swap nothing is corrected. |amplitude|
//          in sum must stay below 2^14 counts
// source   S1: theta_1 = theta - sum C_s sin(t_s theta + phi_s); Volder, IRE Trans. EC-8 (1959)
//          330: rotation by atan 2^-n makes sine and cosine, and so value and slope, at once. Its
//          gain 1.64676 is to be taken off the amplitude by who writes it
// model    tb/compensate/harmonic_map.py, equal in every bit of every cycle
// proved   nothing is corrected before the first swap; the set in force changes with swap only, and
//          swap ends the round that runs; the sum changes only at the end of a round
// proof    depth 12, K = 2, STEPS = 8
`default_nettype none

module harmonic_map #(
    parameter int K     = 16,  // orders
    parameter int W     = 32,  // bits of position
    parameter int STEPS = 22   // rotations a term
) (
    input wire clk,
    input wire rst,
    input wire enable,  // level: angle is known; 0: nothing is corrected
    input  wire         [31:0]    radians_per_count, // 2^-40: 2 pi 2^40 / counts_per_turn, rounded; counts_per_turn from 1609 up
    input wire write,  // strobe: amplitude and phase go into the set not in force
    input wire [4:0] term,  // order - 1
    input wire signed [31:0] amplitude,  // 2^-16 count, less the gain of the rotations
    input wire [31:0] phase,  // 2^-32 turn
    input wire swap,  // strobe: exchange the sets
    input wire [31:0] angle,  // 2^-32 turn; step changes it one clk later, as it does position
    input wire signed [1:0] step,  // counts: -1, 0, +1
    input wire [W-1:0] position,  // counts
    output logic signed [31:0] correction,  // 2^-16 count
    output logic signed [W+15:0] corrected,  // 2^-16 count: position - correction of one clk before
    output logic refreshed  // strobe: a sum has come in
);
    if (K < 1 || K > 32) begin : g_check_k
        K_MUST_BE_FROM_1_TO_32 u_error ();
    end
    if (STEPS < 8 || STEPS > 24) begin : g_check_steps
        STEPS_MUST_BE_FROM_8_TO_24 u_error ();
    end

    localparam int V = 40;  // a vector: 2^-24 count
    localparam int TERMS = K + K % 2;  // they come in pairs
    localparam int P = $clog2(TERMS + 1);

    typedef enum logic [2:0] {
        IDLE,
        READ,
        LOAD,
        ROTATE,
        ADD,
        WEIGH,
        MULTIPLY,
        APPLY
    } state_t;

    logic [63:0] terms[0:2*(1<<P)-1];  // {amplitude, phase}
    logic [63:0] read;
    logic page, swapped;  // the set in force; there is one

    state_t         state;
    logic   [P-1:0] left;  // term to be read, the highest comes first
    logic           second;  // of the pair
    logic   [  4:0] count;  // rotations, then bits of the product
    logic   [ 31:0] multiple;  // of angle, for the term to come
    logic   [ 31:0] from;  // angle of this round
    logic signed [V-1:0] x, y;  // the vector of one term
    // that of the other, and what its rotation adds
    logic signed [V-1:0] x_held, y_held, x_turn, y_turn;
    // run: sum of x so far, so that the sum of run weighs each x with its order
    logic signed [V-1:0] sum, run;
    // 2^-32 turn still to rotate
    logic [31:0] rest, rest_held, rest_turn;
    logic signed [ 31:0] weighted;  // 2^-10 count
    logic signed [ 31:0] high;  // of the product
    // of the product, behind the bits of the multiplier that are left
    logic        [ 31:0] low;

    logic signed [V-1:0] base;  // the last sum
    logic signed [ 28:0] slope;  // 2^-28 count per count
    logic        [W-1:0] position_q;
    // 2^-28 count: of the steps since the angle of base, since that of this round
    logic signed [39:0] offset, since;

    wire                on = enable && swapped;
    wire                applies = state == APPLY;
    wire                begins = on && (state == IDLE || applies);
    wire                rotates = state == LOAD || state == ROTATE || state == ADD;
    // the term that makes an odd K even
    wire                spare = K % 2 == 1 && left == P'(K - 1) && !second;
    wire        [ 63:0] given = spare ? 64'd0 : read;
    wire        [ 31:0] wanted = multiple + given[31:0];
    // beyond a quarter turn: turn by half, start reversed
    wire                backward = wanted[31] ^ wanted[30];
    wire signed [V-1:0] vector = {given[63:32], 8'd0};
    wire signed [V-1:0] x_shifted = x >>> count;
    wire signed [V-1:0] y_shifted = y >>> count;
    wire signed [ 32:0] partial = {high[31], high} + (low[0] ? {weighted[31], weighted} : 33'd0);
    wire        [ 63:0] product = {partial, low[31:1]};
    wire signed [ 39:0] climb = {{11{slope[28]}}, slope};
    wire signed [ 39:0] change = step[1] ? -climb : step[0] ? climb : 40'sd0;
    wire signed [V-1:0] total = base + V'(offset >>> 4);

    // atan 2^-n in 2^-32 turn, rounded
    function automatic [31:0] rotation(input [4:0] n);
        case (n)
            5'd0:    rotation = 32'd536870912;
            5'd1:    rotation = 32'd316933406;
            5'd2:    rotation = 32'd167458907;
            5'd3:    rotation = 32'd85004756;
            5'd4:    rotation = 32'd42667331;
            5'd5:    rotation = 32'd21354465;
            5'd6:    rotation = 32'd10679838;
            5'd7:    rotation = 32'd5340245;
            5'd8:    rotation = 32'd2670163;
            5'd9:    rotation = 32'd1335087;
            5'd10:   rotation = 32'd667544;
            5'd11:   rotation = 32'd333772;
            5'd12:   rotation = 32'd166886;
            5'd13:   rotation = 32'd83443;
            5'd14:   rotation = 32'd41722;
            5'd15:   rotation = 32'd20861;
            5'd16:   rotation = 32'd10430;
            5'd17:   rotation = 32'd5215;
            5'd18:   rotation = 32'd2608;
            5'd19:   rotation = 32'd1304;
            5'd20:   rotation = 32'd652;
            5'd21:   rotation = 32'd326;
            5'd22:   rotation = 32'd163;
            default: rotation = 32'd81;
        endcase
    endfunction

    wire [31:0] angle_of = rotation(count);

    always_ff @(posedge clk) begin
        if (write) terms[{!page, P'(term)}] <= {amplitude, phase};
        read <= terms[{page, left}];
    end

    always_ff @(posedge clk)
        // a complement is less by 1 than a negative: it saves an adder
        if (rotates) begin
            x         <= x_held + x_turn;
            y         <= y_held + y_turn;
            rest      <= rest_held + rest_turn;
            x_held    <= x;
            y_held    <= y;
            rest_held <= rest;
            x_turn    <= y_shifted ^ {V{!rest[31]}};
            y_turn    <= x_shifted ^ {V{rest[31]}};
            rest_turn <= angle_of ^ {32{!rest[31]}};
            if (state == LOAD) begin
                x_held    <= vector ^ {V{backward}};
                y_held    <= '0;
                rest_held <= {wanted[31] ^ backward, wanted[30:0]};
                x_turn    <= '0;
                y_turn    <= '0;
                rest_turn <= '0;
            end
        end

    always_ff @(posedge clk) begin
        second <= rotates && !second;
        count  <= state == ROTATE || state == MULTIPLY ? count + 5'(second || state == MULTIPLY) : '0;
        case (state)
            READ: begin
                left  <= left - 1'b1;
                state <= LOAD;
            end
            LOAD: begin
                multiple <= multiple - from;
                if (second) state <= ROTATE;
                else left <= left - 1'b1;
            end
            ROTATE: if (second && count == 5'(STEPS - 1)) state <= ADD;
            ADD: begin
                sum      <= sum + y;
                run      <= run + x;
                weighted <= weighted + 32'(run >>> 14);
                if (second) begin
                    left  <= left - 1'b1;
                    state <= left == '1 ? WEIGH : LOAD;
                end
            end
            WEIGH: begin
                weighted <= weighted + 32'(run >>> 14);
                low      <= radians_per_count;
                high     <= '0;
                state    <= MULTIPLY;
            end
            MULTIPLY: begin
                {high, low} <= product;
                if (count == 5'd31) begin
                    slope <= product[50:22];
                    state <= APPLY;
                end
            end
            APPLY: state <= IDLE;
            default:;
        endcase

        offset <= (applies ? since : offset) + change;
        since  <= (begins ? 40'sd0 : since) + change;
        if (applies) base <= sum;
        refreshed <= applies;
        if (begins) begin
            left     <= P'(TERMS - 1);
            from     <= angle;
            multiple <= 32'(angle * 32'(TERMS));
            sum      <= '0;
            run      <= '0;
            weighted <= '0;
            state    <= READ;
        end
        if (swap) begin
            page    <= !page;
            swapped <= 1'b1;
            state   <= IDLE;
        end

        correction <= 32'((total + V'(128)) >>> 8);
        position_q <= position;
        corrected  <= {position_q, 16'd0} - {{(W-16){correction[31]}}, correction};
        if (rst || !enable) begin
            state     <= IDLE;
            base      <= '0;
            slope     <= '0;
            offset    <= '0;
            since     <= '0;
            refreshed <= 1'b0;
        end
        if (rst) begin
            page       <= 1'b0;
            swapped    <= 1'b0;
            correction <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (!swapped)
                assert (state == IDLE && base == '0 && slope == '0 && offset == '0 && since == '0 && correction == '0);
            if (page != $past(page)) assert ($past(swap));
            if ($past(swap)) assert (state == IDLE);
            if (refreshed) assert ($past(state) == APPLY && $past(on));
            if (base != $past(base)) assert (refreshed || !$past(enable));
            assert (corrected == {$past(
                position_q
            ), 16'd0} - {{(W - 16) {$past(
                correction[31]
            )}}, $past(
                correction
            )});
            cover (state == ROTATE && count == 5'd2);
        end
    end
`endif
endmodule

`default_nettype wire
