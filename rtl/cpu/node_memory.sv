// SPDX-License-Identifier: Apache-2.0
// node_memory -- block memory of the soft core, written by bytes, with the firmware in it at
// power-up.
//
// latency  1 clk from address to rdata
// rate     one access per clk, a read or a write
// source   one port: rdata keeps the last word read while a write is on
// model    tb/cpu/node_memory.py, equal in every bit of every cycle
`default_nettype none

module node_memory #(
    parameter int BYTES    = 32768,  // a multiple of 1024
    parameter     FIRMWARE = ""      // file of 32-bit words, as $readmemh takes them; "": none
) (
    input  wire                      clk,
    input  wire                      read,
    input  wire  [              3:0] write,    // one enable a byte
    input  wire  [$clog2(BYTES)-3:0] address,  // of a word
    input  wire  [             31:0] wdata,
    output logic [             31:0] rdata
);
    if (BYTES < 1024 || BYTES % 1024 != 0) begin : g_check
        BYTES_MUST_BE_A_MULTIPLE_OF_1024 u_error ();
    end

    logic [31:0] memory[0:BYTES/4-1];

    initial if (FIRMWARE != "") $readmemh(FIRMWARE, memory);

    always_ff @(posedge clk) begin
        for (int n = 0; n < 4; n++) if (write[n]) memory[address][8*n+:8] <= wdata[8*n+:8];
        if (read && write == '0) rdata <= memory[address];
    end
endmodule

`default_nettype wire
