// SPDX-License-Identifier: Apache-2.0
// relay_status -- collect what the blocks of a relay report, and decide whether it corrects.
//
// latency  0 cycles, combinational
// rate     one event of each kind per cycle
// behaviour  The relay corrects when a set is loaded and the index has shown where the angle
//          begins. A set that is refused is an event only if the host has sent it.
// model    tb/relay/relay_status.py, equal for all inputs
`default_nettype none

module relay_status (
    input  wire        known,             // level: the index has come, the angle is known
    input  wire        loaded,            // level: a set is loaded
    input  wire        reading,           // level: a set is being read from the flash
    input  wire        moved,             // level: an edge has come since reset
    input  wire        illegal,           // strobe: both levels changed at once
    input  wire        revolution_wrong,  // strobe: the counts between two indexes are wrong
    input  wire        missing,           // strobe: no index came where one must be
    input  wire  [2:0] rejected,          // strobes {z, b, a}: the filter rejected a pulse
    input  wire        behind,            // level: the output is more than 4 counts behind
    input  wire        set_bad,           // strobe: a set was refused
    input  wire  [7:0] flags,             // sticky events, bits as in events
    output logic       correcting,        // level: the output is corrected
    output logic       fault,             // level: a flag is set
    output logic       follow,            // level: the output takes the levels of the input
    output logic [7:0] events,            // bits 0 to 5 as in the header of relay
    output logic [7:0] levels             // bits 0 to 3 as in the header of relay
);
    assign correcting = known && loaded;
    assign fault      = |flags;
    assign follow     = !moved;
    assign events = {
        2'd0, set_bad && !reading, behind, |rejected, missing, revolution_wrong, illegal
    };
    assign levels = {4'd0, reading, correcting, loaded, known};
endmodule

`default_nettype wire
