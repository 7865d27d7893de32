// SPDX-License-Identifier: Apache-2.0
// unwrap -- add up steps to a position whose fraction is always the phase; its origin moves by
// whole periods only.
//
// latency  1 cycle from valid or shift_periods to position
// rate     one step and one shift per cycle, also both at once
// behaviour The position is 0 until the first phase after reset; then it is that phase, and the
//          first step is ignored. step must equal the change of phase modulo one period.
// source   S0: a reversible counter counts the fringes, and the arctangent gives the phase between
//          them
// model    tb/position/unwrap.py, equal in every bit of every cycle
// proved   the fraction is the last phase; a step moves the position by itself and a shift by its
//          periods, also both at once
`default_nettype none

module unwrap (
    input  wire                clk,
    input  wire                rst,            // level: position 0, the next phase is the first
    input  wire                valid,          // strobe: step and phase are new
    input  wire signed  [16:0] step,           // 2^-16 period; the change of phase
    input  wire         [15:0] phase,          // 2^-16 period; becomes the fraction of position
    input  wire signed  [31:0] shift_periods,  // periods that are added to position in each cycle
    output logic               done,           // strobe: position belongs to a new phase
    output logic signed [47:0] position        // Q32.16 periods, wraps
);
    logic               started;
    logic signed [31:0] periods;
    logic        [15:0] fraction;

    // -1, 0 or 1
    wire signed  [ 1:0] carry = 2'((18'(step) + $signed({2'b00, fraction})) >>> 16);
    // Two adders: as one sum of three numbers they would take twice the cells.
    (* keep *)wire signed  [31:0] shifted;

    assign shifted  = periods + shift_periods;
    assign position = {periods, fraction};

    always_ff @(posedge clk) begin
        done    <= valid;
        periods <= shifted + (started && valid ? 32'(carry) : 32'sd0);
        if (valid) begin
            fraction <= phase;
            started  <= 1'b1;
        end
        if (rst) begin
            done     <= 1'b0;
            started  <= 1'b0;
            periods  <= '0;
            fraction <= '0;
        end
    end

`ifdef FORMAL
    wire signed [47:0] stepped_position = position + (valid ? 48'(step) : 48'sd0);
    wire signed [47:0] moved_position = stepped_position + $signed({shift_periods, 16'b0});
    logic              past = 1'b0;
    logic       [15:0] last;  // the last phase
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (valid) last <= phase;
        if (rst) last <= '0;
        if (started && valid) assume (16'(step) == phase - last);
        if (past) assert (position[15:0] == last);
        if (past && !$past(rst)) begin
            assert (done == $past(valid));
            if ($past(started)) begin
                assert (position == $past(moved_position));
            end else begin
                assert (position[47:16] == $past(shifted));
            end
            cover (position == 48'sh0003_8000 && done && $past(
                shift_periods
            ) != 0 && $past(
                step
            ) < 0);
            cover (position < 0 && $past(shift_periods) == 0);
        end
    end
`endif
endmodule

`default_nettype wire
