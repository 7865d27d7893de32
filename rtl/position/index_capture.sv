// SPDX-License-Identifier: Apache-2.0
// index_capture -- latch the position of one index until it has been read: the smallest form of
// position_capture, for an axis that only needs it to home.
//
// latency  1 cycle from index to present and captured_position
// rate     one index until pop or clear
// behaviour The first enabled index is held until pop or clear; further ones are dropped and
//          reported by overrun. An index together with pop or clear is dropped: overrun reports it
//          with pop, nothing does with clear, as in position_capture.
// source   S3: an edge of the reference mark latches the position counter and sets a flag
// model    tb/position/index_capture.py, equal in every bit of every cycle
// proved   The position belongs to the cycle of its index and does not change while present is
//          high; an enabled index is captured, reported by overrun or cleared.
// proof    depth 6
`default_nettype none

module index_capture (
    input  wire                clk,
    input  wire                rst,
    input  wire                enabled,            // setting: an index captures
    input  wire                index,              // strobe: an index was found
    input  wire signed  [47:0] position,           // Q32.16 periods
    input  wire                pop,                // strobe: remove the capture, if any
    input  wire                clear,              // strobe: remove the capture
    output logic               present,            // level: captured_position is valid
    output logic signed [47:0] captured_position,  // Q32.16 periods
    output logic               overrun             // strobe: an index was dropped
);
    wire event_now = enabled && index && !clear;
    wire take = event_now && !present;

    always_ff @(posedge clk) begin
        if (take) captured_position <= position;
        present <= take || (present && !pop && !clear);
        overrun <= event_now && present;
        if (rst) begin
            present           <= 1'b0;
            overrun           <= 1'b0;
            captured_position <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if ($past(present) && present) assert (captured_position == $past(captured_position));
            if (!$past(present) && present) begin
                assert ($past(index) && $past(enabled));
                assert (captured_position == $past(position));
            end
            if ($past(index) && $past(enabled) && !$past(clear))
                assert (overrun || (present && captured_position == $past(position)));
            if ($past(present) && !$past(pop) && !$past(clear)) assert (present);
            cover (overrun && present);
            cover (present && $past(pop, 2));
        end
    end
`endif
endmodule

`default_nettype wire
