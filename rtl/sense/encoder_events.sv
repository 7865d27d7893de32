// SPDX-License-Identifier: Apache-2.0
// encoder_events -- collect the events of the measuring path, and derive the encoder fault from
// them.
//
// latency  0 cycles, combinational
// rate     one event of each kind per cycle
// behaviour  A rejected pulse of a is only a glitch in the quadrature modes. In the mode pulses
//          and direction it is a lost step, unless the axis counts its own steps.
// model    tb/sense/encoder_events.py, equal for all inputs
// proved   The fault is high exactly while an event or a signal fault is present that its mask
//          enables.
`default_nettype none

module encoder_events (
    input  wire  [ 5:0] event_mask,         // which events are a fault, bits as in events
    input  wire  [14:0] signal_fault_mask,  // which signal faults are a fault
    input  wire  [ 1:0] decoder_mode,       // 3: pulses and direction
    input  wire         own_steps,          // level: the axis counts its own steps
    input  wire         illegal_edge,       // strobe: a and b changed together
    input  wire         overspeed,          // strobe: the phase jumped, or a sample was lost
    input  wire         disagreement,       // strobe: position and count differ
    input  wire  [14:0] signal_faults,      // levels, bit 0 amplitude low, 1 amplitude high
    input  wire  [ 2:0] edge_rejected,      // strobes {z, b, a}: the filter rejected a pulse
    output logic [ 5:0] events,             // strobes, bits as in axis_registers.encoder_events
    output logic        pulse_rejected,     // strobe: the filter rejected a pulse
    output logic        disturbed,          // level: the amplitude or the speed is out of range
    output logic        fault               // level: an enabled event or signal fault is present
);
    localparam [1:0] PULSES = 2'd3;

    wire pulse_too_short = decoder_mode == PULSES && !own_steps && edge_rejected[0];

    assign events = {
        pulse_too_short, disagreement, signal_faults[1], signal_faults[0], overspeed, illegal_edge
    };
    assign pulse_rejected = |edge_rejected;
    assign disturbed      = |signal_faults[1:0] || overspeed;
    assign fault          = |(events & event_mask) || |(signal_faults & signal_fault_mask);

`ifdef FORMAL
    always_comb begin
        if (illegal_edge && event_mask[0]) assert (fault);
        if (overspeed && event_mask[1]) assert (fault && disturbed);
        if (disagreement && event_mask[4]) assert (fault);
        for (int n = 0; n < 15; n++) if (signal_faults[n] && signal_fault_mask[n]) assert (fault);
        if (event_mask == '0 && signal_fault_mask == '0) assert (!fault);
        if (events == '0 && signal_faults == '0) assert (!fault);
        if ((events & event_mask) == '0 && (signal_faults & signal_fault_mask) == '0)
            assert (!fault);
        if (decoder_mode != PULSES || own_steps) assert (!events[5]);
        cover (fault && events == 6'b10_0000);
        cover (fault && events == '0);
    end
`endif
endmodule

`default_nettype wire
