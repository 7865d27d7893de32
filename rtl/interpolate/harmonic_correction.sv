// SPDX-License-Identifier: Apache-2.0
// harmonic_correction -- subtract from a phase its correction, interpolated linearly in a table of
// 256 points.
//
// latency  4 cycles from valid to done
// rate     one phase per cycle; one table entry per cycle without a phase
// behaviour There are two tables: one is in use while the other is written. swap exchanges them
//          between two phases, so no phase ever uses a partially written table. Until the first
//          swap nothing is corrected. With AXES above 1 each axis has its own two tables. An entry
//          is stored in the next cycle without a phase after write; one that is written before
//          then takes its place.
// method   All tables are in one memory with two ports, which take one block RAM for one or two
//          axes. One port reads the even points and the other one the odd ones, so both neighbours
//          of a phase are read at once; the port of the even points also writes. The correction is
//          the sum of both neighbours, each weighted with the distance of the phase from the other
//          one.
// accuracy the chords of a sine of order 9 leave 0.6 % of it, those of order 2 leave 0.03 %
// source   Fourier series of the sub-division error, orders up to 9
//          (sw/firmware/calibration/calibration.c)
// model    tb/interpolate/harmonic_correction.py, equal in every bit of every cycle
`default_nettype none

module harmonic_correction #(
    parameter  int AXES = 1,                            // axes that are served
    // bits of the number of an axis
    localparam int A    = AXES == 1 ? 1 : $clog2(AXES)
) (
    input wire clk,
    input wire rst,  // level: nothing is corrected until swap
    input wire [AXES-1:0] enable,  // levels: bit n 0: phases of axis n pass unchanged, same latency
    input wire [A-1:0] table_axis,  // number of the axis that write and swap are for
    input wire write,  // strobe: store value at point of the table not in use
    input wire [7:0] point,  // 2^-8 period: index of the table entry
    input wire signed [17:0] value,  // 2^-20 period: the correction at that point
    input wire swap,  // strobe: exchange the tables from this cycle on
    input wire valid,  // strobe: phase is new
    input wire [A-1:0] axis,  // number of its axis; 0 for one axis
    input wire [15:0] phase,  // 2^-16 period
    output logic done,  // strobe: phase_out is new
    output logic [15:0] phase_out  // 2^-16 period: phase less its correction, rounded
);
    localparam int B = AXES == 1 ? 9 : A + 9;  // bits of an address: axis, table, point

    // nothing that is read while an entry is stored is used, so the memory need not care what that
    // would be
    (* no_rw_check *)logic signed [ 17:0] tables                                [0:(1<<B)-1];
    logic                waits;  // an entry waits to be stored
    logic        [B-1:0] entry;  // its address
    logic signed [ 17:0] entry_value;
    logic [AXES-1:0] page, swapped;  // the table in use; swapped: there is one
    logic signed [17:0] even, odd, even_q, odd_q;
    logic [8:0] odd_weight, odd_weight_q, even_weight_q;  // 2^-8
    logic signed [26:0] odd_part, even_part;
    logic [15:0] phase_q, phase_qq, phase_qqq;
    logic acts_q, acts_qq, read, weighed, multiplied;

    wire                swap_here = swap && axis == table_axis;
    wire                in_force = page[axis] ^ swap_here;
    wire                spare = !(page[table_axis] ^ swap);  // the table that can be written
    wire        [  6:0] even_point = phase[15:9] + 7'(phase[8]);
    wire signed [ 26:0] sum = even_part + odd_part;  // 2^-28 period
    // The correction is rounded by its next bit.
    wire        [ 15:0] change = 16'(sum >>> 12);  // 2^-16 period
    wire        [ 15:0] corrected = 16'(({phase_qqq, 1'b1} + {~change, !sum[11]}) >> 1);

    wire                store = waits && !valid;
    wire        [B-1:0] even_at = store ? entry : B'({axis, in_force, even_point, 1'b0});

    always_ff @(posedge clk) begin
        if (store) tables[even_at] <= entry_value;
        even <= tables[even_at];
        odd  <= tables[B'({axis, in_force, phase[15:9], 1'b1})];
    end

    always_ff @(posedge clk) begin
        read    <= valid;
        weighed   <= read;
        multiplied <= weighed;
        done    <= multiplied;
        if (valid) begin
            phase_q    <= phase;
            acts_q     <= enable[axis] && (swapped[axis] || swap_here);
            odd_weight <= phase[8] ? 9'd256 - 9'(phase[7:0]) : 9'(phase[7:0]);
        end
        if (read) begin
            phase_qq      <= phase_q;
            acts_qq       <= acts_q;
            even_q        <= even;
            odd_q         <= odd;
            odd_weight_q  <= odd_weight;
            even_weight_q <= 9'd256 - odd_weight;
        end
        if (weighed) begin
            phase_qqq <= phase_qq;
            even_part <= 27'(even_q * $signed({1'b0, even_weight_q}));
            odd_part  <= 27'(odd_q * $signed({1'b0, odd_weight_q}));
            if (!acts_qq) {even_part, odd_part} <= '0;
        end
        if (multiplied) phase_out <= corrected;
        waits <= write || (waits && valid);
        if (write) begin
            entry       <= B'({table_axis, spare, point});
            entry_value <= value;
        end
        if (swap) begin
            page[table_axis]    <= !page[table_axis];
            swapped[table_axis] <= 1'b1;
        end
        if (rst) begin
            waits     <= 1'b0;
            read      <= 1'b0;
            weighed     <= 1'b0;
            multiplied   <= 1'b0;
            done      <= 1'b0;
            page      <= '0;
            swapped   <= '0;
            phase_out <= '0;
        end
    end
endmodule

`default_nettype wire
