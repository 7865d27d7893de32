// SPDX-License-Identifier: Apache-2.0
// core_divider -- compute quotients and remainders for the soft core (div, divu, rem, remu), one
// bit of the quotient per cycle.
//
// latency   W + 2 cycles from valid to ready
// rate      one instruction in W + 3 cycles
// behaviour The soft core keeps valid, instruction, a and b as they are until ready. A divisor of 0
//           and overflow give the results that RISC-V defines. Other instructions are ignored.
// source    PCPI of PicoRV32: valid is pcpi_valid, working is pcpi_wait, ready is pcpi_ready
// model     tb/cpu/core_divider.py, equal in every bit of every cycle
// proved    With ready, the result is that of the RISC-V specification for all operands, and ready
//           comes W + 2 cycles after valid.
// proof     depth 9, W = 4
`default_nettype none

module core_divider #(
    parameter int W = 32  // bits of a and b, 2 or more
) (
    input  wire          clk,
    input  wire          rst,
    input  wire          valid,        // level: the core executes an instruction of a co-processor
    // verilator lint_off UNUSEDSIGNAL
    input  wire  [ 31:0] instruction,  // its code, of which the numbers of registers are not used
    // verilator lint_on UNUSEDSIGNAL
    input  wire  [W-1:0] a,            // dividend
    input  wire  [W-1:0] b,            // divisor
    output logic         working,      // level: the instruction is a division
    output logic         ready,        // strobe: result is that of the instruction
    output logic [W-1:0] result        // quotient or remainder
);
    if (W < 2) begin : g_check
        W_MUST_BE_AT_LEAST_2 u_error ();
    end

    localparam int C = $clog2(W + 1);
    localparam bit [6:0] OPERATION = 7'b0110011, PRODUCT_OR_QUOTIENT = 7'b0000001;

    wire division = instruction[6:0] == OPERATION && instruction[31:25] == PRODUCT_OR_QUOTIENT
        && instruction[14];
    wire is_signed = !instruction[12];
    wire of_remainder = instruction[13];
    wire a_negative = is_signed && a[W-1];
    wire b_negative = is_signed && b[W-1];

    logic busy;
    logic [C-1:0] left;  // bits of the quotient that are still to be found
    logic [W-1:0] remainder;  // less than the magnitude of b
    logic [W-1:0] quotient;  // bits of the magnitude of a that are not used yet, then the quotient

    // An amount is a number without its sign. The remainder minus the amount of b, and whether it
    // is 0 or more; at the beginning, the amount of a, which is added to a remainder of 0. The
    // lowest bits of both operands make the carry that a subtraction needs.
    wire [W:0] wide = {remainder, busy && quotient[W-1]};
    wire minus = busy ? !b_negative : a_negative;
    wire [W:0] operand = {1'b1, (busy ? b : a) ^ {W{minus}}};
    wire [W+2:0] sum = {wide, 1'b1} + {operand, minus};
    wire [W-1:0] difference = sum[W:1];
    wire fits = sum[W+2];
    wire unused = &{1'b0, sum[W+1], sum[0]};

    // A quotient of 3/4 of its range or more comes from a divisor of 0, and is -1 already.
    wire negative = of_remainder ? a_negative : (a_negative != b_negative) && !(&quotient[W-1:W-2]);
    wire [W-1:0] amount = of_remainder ? remainder : quotient;

    assign working = valid && division;

    always_ff @(posedge clk) begin
        ready  <= busy && left == '0;
        result <= (amount ^ {W{negative}}) + W'(negative);
        left   <= left - 1'b1;
        if (!busy) begin
            busy      <= working && !ready;
            left      <= C'(W);
            quotient  <= difference;
        end else if (left == '0) begin
            busy      <= 1'b0;
            remainder <= '0;
        end else begin
            remainder <= fits ? difference : wide[W-1:0];
            quotient  <= {quotient[W-2:0], fits};
        end
        if (rst) begin
            busy      <= 1'b0;
            ready     <= 1'b0;
            remainder <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic [C+1:0] waited = '0;
    wire signed [W-1:0] signed_a = a;
    wire signed [W-1:0] signed_b = b;
    wire overflow = is_signed && a == {1'b1, {W - 1{1'b0}}} && &b;
    wire [W-1:0] signed_quotient = signed_a / signed_b;
    wire [W-1:0] signed_remainder = signed_a % signed_b;
    wire [W-1:0] expected_quotient = b == '0 ? '1 : overflow ? a
        : is_signed ? signed_quotient : a / b;
    wire [W-1:0] expected_remainder = b == '0 ? a : overflow ? '0
        : is_signed ? signed_remainder : a % b;
    always @(posedge clk) begin
        past   <= 1'b1;
        waited <= !rst && working && !ready ? waited + 1'b1 : '0;
        if (!past) assume (rst);
        if (past && $past(valid) && !$past(ready) && !$past(rst)) begin
            assume (valid && $stable(instruction) && $stable(a) && $stable(b));
        end
        if (past && ready && !$past(rst)) begin
            assert (waited == W + 2 && working);
            assert (result == (of_remainder ? expected_remainder : expected_quotient));
        end
        if (past) begin
            assert (!busy || (working && !ready && left <= W && waited == W + 1 - left));
            assert (busy || ready || waited == '0);
            assert (busy || remainder == '0);
        end
        cover (past && ready && of_remainder && a_negative && result != '0);
        cover (past && ready && overflow);
    end
`endif
endmodule

`default_nettype wire
