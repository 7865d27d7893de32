// SPDX-License-Identifier: Apache-2.0
// link_registers -- the register block of real-time link: packets of process data, in hardware
// (docs/link.md).
//
// latency  1 cycle from select to rdata, and from a write to the new value
// rate     one access per cycle
// behaviour rdata has the live bits of a register only; register_memory answers with its settings.
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle
// made     by tables/registers.py, not to be edited
`default_nettype none

module link_registers (
    input  wire               clk,
    input  wire               rst,                      // settings take their first values
    input  wire               select,                   // strobe: access to this block
    input  wire               write,                    // level: it writes wdata
    input  wire        [ 5:0] word,                     // index of the word
    input  wire        [31:0] wdata,                    // value to write
    output logic       [31:0] rdata,                    // live bits read; else 0
    // number of the session, which the host has drawn; change it, and all below, while `enable` is
    // 0
    output logic       [23:0] session,
    // values that a request writes, at most 121
    output logic       [ 6:0] lists_writes,
    output logic       [ 6:0] lists_reads,              // values that a reply has, at most 121
    // number of the entry of the lists that `entry` stores
    output logic       [ 6:0] entry_number,
    // byte address of the register that is written
    output logic       [15:0] entry_write,
    // byte address of the register that is read
    output logic       [15:0] entry_read,
    output logic              entry_written,            // strobe: new value
    // largest difference between the time in a request and that of the node; 0: not checked [cycle]
    output logic       [23:0] time_window,
    // longest time without a good request while the link is on; 0: no limit [0.001 s]
    output logic       [15:0] watchdog_time,
    // duration of one bit of the serial line; at least 4 cycles [1/16 cycle]
    output logic       [19:0] bit_time,
    // switches the link on; while it is 0, every packet is refused
    output logic              enable,
    input  wire               state_built,              // the node has a link
    input  wire               state_on,                 // the link is on
    input  wire               state_busy,               // a request is being played or answered
    input  wire               state_expired,            // no good request for `watchdog_time`
    // session of the host that has switched the link on
    input  wire        [23:0] state_session,
    // refused packets; each count wraps at 256: damaged
    input  wire        [ 7:0] refused_damaged,
    // refused packets; each count wraps at 256: foreign
    input  wire        [ 7:0] refused_foreign,
    // refused packets; each count wraps at 256: wrong length
    input  wire        [ 7:0] refused_wrong_length,
    // refused packets; each count wraps at 256: replayed
    input  wire        [ 7:0] refused_replayed,
    // packets refused for their moment; each count wraps at 256: out of time
    input  wire        [ 7:0] refused_now_out_of_time,
    // packets refused for their moment; each count wraps at 256: busy
    input  wire        [ 7:0] refused_now_busy,
    // strobe: losses on the carrier: serial, bytes without a stop bit; SPI, transfers that ended
    // within the request or the reply; 0 for UDP, where a damaged datagram counts as a refused
    // packet. Writing clears the count
    input  wire               framing_errors,
    // PLL: time from one request to the next, as the host has set it, at least 2048 cycles; 0: off.
    // Change it while `enable` is 0 [cycle]
    output logic       [19:0] pll_period,
    // PLL: time from a capture of the read list to the expected request, at most 3/8 of
    // `pll_period`. Change it while `enable` is 0 [cycle]
    output logic       [18:0] capture_lead,
    input  wire               pll_state_built,          // the link has a PLL
    // it is locked: a capture is made before each expected request
    input  wire               pll_state_locked,
    // as a value of a reply: it was read for a capture, not when the request came
    input  wire               pll_state_captured,
    // how much later than expected the last request came; 0 at the first one [cycle]
    input  wire signed [23:0] pll_state_phase_error,
    // time of the node, low word, when the reading of the read list began; 0 in a node without a
    // PLL [cycle]
    input  wire        [31:0] read_time
);
    logic [15:0] framing_errors_count;
    wire  [16:0] framing_errors_next = {1'b0, framing_errors_count} + 17'(framing_errors);
    logic        get_state;
    logic        get_refused;
    logic        get_refused_now;
    logic        get_framing_errors;
    logic        get_pll_state;
    logic        get_read_time;

    wire         get = select && !write;
    wire         put = select && write;

    // words read in the cycle before
    assign rdata = ({32{get_state}} & {state_session, 4'd0, state_expired, state_busy, state_on,
        state_built}) | ({32{get_refused}} & {refused_replayed, refused_wrong_length,
        refused_foreign, refused_damaged}) | ({32{get_refused_now}} & {16'd0, refused_now_busy,
        refused_now_out_of_time}) | ({32{get_framing_errors}} & {16'd0, framing_errors_count}) |
        ({32{get_pll_state}} & {pll_state_phase_error, 5'd0, pll_state_captured, pll_state_locked,
        pll_state_built}) | ({32{get_read_time}} & read_time);

    always_ff @(posedge clk) begin
        get_state <= get && word == 6'h08;
        get_refused <= get && word == 6'h09;
        get_refused_now <= get && word == 6'h0A;
        get_framing_errors <= get && word == 6'h0B;
        get_pll_state <= get && word == 6'h0E;
        get_read_time <= get && word == 6'h0F;

        if (put && word == 6'h00) session <= wdata[23:0];
        if (put && word == 6'h01) lists_writes <= wdata[6:0];
        if (put && word == 6'h01) lists_reads <= wdata[14:8];
        if (put && word == 6'h02) entry_number <= wdata[6:0];
        entry_written <= put && word == 6'h03;
        if (put && word == 6'h03) entry_write <= wdata[15:0];
        if (put && word == 6'h03) entry_read <= wdata[31:16];
        if (put && word == 6'h04) time_window <= wdata[23:0];
        if (put && word == 6'h05) watchdog_time <= wdata[15:0];
        if (put && word == 6'h06) bit_time <= wdata[19:0];
        if (put && word == 6'h07) enable <= wdata[0];
        if (put && word == 6'h0B) framing_errors_count <= 16'(framing_errors);
        else if (!framing_errors_next[16]) framing_errors_count <= framing_errors_next[15:0];
        if (put && word == 6'h0C) pll_period <= wdata[19:0];
        if (put && word == 6'h0D) capture_lead <= wdata[18:0];

        if (rst) begin
            get_state <= 1'b0;
            get_refused <= 1'b0;
            get_refused_now <= 1'b0;
            get_framing_errors <= 1'b0;
            get_pll_state <= 1'b0;
            get_read_time <= 1'b0;
            session <= 24'h000000;
            lists_writes <= 7'h00;
            lists_reads <= 7'h00;
            entry_number <= 7'h00;
            entry_written <= 1'b0;
            entry_write <= 16'h0000;
            entry_read <= 16'h0000;
            time_window <= 24'h000000;
            watchdog_time <= 16'h0000;
            bit_time <= 20'h00140;
            enable <= 1'b0;
            framing_errors_count <= '0;
            pll_period <= 20'h00000;
            capture_lead <= 19'h00000;
        end
    end
endmodule

`default_nettype wire
