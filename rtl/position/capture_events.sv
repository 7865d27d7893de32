// SPDX-License-Identifier: Apache-2.0
// capture_events -- make the events that capture a position from the index, the software strobe and
// the sync pulse of the bus.
//
// latency  0 cycles for software, and for the index of a position made of phases; DELAY cycles for
//          the index of a position made of counts
// rate     one event per cycle
// behaviour  A position made of counts lags behind its index by DELAY cycles, so the index waits
//          until the position of its own count is there.
// model    tb/position/capture_events.py, equal in every bit of every cycle
`default_nettype none

module capture_events #(
    parameter int DELAY = 2  // cycles from an index to the position of its count
) (
    input  wire  clk,
    input  wire  rst,
    input  wire  by_counts,    // level: the position is made of counts
    input  wire  index_found,  // strobe: the decoder found an index
    input  wire  capture_now,  // strobe: the software captures
    input  wire  sync,         // strobe: the sync pulse of the bus captures
    output logic index,        // strobe: capture the index
    output logic software      // strobe: capture for software or sync
);
    if (DELAY < 2) begin : g_check
        DELAY_MUST_BE_AT_LEAST_2 u_error ();
    end

    logic [DELAY-1:0] delayed;

    always_ff @(posedge clk) delayed <= rst ? '0 : {delayed[DELAY-2:0], index_found};

    assign index    = by_counts ? delayed[DELAY-1] : index_found;
    assign software = capture_now || sync;
endmodule

`default_nettype wire
