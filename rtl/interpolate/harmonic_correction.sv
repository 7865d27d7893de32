// SPDX-License-Identifier: Apache-2.0
// harmonic_correction -- subtract from a phase its correction, interpolated linearly in a table of
// 256 points.
//
// latency  4 cycles from valid to done
// rate     one phase per cycle; one table entry per cycle
// behaviour There are two tables: one is in use while the other is written. swap exchanges them
//          between two phases, so no phase ever uses a partially written table. Until the first
//          swap nothing is corrected.
// accuracy the chords of a sine of order 9 leave 0.6 % of it, those of order 2 leave 0.03 %
// source   Fourier series of the sub-division error, orders up to 9
//          (sw/firmware/calibration/calibration.c)
// model    tb/interpolate/harmonic_correction.py, equal in every bit of every cycle
`default_nettype none

module harmonic_correction (
    input  wire               clk,
    input  wire               rst,       // level: nothing is corrected until swap
    input  wire               enable,    // level: 0: the phase passes unchanged, same latency
    input  wire               write,     // strobe: store value at point of the table not in use
    input  wire        [ 7:0] point,     // 2^-8 period: index of the table entry
    input  wire signed [17:0] value,     // 2^-20 period: the correction at that point
    input  wire               swap,      // strobe: exchange the tables from this cycle on
    input  wire               valid,     // strobe: phase is new
    input  wire        [15:0] phase,     // 2^-16 period
    output logic              done,      // strobe: phase_out is new
    output logic       [15:0] phase_out  // 2^-16 period: phase less its correction, rounded
);
    logic signed [17:0] here_table[0:511];  // two copies, because two points are read at once
    logic signed [17:0] next_table[0:511];
    logic page, swapped;  // the table in use; swapped: there is one
    logic signed [17:0] here, next, here_q, here_qq;
    logic signed [18:0] rise;
    logic signed [26:0] climb;
    logic [15:0] phase_q, phase_qq, phase_qqq;
    logic acts_q, acts_qq, acts_qqq, read, risen, climbed;

    wire               in_force = page ^ swap;
    wire        [ 7:0] above = phase[15:8] + 1'b1;
    wire signed [26:0] sum = $signed({here_qq[17], here_qq, 8'd0}) + climb + 27'sd2048;
    wire signed [14:0] change = 15'(sum >>> 12);  // rounded to 2^-16 period

    always_ff @(posedge clk) begin
        if (write) begin
            here_table[{!in_force, point}] <= value;
            next_table[{!in_force, point}] <= value;
        end
        here <= here_table[{in_force, phase[15:8]}];
        next <= next_table[{in_force, above}];
    end

    always_ff @(posedge clk) begin
        read    <= valid;
        risen   <= read;
        climbed <= risen;
        done    <= climbed;
        if (valid) begin
            phase_q <= phase;
            acts_q  <= enable && (swapped || swap);
        end
        if (read) begin
            phase_qq <= phase_q;
            acts_qq  <= acts_q;
            here_q   <= here;
            rise     <= 19'(next) - 19'(here);
        end
        if (risen) begin
            phase_qqq <= phase_qq;
            acts_qqq  <= acts_qq;
            here_qq   <= here_q;
            climb     <= 27'(rise * $signed({1'b0, phase_qq[7:0]}));
        end
        if (climbed) phase_out <= phase_qqq - (acts_qqq ? 16'(change) : 16'd0);
        if (swap) begin
            page    <= !page;
            swapped <= 1'b1;
        end
        if (rst) begin
            read      <= 1'b0;
            risen     <= 1'b0;
            climbed   <= 1'b0;
            done      <= 1'b0;
            page      <= 1'b0;
            swapped   <= 1'b0;
            phase_out <= '0;
        end
    end
endmodule

`default_nettype wire
