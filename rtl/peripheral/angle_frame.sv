// SPDX-License-Identifier: Apache-2.0
// angle_frame -- receive the frames of a time-grating angle sensor: A5, sequence number, angle (4
// bytes, low first), CRC-16 (low first).
//
// latency  2 cycles from the last byte to valid
// rate     one byte per 2 cycles
// limits   A frame with a pause of more than `gap` cycles between two bytes is dropped, and the
//          next A5 begins a frame. So an A5 inside a damaged frame does not cost a second frame, if
//          the distance between frames is longer than `gap`.
// source   S4: absolute angle by RS-232. CRC-16 with 0x1021 from 0xFFFF over the six bytes before
//          it
// model    tb/peripheral/angle_frame.py, equal in every bit of every cycle
// proved   valid only after eight bytes that begin with A5 and whose CRC is right; angle and
//          sequence number change only with valid
`default_nettype none

module angle_frame #(
    parameter int W = 16  // bits of the error counts, at least 8; they stop at their largest value
) (
    input wire clk,
    input wire rst,
    input wire [23:0] gap,  // cycles, longest pause between the ends of two bytes
    input wire [31:0] stale_after,  // cycles without a good frame; 0: never stale
    input wire byte_valid,  // strobe, of uart_rx with NINTH = 0
    input wire [7:0] byte_data,  // byte
    input wire framing_error,  // strobe: the byte had no stop bit
    input wire clear,  // strobe: counts to 0
    output logic valid,  // strobe: a good frame
    output logic [31:0] angle,  // 2^-32 turn, of the last good frame
    output logic [7:0] sequence_number,  // of the last good frame
    output logic [31:0] age,  // cycles since its first byte; stops at its largest value
    output logic stale,  // level: no good frame yet, or age is above stale_after
    output logic [W-1:0] crc_errors,  // frames with a wrong CRC
    output logic [W-1:0] broken,  // frames with a pause or a framing error inside
    output logic [W-1:0] missed  // frames left out by the numbers, with the damaged ones
);
    if (W < 8) begin : g_check
        W_MUST_BE_AT_LEAST_8 u_error ();
    end

    logic [ 3:0] bytes_taken;  // bytes of this frame; 0: waits for A5, 8: complete
    logic [47:0] shifted;  // the last six of them, the newest highest
    logic [15:0] crc;  // over the first six bytes
    logic [23:0] silent;  // cycles since the last byte
    logic [31:0] elapsed;  // cycles since the first byte
    logic [ 7:0] number;  // sequence of this frame
    logic        known;  // there was a good frame

    function automatic [15:0] crc_of(input [15:0] sum, input [7:0] data);
        crc_of = sum ^ {data, 8'd0};
        for (int n = 0; n < 8; n++) crc_of = {crc_of[14:0], 1'b0} ^ (crc_of[15] ? 16'h1021 : 16'd0);
    endfunction

    function automatic [W-1:0] more(input [W-1:0] count, input [7:0] by);
        more = {1'b0, count} + (W + 1)'(by) > {1'b0, {W{1'b1}}} ? '1 : count + W'(by);
    endfunction

    wire       whole = bytes_taken == 4'd8;
    // low first: the newest byte is the high one
    wire       right = shifted[47:32] == crc;
    wire       paused = bytes_taken != '0 && !whole && !byte_valid && silent >= gap;
    wire       cut = bytes_taken != '0 && !whole && framing_error;
    wire       first = byte_valid && (bytes_taken == '0 || whole) && byte_data == 8'hA5;
    wire [7:0] skipped = number - sequence_number - 1'b1;

    assign stale = !known || (stale_after != '0 && age > stale_after);

    always_ff @(posedge clk) begin
        valid   <= whole && right;
        silent  <= byte_valid ? '0 : silent + 24'(!(&silent));
        elapsed <= first ? 32'd1 : elapsed + 32'(!(&elapsed));
        age     <= age + 32'(!(&age));
        if (byte_valid) begin
            shifted <= {byte_data, shifted[47:8]};
            if (first) crc <= crc_of(16'hFFFF, 8'hA5);
            else if (bytes_taken < 4'd6) crc <= crc_of(crc, byte_data);
            if (bytes_taken == 4'd1) number <= byte_data;
        end
        if (first) bytes_taken <= 4'd1;
        else if (whole) bytes_taken <= '0;
        else if (cut || paused) bytes_taken <= '0;
        else if (byte_valid && bytes_taken != '0) bytes_taken <= bytes_taken + 1'b1;
        if (whole && right) begin
            angle           <= shifted[31:0];
            sequence_number <= number;
            age             <= elapsed + 32'(!(&elapsed));
            known           <= 1'b1;
            if (known) missed <= more(missed, skipped);
        end
        if (whole && !right) crc_errors <= more(crc_errors, 8'd1);
        if (cut || paused) broken <= more(broken, 8'd1);
        if (rst || clear) begin
            crc_errors <= '0;
            broken     <= '0;
            missed     <= '0;
        end
        if (rst) begin
            valid <= 1'b0;
            known <= 1'b0;
            bytes_taken <= '0;
            age   <= '0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [3:0] bytes;  // since the A5
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        bytes <= rst || first ? 4'd1 : byte_valid ? bytes + 4'(!(&bytes)) : bytes;
        if (past && !$past(rst)) begin
            assert (bytes_taken <= 4'd8);
            if (bytes_taken != '0) assert (bytes == bytes_taken);
            if (valid)
                assert ($past(bytes) == 4'd8 && $past(right) && angle == $past(shifted[31:0]));
                else assert ($stable(angle) && $stable(sequence_number));
            if (!stale) assert (known);
            cover (valid && angle == 32'h1234_5678);
            cover (crc_errors == W'(1));
            cover (broken == W'(1));
        end
    end
`endif
endmodule

`default_nettype wire
