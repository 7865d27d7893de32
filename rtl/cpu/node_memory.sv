// SPDX-License-Identifier: Apache-2.0
// node_memory -- block memory of the soft core, written byte by byte, which holds the firmware at
// power-up.
//
// latency   1 cycle from read_address to rdata
// rate      one access per cycle, a read or a write
// behaviour The memory reads in every cycle without a write; rdata keeps its word during a write.
// model     tb/cpu/node_memory.py, equal in every bit of every cycle
`default_nettype none

module node_memory #(
    parameter int BYTES    = 32768,  // bytes, a multiple of 1024
    parameter     FIRMWARE = ""      // name of a file of 32-bit words for $readmemh; "": none
) (
    input  wire                      clk,
    input  wire  [              3:0] write,          // strobe: write byte n of the word for bit n
    input  wire  [$clog2(BYTES)-3:0] write_address,  // number of a word
    input  wire  [             31:0] wdata,          // word to be written
    input  wire  [$clog2(BYTES)-3:0] read_address,   // number of a word
    output logic [             31:0] rdata           // word read last
);
    if (BYTES < 1024 || BYTES % 1024 != 0) begin : g_check
        BYTES_MUST_BE_A_MULTIPLE_OF_1024 u_error ();
    end

    logic [31:0] memory[0:BYTES/4-1];

    initial if (FIRMWARE != "") $readmemh(FIRMWARE, memory);

    always_ff @(posedge clk) begin
        for (int n = 0; n < 4; n++) if (write[n]) memory[write_address][8*n+:8] <= wdata[8*n+:8];
        if (write == '0) rdata <= memory[read_address];
    end
endmodule

`default_nettype wire
