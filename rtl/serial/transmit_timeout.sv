// SPDX-License-Identifier: Apache-2.0
// transmit_timeout -- switch off the driver of a shared line that has been on for longer than any
// reply takes.
//
// latency   0 cycles from requested to driver_enable; expired comes BITS bit times and 1 cycle
//           after requested rose.
// behaviour Once expired, the driver stays off until it is no longer requested.
// source    RS-485: one driver that stays on silences the line for all nodes
// model     tb/serial/transmit_timeout.py, equal in every bit of every cycle
// proved    The driver is on only while it is requested. Once expired, it is off until it is no
//           longer requested.
`default_nettype none

module transmit_timeout #(
    parameter int BITS = 1024  // bit times, a power of two from 16 up; the longest reply takes 770
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [19:0] bit_time,       // 1/16 cycle; less than 8 cycles counts as 8
    input  wire         requested,      // level: something is being sent
    output logic        driver_enable,  // level: the line driver is on
    output logic        expired         // strobe: the driver has been switched off
);
    localparam int E = $clog2(BITS) - 4;

    if (BITS < 16 || BITS != 1 << $clog2(BITS)) begin : g_check
        BITS_MUST_BE_A_POWER_OF_2_FROM_16_UP u_error ();
    end

    logic [19+E:0] spent;  // cycles that the driver has been on
    logic          off;

    wire  [  19:0] whole = |bit_time[19:7] ? bit_time : 20'd128;

    wire           too_long = spent >= (20 + E)'(whole) << E;

    assign driver_enable = requested && !off;

    always_ff @(posedge clk) begin
        expired <= 1'b0;
        if (!requested) begin
            spent <= '0;
            off   <= 1'b0;
        end else if (!off) begin
            spent   <= spent + 1'b1;
            off     <= too_long;
            expired <= too_long;
        end
        if (rst) begin
            spent   <= '0;
            off     <= 1'b0;
            expired <= 1'b0;
        end
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
            cover (driver_enable && spent == 3);
        end
    end
`endif
endmodule

`default_nettype wire
