// SPDX-License-Identifier: Apache-2.0
// lissajous_monitor -- learn the length of the signal vector in eight directions, and judge how
// round and centred they are and whether a sample lies off the circle they form.
//
// latency  5 cycles from valid to done and the results; 1 cycle from valid to ready
// rate     one sample per cycle
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
// proof    depth 30
//
// A limit of 65535 switches its check off. All results are judged by the circle that was known
// before the sample.
`default_nettype none

module lissajous_monitor #(
    parameter int R = 8  // bits of a length, 8 to 16
) (
    input  wire          clk,
    input  wire          rst,               // level: the circle is forgotten
    input  wire  [ 15:0] tolerance,         // counts: largest good distance from the circle
    input  wire  [ 15:0] offset_limit,      // counts: largest good offset in any direction
    input  wire  [ 15:0] balance_limit,     // counts: largest good difference of amplitudes
    input  wire  [ 15:0] quadrature_limit,  // counts: largest amplitude · sine of phase error
    input  wire          valid,             // strobe: length, axis, quadrant and tilt are new
    input  wire  [R-1:0] length,            // counts: length of the vector
    input  wire  [  1:0] axis,              // nearest axis, as from vector_length
    input  wire  [  1:0] quadrant,          // quadrant, as from vector_length
    input  wire  [  2:0] tilt,              // quarters of 45 degrees, as from vector_length
    output logic         ready,             // level: all eight directions are known
    output logic         done,              // strobe: the results below belong to a new sample
    output logic         off_circle,        // level: the sample is too far off; 0 until ready
    output logic         offset_drift,      // level: the offset is too large
    output logic         unbalanced,        // level: the amplitudes differ too much
    output logic         not_in_quadrature  // level: the phase error is too large
);
    if (R < 8 || R > 16) begin : g_check
        R_MUST_BE_FROM_8_TO_16 u_error ();
    end

    wire [4*R-1:0] lengths[0:1];  // lengths at the four axes; at the four diagonals
    wire [    3:0] known  [0:1];

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) past <= 1'b1;
`endif
    for (genvar kind = 0; kind < 2; kind++) begin : g_kind
        logic [4*R-1:0] learned;  // four lengths
        logic [    3:0] have;  // which of them
        logic           started;  // there was a sample
        logic [    1:0] sector;  // of the last sample
        // 0: not crossing, 1: entered from the preceding sector, 3: from the following one
        logic [    1:0] side;
        logic           met;  // a sample of this crossing was close to the middle
        logic [  R-1:0] middle;  // its length

        assign lengths[kind] = learned;
        assign known[kind]   = have;

        wire [  1:0] new_sector = kind == 0 ? axis : quadrant;
        wire         close = kind == 0 ? tilt == 3'd0 : tilt == 3'd4;
        wire [  1:0] onward = started ? new_sector - sector : 2'd2;
        wire         crossed = onward[0] && side == onward && met;
        wire [R-1:0] mean = R'(((R + 1)'(learned[sector*R+:R]) + (R + 1)'(middle) + 1'b1) >> 1);

        always_ff @(posedge clk) begin
            if (valid) begin
                started <= 1'b1;
                sector  <= new_sector;
                if (close) middle <= length;
                met <= close || (met && onward == 2'd0);
                if (onward != 2'd0) side <= onward[0] ? onward : 2'd0;
                if (crossed) begin
                    learned[sector * R +: R] <= have[sector] ? mean : middle;
                    have[sector]             <= 1'b1;
                end
            end
            if (rst) begin
                started <= 1'b0;
                side    <= 2'd0;
                met     <= 1'b0;
                have    <= '0;
            end
        end

`ifdef FORMAL
        always @(posedge clk)
            if (past && !$past(rst)) begin
                for (int n = 0; n < 4; n++)
                if (learned[n*R+:R] != $past(learned[n*R+:R]) || have[n] != $past(have[n])) begin
                    assert ($past(valid && started && met && side[0]));
                    assert ($past(sector) == n && sector == 2'(n) + $past(side));
                end
            end
`endif
    end

    assign ready = &{known[1], known[0]};

    // distance of this sample from the circle
    logic [R-1:0] length_1, at_axis, at_diagonal;
    logic [2:0] tilt_1, tilt_2;
    logic signed [R+3:0] rise, gap_2, gap_3, climbed, away;
    logic [3:0] in_progress, judge;  // a sample is in progress; the circle was known
    wire        [R+3:0] distance = away < 0 ? -away : away;
    wire signed [R+3:0] rise_4 = tilt_2[2] ? rise <<< 2 : '0;
    wire signed [R+3:0] rise_2 = tilt_2[1] ? rise <<< 1 : '0;
    wire signed [R+3:0] rise_1 = tilt_2[0] ? rise : '0;

    always_ff @(posedge clk) begin
        in_progress <= {in_progress[2:0], valid};
        judge  <= {judge[2:0], ready};
        if (valid) begin
            length_1    <= length;
            tilt_1      <= tilt;
            at_axis     <= lengths[0][axis * R +: R];
            at_diagonal <= lengths[1][quadrant * R +: R];
        end
        if (in_progress[0]) begin
            rise    <= $signed({4'b0, at_diagonal}) - $signed({4'b0, at_axis});
            gap_2   <= $signed({4'b0, length_1}) - $signed({4'b0, at_axis});
            tilt_2  <= tilt_1;
        end
        if (in_progress[1]) begin
            climbed <= rise_4 + rise_2 + rise_1;
            gap_3   <= gap_2;
        end
        if (in_progress[2]) away <= gap_3 - (climbed >>> 2);
        if (rst) in_progress <= '0;
    end

    // shape of the circle
    wire [1:0] uncentred, beyond;
    for (genvar kind = 0; kind < 2; kind++) begin : g_shape
        logic signed [R+1:0] east, north, west, south;
        // twice the offset, and twice the difference of amplitudes
        logic signed [R+1:0] along, across, oval;
        logic [R+1:0] along_size, across_size, oval_size, offset_size, oval_size_4;
        always_ff @(posedge clk) begin
            if (valid) begin
                east        <= $signed({2'b0, lengths[kind][0 +: R]});
                north       <= $signed({2'b0, lengths[kind][R +: R]});
                west        <= $signed({2'b0, lengths[kind][2*R +: R]});
                south       <= $signed({2'b0, lengths[kind][3*R +: R]});
            end
            if (in_progress[0]) begin
                along       <= east - west;
                across      <= north - south;
                oval        <= east + west - north - south;
            end
            if (in_progress[1]) begin
                along_size  <= along < 0 ? -along : along;
                across_size <= across < 0 ? -across : across;
                oval_size   <= oval < 0 ? -oval : oval;
            end
            if (in_progress[2]) begin
                offset_size <= along_size > across_size ? along_size : across_size;
                oval_size_4 <= oval_size;
            end
        end
        wire [15:0] limit = kind == 0 ? balance_limit : quadrature_limit;
        wire [18:0] offset_limit_2 = {2'b0, offset_limit, 1'b0};
        assign uncentred[kind] = offset_limit != '1 && 19'(offset_size) > offset_limit_2;
        assign beyond[kind]    = limit != '1 && 19'(oval_size_4) > {2'b0, limit, 1'b0};
    end

    always_ff @(posedge clk) begin
        done <= in_progress[3];
        if (in_progress[3]) begin
            off_circle   <= judge[3] && tolerance != '1 && 20'(distance) > 20'(tolerance);
            offset_drift <= judge[3] && |uncentred;
            unbalanced   <= judge[3] && beyond[0];
            not_in_quadrature   <= judge[3] && beyond[1];
        end
        if (rst) begin
            done         <= 1'b0;
            off_circle   <= 1'b0;
            offset_drift <= 1'b0;
            unbalanced   <= 1'b0;
            not_in_quadrature   <= 1'b0;
        end
    end

`ifdef FORMAL
    logic [4:0] since;  // cycles in which all directions were known, up to 5
    always @(posedge clk) begin
        since <= rst || !ready ? '0 : since == 5 ? since : since + 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (ready || since == 0);
            for (int n = 0; n < 4; n++) assert (!judge[n] || since > 5'(n) || !in_progress[n]);
            if (since < 5)
                assert (!off_circle && !offset_drift && !unbalanced && !not_in_quadrature);
        end
        cover (past && offset_drift && !off_circle);
    end
`endif
endmodule

`default_nettype wire
