// SPDX-License-Identifier: Apache-2.0
// relay_set_source -- select where a correction set comes from: the flash while it is being read,
// else the host.
//
// latency  0 cycles, combinational
// rate     one byte per cycle
// model    tb/relay/relay_set_source.py, equal for all inputs
`default_nettype none

module relay_set_source (
    input  wire        reading,       // level: a set is being read from the flash
    input  wire        stored_start,  // strobe: a set of the flash begins
    input  wire        stored_valid,  // strobe: stored_data is new
    input  wire  [7:0] stored_data,   // byte of the flash
    input  wire        sent_start,    // strobe: a set of the host begins
    input  wire        sent_valid,    // strobe: sent_data is new
    input  wire  [7:0] sent_data,     // byte of the host
    output logic       start,         // strobe: a set begins
    output logic       valid,         // strobe: data is new
    output logic [7:0] data           // byte of the set
);
    assign start = reading ? stored_start : sent_start;
    assign valid = reading ? stored_valid : sent_valid;
    assign data  = reading ? stored_data : sent_data;
endmodule

`default_nettype wire
