// SPDX-License-Identifier: Apache-2.0
// harmonic_map -- subtract a sum of harmonics of the angle from a position: the sum over k = 1..K
// of amplitude sin(k angle + phase).
//
// latency   3 cycles from step to corrected
// rate      one step per cycle
// accuracy  After T = 2 rounds at standstill the correction is the sum at the angle, to 2^-17 count
//           plus the rounding of the arithmetic. In a motion of m counts per round it lags by at
//           most 3 m^2 sum(k^2 amplitude) (2 pi / counts_per_turn)^2 counts, which is of second
//           order.
// method    The whole sum is computed again and again, each time from scratch for the angle at the
//           start of the round. A round takes (STEPS + 2) K + 35 cycles, with K + 1 instead of an
//           odd K: two terms share the rotator, one is shifted while the other is added. Between
//           two sums each step adds the slope of the last sum. Rotations by atan 2^-n (CORDIC) give
//           sine and cosine, and so value and slope, at once.
// behaviour There are two sets of terms. One is in force, the other can be written; swap exchanges
//           them and begins a new round, so that no sum ever mixes them. Before the first swap
//           nothing is corrected.
// limits    The sum of all |amplitude| must be below 2^14 counts. The rotations lengthen a vector
//           by 1.64676; an amplitude must be divided by this gain before it is written.
//           counts_per_turn must be 1609 or more.
// source    S1: theta_1 = theta - sum C_s sin(t_s theta + phi_s); Volder, IRE Trans. EC-8 (1959)
//           330
// model     tb/compensate/harmonic_map.py, equal in every bit of every cycle
// proved    Nothing is corrected before the first swap. The set in force changes with swap only,
//           and swap ends the running round. The sum changes only at the end of a round.
// proof     depth 12, K = 2, STEPS = 8
`default_nettype none

module harmonic_map #(
    parameter int K     = 16,  // number of orders
    parameter int W     = 32,  // bits of position
    parameter int STEPS = 22   // rotations per term
) (
    input  wire                  clk,
    input  wire                  rst,
    input  wire                  enable,             // level: angle is known; 0: no correction
    input  wire         [  31:0] radians_per_count,  // 2^-40: 2 pi 2^40 / counts_per_turn, rounded
    input  wire                  write,              // strobe: write a term of the set not in force
    input  wire         [   4:0] term,               // order - 1
    input  wire signed  [  31:0] amplitude,          // 2^-16 count, divided by the CORDIC gain
    input  wire         [  31:0] phase,              // 2^-32 turn
    input  wire                  swap,               // strobe: exchange the sets
    input  wire         [  31:0] angle,              // 2^-32 turn, changes one cycle after step
    input  wire signed  [   1:0] step,               // counts: -1, 0, +1
    input  wire         [ W-1:0] position,           // counts, changes one cycle after step
    output logic signed [  31:0] correction,         // 2^-16 count
    output logic signed [W+15:0] corrected,          // 2^-16 count: position - correction, delayed
    output logic                 refreshed           // strobe: a new sum is in force
);
    // corrected is the difference of one cycle before.
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
    logic page, swapped;  // number of the set in force; a set is in force

    state_t         state;
    logic   [P-1:0] left;  // term to be read, the highest comes first
    logic           second;  // the second term of the pair is at the rotator's input
    logic   [  4:0] count;  // rotations, then bits of the product
    logic   [ 31:0] multiple;  // order * angle for the next term
    logic   [ 31:0] from;  // angle of this round
    logic signed [V-1:0] x, y;  // the vector of one term
    // the vector of the other term, and what its rotation adds
    logic signed [V-1:0] x_held, y_held, x_turn, y_turn;
    // run is the sum of x so far: the sum of all values of run weights each x with its order
    logic signed [V-1:0] sum, run;
    // 2^-32 turn that remain to be rotated
    logic [31:0] remainder, remainder_held, remainder_turn;
    logic signed [ 31:0] weighted;  // 2^-10 count
    logic signed [ 31:0] high;  // of the product
    // of the product, after the bits of the multiplier that are still to come
    logic        [ 31:0] low;

    logic signed [V-1:0] base;  // the last sum
    logic signed [ 28:0] slope;  // 2^-28 count per count
    logic        [W-1:0] position_q;
    // 2^-28 count: change by the steps since the angle of base, since the angle of this round
    logic signed [39:0] offset, since;

    wire                on = enable && swapped;
    wire                applies = state == APPLY;
    wire                begins = on && (state == IDLE || applies);
    wire                counts = state == ROTATE || state == MULTIPLY;
    wire                rotates = state == LOAD || state == ROTATE || state == ADD;
    // the zero term that makes an odd K even
    wire                spare = K % 2 == 1 && left == P'(K - 1) && !second;
    wire        [ 63:0] given = spare ? 64'd0 : read;
    wire        [ 31:0] required = multiple + given[31:0];
    // beyond a quarter turn, half a turn is added and the vector starts reversed
    wire                backward = required[31] ^ required[30];
    wire signed [V-1:0] vector = {given[63:32], 8'd0};
    wire signed [V-1:0] x_shifted = x >>> count;
    wire signed [V-1:0] y_shifted = y >>> count;
    wire signed [ 32:0] partial = {high[31], high} + (low[0] ? {weighted[31], weighted} : 33'd0);
    wire        [ 63:0] product = {partial, low[31:1]};
    wire signed [ 39:0] climb = {{11{slope[28]}}, slope};
    wire signed [ 39:0] change = step[1] ? -climb : step[0] ? climb : 40'sd0;
    wire signed [V-1:0] total = base + V'(offset >>> 4);

    wire        [ 31:0] rotation;
    harmonic_rotation_rom u_rotation (
        .rotation(count),
        .angle   (rotation)
    );

    always_ff @(posedge clk) begin
        if (write) terms[{!page, P'(term)}] <= {amplitude, phase};
        read <= terms[{page, left}];
    end

    always_ff @(posedge clk)
        // a bitwise complement is 1 less than the negative value, but saves an adder
        if (rotates) begin
            x              <= x_held + x_turn;
            y              <= y_held + y_turn;
            remainder      <= remainder_held + remainder_turn;
            x_held         <= x;
            y_held         <= y;
            remainder_held <= remainder;
            x_turn         <= y_shifted ^ {V{!remainder[31]}};
            y_turn         <= x_shifted ^ {V{remainder[31]}};
            remainder_turn <= rotation ^ {32{!remainder[31]}};
            if (state == LOAD) begin
                x_held         <= vector ^ {V{backward}};
                y_held         <= '0;
                remainder_held <= {required[31] ^ backward, required[30:0]};
                x_turn         <= '0;
                y_turn         <= '0;
                remainder_turn <= '0;
            end
        end

    always_ff @(posedge clk) begin
        second <= rotates && !second;
        count  <= counts ? count + 5'(second || state == MULTIPLY) : '0;
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
    logic          past = 1'b0;
    logic [W+15:0] due;  // of corrected
    always @(posedge clk) begin
        past <= 1'b1;
        due  <= {position_q, 16'd0} - {{(W - 16) {correction[31]}}, correction};
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (!swapped) assert (state == IDLE && base == '0 && slope == '0 && correction == '0);
            if (!swapped) assert (offset == '0 && since == '0);
            if (page != $past(page)) assert ($past(swap));
            if ($past(swap)) assert (state == IDLE);
            if (refreshed) assert ($past(state) == APPLY && $past(on));
            if (base != $past(base)) assert (refreshed || !$past(enable));
            assert (corrected == due);
            cover (state == ROTATE && count == 5'd2);
        end
    end
`endif
endmodule

`default_nettype wire
