// SPDX-License-Identifier: Apache-2.0
// power_up_bench -- registers with and without reset, and a memory without contents.
`default_nettype none

module power_up_bench (
    input  wire         clk,
    input  wire         rst,
    input  wire         take,     // level: the registers keep their value without it
    output logic [31:0] reset,    // 0 after reset
    output logic [31:0] unknown,  // any value after power-up
    output wire  [31:0] stored    // any value after power-up
);
    logic [31:0] memory[4];

    assign stored = memory[unknown[1:0]];

    always_ff @(posedge clk) begin
        if (take) begin
            reset                <= reset + 1;
            unknown              <= unknown + 1;
            memory[unknown[1:0]] <= '0;
        end
        if (rst) reset <= '0;
    end
endmodule

`default_nettype wire
