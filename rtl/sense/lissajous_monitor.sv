// SPDX-License-Identifier: Apache-2.0
// lissajous_monitor -- learn the length of the signal vector in eight directions, and judge how
// round and centred they are and whether a sample lies off the circle they form.
//
// latency  17 cycles from valid to done and the results; 19 or 21 cycles from valid to ready
// rate     one sample per 21 cycles
// behaviour One adder does everything in turn. The shape of the circle is judged at the axes and at
//          the diagonals by turns, at each sample one of both. A sample that comes too soon is
//          not seen.
// method   A direction is learned when its sector has been crossed from one side to the other and
//          a sample came within 1/8 of its axis or diagonal: nothing is learned from a signal that
//          rests or trembles. The new value is averaged with the preceding one. Between an axis and
//          a diagonal the expected length is the straight line from one length to the other.
// accuracy the expected length is at most 5 % wrong for 5 % offset, 6 % gain error, 4 degrees of
//          phase error and harmonics of 1 %
// source   |v| = A + offset · direction + (A / 2) (gain error cos 2p + sin phase error · sin 2p)
//          to first order
// model    tb/sense/lissajous_monitor.py, equal in every bit of every cycle
// proved   a length changes only when its sector is left on the side opposite to the entry, after
//          a sample near its middle; nothing is judged before all eight are known
// proof    depth 43
//
// A limit of 65535 switches its check off. All results are judged by the circle that was known
// before the sample.
`default_nettype none

module lissajous_monitor #(
    parameter int R = 8  // bits of a length, 8 to 16
) (
    input wire clk,
    input wire rst,  // level: the circle is forgotten
    input wire [15:0] tolerance,  // counts: largest good distance from the circle
    input wire [15:0] offset_limit,  // counts: largest good offset in any direction
    input wire [15:0] balance_limit,  // counts: largest good difference of amplitudes
    input wire [15:0] quadrature_limit,  // counts: largest amplitude · sine of phase error
    input wire valid,  // strobe: the next four are new; held for 20 cycles more
    input wire [R-1:0] length,  // counts: length of the vector
    input wire [1:0] axis,  // nearest axis, as from vector_length
    input wire [1:0] quadrant,  // quadrant, as from vector_length
    input wire [2:0] tilt,  // quarters of 45 degrees, as from vector_length
    output logic ready,  // level: all eight directions are known
    output logic done,  // strobe: the results below belong to a new sample
    output logic off_circle,  // level, with done: too far off; 0 until ready
    output logic offset_drift,  // level, with done: the offset is too large
    output logic unbalanced,  // level, with done: the amplitudes differ too much
    output logic not_in_quadrature  // level, with done: the phase error is too large
);
    if (R < 8 || R > 16) begin : g_check
        R_MUST_BE_FROM_8_TO_16 u_error ();
    end

    localparam int N = R + 3;  // bits of a sum of four lengths with a sign

    // lengths at the four axes, then at the four diagonals
    (* ram_style = "distributed" *)logic [R-1:0] learned                        [0:7];
    logic         started;  // there was a sample
    // of the axes when `kind` is 0, of the diagonals when it is 1; the _q are those of the others
    logic         kind;
    logic [3:0] known, known_q;  // directions that have been learned
    logic [1:0] sector, sector_q;  // of the last sample
    // 0: not crossing, 1: entered from the preceding sector, 3: from the following one
    logic [1:0] side, side_q;
    logic met, met_q;  // a sample of this crossing was close to the middle
    logic [R-1:0] middle, middle_q;  // its length

    wire         [  1:0] new_sector = kind ? quadrant : axis;
    wire                 close = tilt == (kind ? 3'd4 : 3'd0);
    wire         [  1:0] onward = started ? new_sector - sector : 2'd2;
    wire                 crossed = onward[0] && side == onward && met;

    logic        [  4:0] step;  // 0: idle, or the first step of a sample
    logic                shape_kind;  // whose shape is judged: 0 the axes, 1 the diagonals
    logic signed [N-1:0] sum;
    logic                oblong;  // the offset along the first direction is too large
    logic uncentred, uncentred_q;  // the offset of this kind, of the other kind is too large

    // what each step does
    logic [1:0] place;  // the direction whose length is read, of that kind
    logic place_kind;
    logic subtract;  // the length that is read
    logic compare;  // the sum with a limit, and begin a new sum
    logic learn;  // the half of the sum, and begin a new one
    wire first = step == '0;
    wire middle_added = step == 5'd17 || step == 5'd19 || (learn && !known[sector]);

    wire [R-1:0] at_place = learned[{place_kind, place}];
    wire signed [N-1:0] operand =
        first ? N'({length, 2'b11}) :
        middle_added ? N'(middle) : N'({at_place} ^ {N{subtract}});
    wire carry = subtract || learn;
    wire signed [N-1:0] total = sum + operand + N'(carry);

    // the limit; 4 counts
    logic [17:0] limit;
    wire negative = sum[N-1];
    wire [N-1:0] steps = negative ? ~sum : sum;  // the size; one less if negative
    wire beyond = {19'(steps), negative} > {1'b0, limit, 1'b0};

    assign ready = &{known, known_q};

    always_comb begin
        subtract = 1'b0;
        {place_kind, place} = {kind, sector};
        case (step)
            // four times the distance from the circle, and 3 more
            5'd1, 5'd2, 5'd3, 5'd4: begin
                subtract = 1'b1;
                {place_kind, place} = step[2:0] <= tilt ? {1'b1, quadrant} : {1'b0, axis};
            end
            // twice the offset along one direction, then along another one
            5'd6: {subtract, place_kind, place} = {1'b0, shape_kind, 2'd0};
            5'd7: {subtract, place_kind, place} = {1'b1, shape_kind, 2'd2};
            5'd9: {subtract, place_kind, place} = {1'b0, shape_kind, 2'd1};
            5'd10: {subtract, place_kind, place} = {1'b1, shape_kind, 2'd3};
            // twice the difference of amplitudes
            5'd12: {subtract, place_kind, place} = {1'b0, shape_kind, 2'd0};
            5'd13: {subtract, place_kind, place} = {1'b1, shape_kind, 2'd1};
            5'd14: {subtract, place_kind, place} = {1'b0, shape_kind, 2'd2};
            5'd15: {subtract, place_kind, place} = {1'b1, shape_kind, 2'd3};
            default: ;
        endcase
        if (!step[4] && !step[3]) limit = {tolerance, {2{!negative}}};
        else if (!step[4]) limit = {1'b0, offset_limit, 1'b0};
        else if (!shape_kind) limit = {1'b0, balance_limit, 1'b0};
        else limit = {1'b0, quadrature_limit, 1'b0};
        compare = step == 5'd5 || step == 5'd8 || step == 5'd11 || step == 5'd16;
        learn   = step == 5'd18 || step == 5'd20;
    end

    always_ff @(posedge clk) begin
        if (learn && crossed) learned[{kind, sector}] <= total[R:1];
    end

    always_ff @(posedge clk) begin
        done <= step == 5'd16;
        if (step != '0 || valid) begin
            step <= step == 5'd20 ? '0 : step + 1'b1;
            sum  <= total;
            if (compare || learn) sum <= '0;
        end
        if (step == 5'd5) off_circle <= ready && beyond;
        if (step == 5'd8) oblong <= beyond;
        if (step == 5'd11) begin
            uncentred   <= uncentred_q;
            uncentred_q <= ready && (oblong || beyond);
        end
        if (step == 5'd16) begin
            if (shape_kind) not_in_quadrature <= ready && beyond;
            else unbalanced <= ready && beyond;
            shape_kind <= !shape_kind;
        end
        if (learn) begin
            kind <= !kind;
            {known, sector, side, met, middle} <= {known_q, sector_q, side_q, met_q, middle_q};
            known_q <= known | (4'(crossed) << sector);
            sector_q <= new_sector;
            side_q <= onward == 2'd0 ? side : onward[0] ? onward : 2'd0;
            met_q <= close || (met && onward == 2'd0);
            middle_q <= close ? length : middle;
            if (kind) started <= 1'b1;
        end
        if (rst) begin
            step              <= '0;
            sum               <= '0;
            done              <= 1'b0;
            kind              <= 1'b0;
            shape_kind        <= 1'b0;
            started           <= 1'b0;
            known             <= '0;
            known_q           <= '0;
            sector            <= '0;
            sector_q          <= '0;
            side              <= '0;
            side_q            <= '0;
            met               <= 1'b0;
            met_q             <= 1'b0;
            off_circle        <= 1'b0;
            uncentred         <= 1'b0;
            uncentred_q       <= 1'b0;
            unbalanced        <= 1'b0;
            not_in_quadrature <= 1'b0;
        end
    end
    assign offset_drift = uncentred || uncentred_q;

`ifdef FORMAL
    logic past = 1'b0;
    wire  any = off_circle || offset_drift || unbalanced || not_in_quadrature;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (step <= 5'd20);
            assert (ready || !any);
            for (int n = 0; n < 8; n++)
            if (learned[n] != $past(learned[n])) begin
                assert ($past(learn && started && met && side[0]) && $past({kind, sector}) == n);
                assert ($past(kind ? quadrant : axis) == 2'(n) + $past(side));
            end
        end
        if (past && !$past(rst) && ready && !$past(ready)) assert ($past(learn && crossed));
        cover (past && met_q && side_q[0]);
    end
`endif
endmodule

`default_nettype wire
