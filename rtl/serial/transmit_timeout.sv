// SPDX-License-Identifier: Apache-2.0
// transmit_timeout -- switch off the driver of a shared line that has been on for longer than any
// reply takes.
//
// latency   0 cycles from requested to driver_enable, and from the last of 8 * BITS ticks, 1 cycle,
//           to expired
// behaviour Once expired, the driver stays off until it is no longer requested.
// source    RS-485: one driver that stays on silences the line for all nodes
// model     tb/serial/transmit_timeout.py, equal in every bit of every cycle
// proved    The driver is on only while it is requested. Once expired, it is off until it is no
//           longer requested.
`default_nettype none

module transmit_timeout #(
    parameter int BITS = 1024  // bit times, a power of two from 16 up; the longest reply takes 770
) (
    input  wire  clk,
    input  wire  rst,
    input  wire  tick,           // strobe: an eighth of a bit, while requested
    input  wire  requested,      // level: something is being sent
    output logic driver_enable,  // level: the line driver is on
    output logic expired         // strobe: the driver has been switched off
);
    localparam int T = $clog2(BITS) + 3;

    if (BITS < 16 || BITS != 1 << $clog2(BITS)) begin : g_check
        BITS_MUST_BE_A_POWER_OF_2_FROM_16_UP u_error ();
    end

    logic [T:0] spent;  // ticks that the driver has been on, up to 8 * BITS
    logic       reported;

    wire        off = spent[T];

    assign driver_enable = requested && !off;
    assign expired       = off && !reported;

    always_ff @(posedge clk) begin
        if (!requested) spent <= '0;
        else if (tick && !off) spent <= spent + 1'b1;
        reported <= off;
        if (rst) spent <= '0;
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (driver_enable) assert (requested);
        if (past && !$past(rst)) begin
            if (expired) assert (!driver_enable);
            if ($past(requested) && !$past(driver_enable) && requested) assert (!driver_enable);
            cover (driver_enable && spent == (T + 1)'(3));
        end
    end
`endif
endmodule

`default_nettype wire
