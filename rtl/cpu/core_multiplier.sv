// SPDX-License-Identifier: Apache-2.0
// core_multiplier -- compute products for the soft core (mul, mulh, mulhsu, mulhu) from four
// products of half the width.
//
// latency   2 cycles from valid to ready
// rate      one instruction in 3 cycles
// behaviour The soft core keeps valid, instruction, a and b as they are until ready. Other
//           instructions are ignored.
// method    The products of the halves are registered before they are added: the multiplier of the
//           core itself does both in one cycle, which would be the longest path of the node.
// source    PCPI of PicoRV32: valid is pcpi_valid, ready is pcpi_ready
// model     tb/cpu/core_multiplier.py, equal in every bit of every cycle
// proved    With ready, the result is that of the RISC-V specification for all operands, and ready
//           comes 2 cycles after valid.
// proof     depth 6, W = 4
`default_nettype none

module core_multiplier #(
    parameter int W = 32  // bits of a and b, even
) (
    input  wire          clk,
    input  wire          rst,
    input  wire          valid,        // level: the core executes an instruction of a co-processor
    // verilator lint_off UNUSEDSIGNAL
    input  wire  [ 31:0] instruction,  // its code, of which the numbers of registers are not used
    // verilator lint_on UNUSEDSIGNAL
    input  wire  [W-1:0] a,            // factor
    input  wire  [W-1:0] b,            // factor
    output logic         ready,        // strobe: result is that of the instruction
    output logic [W-1:0] result        // low or high half of the product, with ready
);
    localparam int H = W / 2;  // bits of a half
    localparam bit [6:0] OPERATION = 7'b0110011, PRODUCT_OR_QUOTIENT = 7'b0000001;

    if (W < 2 || W % 2 != 0) begin : g_check
        W_MUST_BE_EVEN u_error ();
    end

    wire multiplication = instruction[6:0] == OPERATION && instruction[31:25] == PRODUCT_OR_QUOTIENT
        && !instruction[14];
    wire high = instruction[13:12] != 2'b00;
    wire a_signed = instruction[13] != instruction[12];  // mulh, mulhsu
    wire b_signed = !instruction[13];  // mulh; the low half of mul is the same with any sign

    wire signed [H:0] a_low = {1'b0, a[H-1:0]}, a_high = {a_signed && a[W-1], a[W-1:H]};
    wire signed [H:0] b_low = {1'b0, b[H-1:0]}, b_high = {b_signed && b[W-1], b[W-1:H]};

    logic busy;  // the products of the halves are those of the instruction
    logic [W-1:0] low_low;
    logic signed [W+1:0] low_high, high_low, high_high;

    // the product without its lowest H bits
    wire signed [W+2:0] middle = (W + 3)'(low_high) + (W + 3)'(high_low) + $signed(
        {3'd0, {H{1'b0}}, low_low[W-1:H]}
    );
    wire [W-1:0] upper = high_high[W-1:0] + W'(middle >>> H);
    wire unused = &{1'b0, high_high[W+1:W]};

    always_ff @(posedge clk) begin
        busy  <= valid && multiplication && !busy && !ready;
        ready <= busy;
        if (valid && !busy) begin
            low_low   <= W'(a_low * b_low);
            low_high  <= a_low * b_high;
            high_low  <= a_high * b_low;
            high_high <= a_high * b_high;
        end
        if (busy) result <= high ? upper : {middle[H-1:0], low_low[H-1:0]};
        if (rst) begin
            busy  <= 1'b0;
            ready <= 1'b0;
        end
    end

`ifdef FORMAL
    logic                 past = 1'b0;
    logic       [    1:0] waited = '0;
    wire signed [2*W-1:0] wide_a = {{W{a_signed && a[W-1]}}, a};
    wire signed [2*W-1:0] wide_b = {{W{b_signed && b[W-1]}}, b};
    wire        [2*W-1:0] product = wide_a * wide_b;
    always @(posedge clk) begin
        past   <= 1'b1;
        waited <= !rst && valid && multiplication && !ready ? waited + 1'b1 : '0;
        if (!past) assume (rst);
        if (past && $past(valid) && !$past(ready) && !$past(rst)) begin
            assume (valid && $stable(instruction) && $stable(a) && $stable(b));
        end
        if (past && ready && !$past(rst)) begin
            assert (waited == 2'd2 && valid && multiplication);
            assert (result == (high ? product[2*W-1:W] : product[W-1:0]));
        end
        if (past) begin
            assert (busy == (waited == 2'd1) && ready == (waited == 2'd2));
            assert (!busy || (valid && multiplication));
        end
        cover (past && ready && high && a_signed && !b_signed && result == '1);
    end
`endif
endmodule

`default_nettype wire
