// SPDX-License-Identifier: Apache-2.0
// block_ram_bench -- a memory with one write and one read port, as the blocks infer it.
`default_nettype none

module block_ram_bench #(
    parameter int W        = 9,     // bits of a word
    parameter int DEPTH    = 2048,  // words
    parameter     CONTENTS = ""     // file of the first contents, for $readmemh
) (
    input  wire                      clk,
    input  wire                      write,
    input  wire  [$clog2(DEPTH)-1:0] write_at,
    input  wire  [            W-1:0] data,
    input  wire                      read,
    input  wire  [$clog2(DEPTH)-1:0] read_at,
    output logic [            W-1:0] word
);
    logic [W-1:0] memory[DEPTH];

    initial if (CONTENTS != "") $readmemh(CONTENTS, memory);

    always_ff @(posedge clk) begin
        if (write) memory[write_at] <= data;
        if (read) word <= memory[read_at];
    end
endmodule

`default_nettype wire
