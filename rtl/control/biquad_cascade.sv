// SPDX-License-Identifier: Apache-2.0
// biquad_cascade -- second-order filters in series (notch, low-pass), computed by one serial
// multiplier with error feedback.
//
//   y = b0 x + b1 x' + b2 x'' + c1 y' + c2 y''
//
// A prime means one sample earlier; c1 and c2 are -a1 and -a2 of the transfer function.
//
// latency   36 * SECTIONS + 1 cycles from valid_in to valid. The terms of earlier samples were
//           added up before.
// rate      one sample per 177 * SECTIONS + 1 cycles. ready reports when one is taken; one that
//           comes sooner is ignored.
// accuracy  y is rounded down to its LSB, and what was cut off is added to the next sample: the
//           error of a section is the response of (1 - z^-1) / A(z) to an input of 0 to 1 LSB. So
//           there is no error at standstill and no limit cycle: with b0 + b1 + b2 + c1 + c2 = 1
//           exactly, y settles within one LSB of x. y saturates at 32 bits.
// behaviour A section in bypass passes x on and remembers it as its past samples, and so do all
//           sections in a `track` sample: when the filter is used again, it continues from there. A
//           section filters again after two samples that it passed; the same holds after reset.
// limits    Coefficients may change in bypass only.
// source    direct form I with first-order error feedback
// model     tb/control/biquad_cascade.py, equal in every bit of every cycle
// proved    A sample is taken only while ready is high, and not before the output of the last
//           sample has come. y changes only with valid.
// proof     depth 10
`default_nettype none

module biquad_cascade #(
    parameter int SECTIONS = 2  // number of filters in series, 1 to 4
) (
    input wire clk,
    input wire rst,
    input wire [SECTIONS-1:0] in_use,  // level: section n filters; 0: bypass
    input wire coefficient_write,  // strobe: write a coefficient
    input wire [4:0] coefficient_address,  // section * 8 + number of the term
    input wire signed [31:0] coefficient,  // 2^-30
    input wire valid_in,  // strobe: x is new
    input wire track,  // level: with valid_in, pass this sample
    input wire signed [31:0] x,  // LSB, input sample
    output logic ready,  // level: valid_in is taken
    output logic valid,  // strobe: y is new
    output logic signed [31:0] y  // LSB, output sample
);
    if (SECTIONS < 1 || SECTIONS > 4) begin : g_check
        SECTIONS_MUST_BE_FROM_1_TO_4 u_error ();
    end

    localparam [2:0] NOW = 3'd0, LAST_TERM = 3'd4;  // terms: b0, b1, b2, c1, c2

    enum logic [2:0] {
        WAIT,
        FETCH,
        LOAD,
        MULTIPLY,
        SIGN,
        ADD,
        STORE
    } state;

    logic [1:0] section;
    logic [2:0] term;
    logic [4:0] step;
    // which of the two past samples of each stream is the newer
    logic parity;
    logic known;  // the memory holds a sample
    logic passing;  // this sample passes all sections unfiltered
    logic [SECTIONS-1:0] filtering;  // the past terms of the section are added up

    // memories, each with a registered output; terms are numbered b0, b1, b2, c1, c2
    logic signed [31:0] coefficients[0:31];
    // address {stream, parity}; the streams are x of section 0, 1, … and y of the last
    logic signed [31:0] history[0:15];
    // sum of the section's past terms; between samples what was cut off
    logic [66:0] carried[0:3];
    logic signed [31:0] coefficient_read, history_read;
    logic        [66:0] carried_read;

    // the sum {top, low} in 2^-30 LSB of y: the low bits of the product replace those of the sum,
    // which are added as carries
    logic signed [35:0] top;
    logic        [30:0] low;
    logic signed [33:0] high;  // upper bits of the growing product
    logic signed [31:0] multiplicand, sample;
    logic       [31:0] multiplier;

    wire signed [33:0] addend = multiplier[0] ? {{2{multiplicand[31]}}, multiplicand} : '0;
    wire signed [33:0] grown = high + addend + $signed({33'd0, low[0]});

    wire               fits = top[35:30] == {6{top[35]}};
    wire signed [31:0] filtered = fits ? {top[30:0], low[30]} : {top[35], {31{~top[35]}}};
    wire        [ 3:0] on = 4'(filtering & in_use);
    wire               works = on[section] && !passing;
    wire signed [31:0] result = works ? filtered : sample;
    wire               last = section == 2'(SECTIONS - 1);

    wire        [66:0] cut_off = works && fits ? {37'd0, low[29:0]} : '0;
    wire        [ 2:0] stream = {1'b0, section} + {2'd0, term >= 3'd3};
    wire               newer = term == 3'd1 || term == 3'd3;
    wire               stores = state == STORE && term == NOW;
    wire               starts = state == WAIT && valid_in;

    always_ff @(posedge clk) begin
        if (coefficient_write) coefficients[coefficient_address] <= coefficient;
        coefficient_read <= coefficients[{section, term}];
        if (starts) history[{3'd0, !parity}] <= x;
        else if (stores) history[{{1'b0, section}+3'd1, !parity}] <= result;
        history_read <= history[{stream, newer?parity : !parity}];
        if (state == STORE) carried[section] <= term != NOW ? {top, low} : cut_off;
        carried_read <= carried[section];
    end

    always_ff @(posedge clk) begin
        valid <= 1'b0;
        step  <= step + 1'b1;
        case (state)
            FETCH: state <= LOAD;
            LOAD: begin
                if (term <= 3'd1) {top, low} <= carried_read;
                high         <= '0;
                multiplicand <= term == NOW ? sample : history_read;
                multiplier   <= coefficient_read;
                step         <= '0;
                state        <= MULTIPLY;
            end
            MULTIPLY: begin
                high       <= grown >>> 1;
                low        <= {grown[0], low[30:1]};
                multiplier <= multiplier >> 1;
                if (step == 5'd30) state <= SIGN;
            end
            // the top bit of the coefficient has a negative weight
            SIGN: begin
                high  <= high - addend;
                state <= ADD;
            end
            ADD: begin
                top <= top + {{2{high[33]}}, high};
                if (term == NOW || term == LAST_TERM) state <= STORE;
                else begin
                    term  <= term + 1'b1;
                    state <= FETCH;
                end
            end
            STORE: begin
                sample  <= result;
                section <= last ? 2'd0 : section + 1'b1;
                term    <= (term == NOW) == last ? 3'd1 : NOW;
                state   <= FETCH;
                if (last && term == NOW) begin
                    valid     <= 1'b1;
                    y         <= result;
                    parity    <= !parity;
                    known     <= 1'b1;
                    filtering <= known && !passing ? in_use : '0;
                end else if (last) state <= WAIT;
            end
            default:
            if (valid_in) begin
                sample  <= x;
                passing <= track;
                state   <= FETCH;
            end
        endcase
        ready <= state == WAIT && !valid_in || state == STORE && term != NOW && last;
        if (rst) begin
            state     <= WAIT;
            ready     <= 1'b1;
            valid     <= 1'b0;
            y         <= '0;
            section   <= '0;
            term      <= NOW;
            parity    <= 1'b0;
            known     <= 1'b0;
            filtering <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic owed;  // a sample was taken and its y has not come yet
    always @(posedge clk) begin
        past <= 1'b1;
        owed <= !rst && (starts || (owed && !(state == STORE && last && term == NOW)));
        if (!past) assume (rst);
        if (past) begin
            assert (state <= STORE && section < SECTIONS && term <= LAST_TERM);
            if (state == STORE) assert (term == NOW || term == LAST_TERM);
            assert (ready == (state == WAIT));
            // the past terms are added up after y
            assert (owed == (state != WAIT && term == NOW));
            if (valid) assert ($past(owed));
            if (!valid && !$past(rst)) assert (y == $past(y));
            if (state == WAIT) assert (section == 0 && term == NOW);
            cover (state == MULTIPLY && step == 3 && owed);
        end
    end
`endif
endmodule

`default_nettype wire
