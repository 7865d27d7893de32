// SPDX-License-Identifier: Apache-2.0
// ps2_arbiter -- select the source of what the PS/2 host receives: the keyboard, whose bytes pass
// unchanged, or a source that injects sequences.
//
// latency  0 cycles: a waiting byte is offered, and taken, in the same cycle
// rate     one byte per frame of the lines
// behaviour  E0 and F0 announce one more code, E1 two. FF is answered by FA and later AA, F2 by
//          three bytes, F0 00 by two, every other command by one. FE from the host after an
//          injected byte asks for that byte again, and never reaches the keyboard.
// limits   An exchange closes 20 ms after its last byte. Whatever is still missing after 1 s (an
//          answer, or the end of a sequence) is no longer expected.
// source   S4: the controller is a keyboard of the EDM machine
// model    tb/peripheral/ps2_arbiter.py, equal in every bit of every cycle
// proof    depth 32, CLK_HZ = 1000
// proved   an injection begins only between the keyboard's sequences, with no command open and the
//          keyboard held; meanwhile the keyboard is heard only in answer to a command; each byte
//          that is taken is the one that was sent
`default_nettype none

module ps2_arbiter #(
    parameter int CLK_HZ = 50_000_000  // Hz, clk frequency
) (
    input wire clk,
    input wire rst,
    // injection
    input wire [15:0] idle_ms,  // ms, silence before it; less than 20 acts as 20
    input wire inject_valid,  // level: a byte waits
    output logic inject_ready,  // with inject_valid: sent in this cycle
    input wire [7:0] inject,  // scan code
    input wire inject_last,  // level: it is the last of its sequence
    output logic injecting,  // level: a sequence is being injected
    output logic typed,  // strobe: the keyboard sent a byte that answers no command
    // keyboard, ps2_host
    input wire keyboard_valid,  // level: a byte of the keyboard waits
    output logic keyboard_ready,  // with keyboard_valid: taken in this cycle
    input wire [7:0] keyboard,  // byte of the keyboard
    input wire keyboard_damaged,  // level: the byte is damaged
    input wire keyboard_busy,  // level: a frame is on its way
    input wire keyboard_held,  // level: the keyboard is held
    output logic keyboard_hold,  // level: hold the keyboard
    output logic command_valid,  // level: a command for the keyboard waits
    input wire command_ready,  // with command_valid: taken in this cycle
    output logic [7:0] command,  // byte for the keyboard
    output logic command_damaged,  // level: send it with wrong parity
    input wire command_sent,  // strobe: the keyboard took the command
    input wire command_unsent,  // strobe: the keyboard did not take it
    // host, ps2_device
    output logic send_valid,  // level: a byte for the host waits
    input wire send_ready,  // strobe: sent
    output logic [7:0] send,  // byte for the host
    output logic send_damaged,  // level: send it with wrong parity
    input wire host_valid,  // level: a command of the host waits
    output logic host_ready,  // with host_valid: taken in this cycle
    input wire [7:0] host,  // command of the host
    input wire host_damaged  // level: the command is damaged
);
    if (CLK_HZ < 1000) begin : g_check
        CLK_HZ_MUST_BE_AT_LEAST_1000 u_error ();
    end

    localparam int MS = CLK_HZ / 1000;
    localparam int EXCHANGE = 20;  // ms
    localparam int LONGEST = 1000;  // ms
    localparam int W = $clog2(MS + 1);
    localparam logic [7:0] RESEND = 8'hFE;

    logic [W-1:0] part;  // cycles of this ms
    // ms since the last byte of keyboard or host
    logic [ 15:0] quiet;
    // codes until the keyboard's sequence is complete
    logic [  1:0] left;
    logic [  1:0] awaited;  // answers of the keyboard still to come
    logic [7:0] order, order_before;  // the last two commands
    logic ordered;  // a command is on its way to the keyboard
    logic keyboard_q;
    logic [7:0] injected;  // the last byte
    logic own;  // it is the last byte that the host received
    logic again;  // and requests it once more

    wire resend = host_valid && host == RESEND && !host_damaged && own;
    wire arrived = keyboard_valid && !keyboard_q;
    wire active = host_valid || ordered || keyboard_valid || keyboard_busy;
    wire open = active || awaited != '0 || quiet < 16'(EXCHANGE);
    wire may = inject_valid && !injecting && left == '0 && !open && quiet >= idle_ms && !again;
    wire ms = part == W'(MS - 1);
    wire given_up = quiet >= 16'(LONGEST);
    wire from_injection = injecting && inject_valid && !open && !again;

    assign keyboard_hold   = injecting ? awaited == '0 : may;
    assign command_valid   = host_valid && !resend;
    assign command         = host;
    assign command_damaged = host_damaged;
    assign host_ready      = resend || command_ready;
    assign send_valid      = again || keyboard_valid || from_injection;
    assign send            = again ? injected : keyboard_valid ? keyboard : inject;
    assign send_damaged    = !again && keyboard_valid && keyboard_damaged;
    assign keyboard_ready  = send_ready && !again;
    assign typed           = arrived && !keyboard_damaged && awaited == '0;
    assign inject_ready    = send_ready && !again && !keyboard_valid;

    always_ff @(posedge clk) begin
        keyboard_q <= keyboard_valid;
        part       <= active || ms ? '0 : part + 1'b1;
        if (active) quiet <= '0;
        else if (ms && !(&quiet)) quiet <= quiet + 1'b1;

        if (command_valid && command_ready) begin
            ordered      <= 1'b1;
            order        <= host;
            order_before <= order;
        end
        if (command_sent || command_unsent) ordered <= 1'b0;

        if (command_sent)
            case (order)
                8'hFF:   awaited <= 2'd2;
                8'hF2:   awaited <= 2'd3;
                8'h00:   awaited <= order_before == 8'hF0 ? 2'd2 : 2'd1;
                RESEND:  if (awaited == '0) awaited <= 2'd1;
                default: awaited <= 2'd1;
            endcase
        else if (arrived && !keyboard_damaged) begin
            if (awaited != '0)
                awaited <= keyboard == RESEND || keyboard == 8'hFC ? 2'd0 : awaited - 1'b1;
        end else if (given_up) awaited <= '0;

        if (arrived && !keyboard_damaged)
            case (keyboard)
                8'hE0, 8'hF0:               left <= left == '0 ? 2'd1 : left;
                8'hE1:                      left <= 2'd2;
                8'hAA:                      left <= '0;
                8'hFA, 8'hFC, 8'hEE, RESEND: ;
                default:                    left <= left == '0 ? '0 : left - 1'b1;
            endcase
        else if (given_up) left <= '0;

        if (may && keyboard_held) injecting <= 1'b1;
        if (inject_ready && inject_last) injecting <= 1'b0;
        if (inject_ready) injected <= inject;
        if (send_ready) own <= again || !keyboard_valid;
        if (send_ready) again <= 1'b0;
        else if (resend) again <= 1'b1;
        if (rst) begin
            part       <= '0;
            quiet      <= '0;
            left       <= '0;
            awaited    <= '0;
            ordered    <= 1'b0;
            keyboard_q <= 1'b0;
            injecting  <= 1'b0;
            own        <= 1'b0;
            again      <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    wire  complete = left == '0 && awaited == '0 && !host_valid && !ordered && !keyboard_valid;
    wire  silent = quiet >= idle_ms && quiet >= 16'd20;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (!send_ready || send_valid);  // as ps2_device does
        assume (!(keyboard_held && (keyboard_valid || keyboard_busy)));
        if (past && !$past(rst)) begin
            if (injecting && !$past(injecting)) assert ($past(complete && silent && keyboard_held));
            if (injecting && awaited == '0) assert (keyboard_hold);
            if ($past(inject_ready))
                assert (own && injected == $past(send) && !$past(send_damaged));
            if (own && $past(own) && !$past(send_ready)) assert ($stable(injected));
        end
        if (past) begin
            if (keyboard_ready && keyboard_valid)
                assert (!inject_ready && send == keyboard && send_damaged == keyboard_damaged);
            if (inject_ready) assert (injecting && send == inject);
            if (send_ready) assert ((keyboard_valid && keyboard_ready) + inject_ready + again == 1);
            if (again) assert (own);
            if (host_valid && host_ready) assert (resend != (command_valid && command_ready));
        end
        cover (past && injecting && $past(inject_ready) && idle_ms > 16'd20);
    end
`endif
endmodule

`default_nettype wire
