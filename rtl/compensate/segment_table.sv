// SPDX-License-Identifier: Apache-2.0
// segment_table -- take the error that a table of equal segments has for a place off the position.
//
// latency  INDEX + 22 clk from valid to done
// rate     one position in as many clk; one that
//          comes earlier is not taken
// table    the measured length, from origin on, in `segments` parts of segment_length; point n is
//          the error at the border n of them, measured less true, and the same whichever way it is
//          passed. rectangle: inside a segment the mean of its two borders, a half goes up; linear:
//          the straight line between them, to 2^-16 of the segment, rounded
// bounds   before the first border and after the last the error is that of the border, and outside
//          says so
// source   S0: the equal-segment rectangle method, (d_i + d_i+1) / 2
// model    tb/compensate/segment_table.py, equal in every bit of every cycle while the settings
//          stand still
// proved   what is read lies within the borders 0..segments
`default_nettype none

module segment_table #(
    parameter int INDEX = 8  // segments < 2^INDEX
) (
    input wire clk,
    input wire rst,  // drops the position under way
    input wire enable,  // 0: the position passes as it is, with the same latency
    input wire linear,  // 0: rectangle
    input wire signed [47:0] origin,  // 2^-16 period: the first border
    input wire [47:0] segment_length,  // 2^-16 period
    input wire [INDEX-1:0] segments,
    input wire write,  // strobe: value goes to point
    input wire [INDEX-1:0] point,  // border
    input wire signed [23:0] value,  // 2^-16 period: position there less the true one
    input wire [INDEX-1:0] read_point,  // border whose point is to be read back
    input wire valid,  // strobe
    input wire signed [47:0] position,  // 2^-16 period
    output logic done,  // strobe
    output logic signed [47:0] corrected,  // 2^-16 period: position less its error
    output logic outside,  // level, with done: the position is beyond the table
    output logic signed [23:0] error,  // 2^-16 period, with done: position less corrected
    output logic signed [23:0]   read_value             // 2^-16 period: the point of read_point one clk before, while no position is under way
);
    if (INDEX < 2 || INDEX > 12) begin : g_check
        INDEX_MUST_BE_FROM_2_TO_12 u_error ();
    end

    localparam int V = 49 + INDEX;  // a distance, the longest table times two

    typedef enum logic [2:0] {
        IDLE,
        DIVIDE,
        FIRST,
        SECOND,
        RISE,
        LINE,
        FINISH
    } state_t;

    logic signed [23:0] errors                          [0:(1<<INDEX)-1];
    logic signed [23:0] first;
    state_t             state;
    logic        [ 3:0] count;
    logic signed [47:0] here;  // the position under way
    // distance still to divide; the segment, times a power of two
    logic [V-1:0] rest, part;
    logic [INDEX-1:0] index;
    logic below, beyond;  // the first border, the longest table
    // 2^-32 period: rise of half a segment, a quarter …; error above first
    logic signed [40:0] slice, line;

    wire after = beyond || index >= segments;
    wire away = below || after;
    wire [INDEX-1:0] border = below ? '0 : after ? segments : index;
    wire [INDEX-1:0]       read_at  = state == IDLE ? read_point : border + INDEX'(state != FIRST && !away);
    wire [V-1:0] dividend = state == LINE ? rest << 1 : rest;
    wire fits = dividend >= part;
    wire signed [24:0] rise = 25'(read_value) - 25'(first);
    wire signed [23:0] mean = 24'((25'(read_value) + 25'(first) + 25'sd1) >>> 1);
    wire signed [41:0] straight = 42'($signed({first, 16'd0})) + 42'(line) + 42'sd32768;
    wire signed [23:0] answer = !enable ? '0 : linear ? 24'(straight >>> 16) : mean;

    always_ff @(posedge clk) begin
        if (write) errors[point] <= value;
        if (state != DIVIDE && state != LINE) read_value <= errors[read_at];
    end

    always_ff @(posedge clk) begin
        done  <= 1'b0;
        count <= state == DIVIDE || state == LINE ? count + 1'b1 : '0;
        case (state)
            IDLE:
            if (valid) begin
                here   <= position;
                below  <= position < origin;
                rest   <= V'(48'(position - origin));
                part   <= V'(segment_length) << INDEX;
                state  <= DIVIDE;
            end
            DIVIDE: begin
                if (count == '0) beyond <= fits;
                else begin
                    index <= {index[INDEX-2:0], fits};
                    if (fits) rest <= rest - part;
                end
                if (count == 4'(INDEX)) begin
                    count <= '0;
                    state <= FIRST;
                end else part <= part >> 1;
            end
            FIRST:  state <= SECOND;
            SECOND: begin
                first <= read_value;
                state <= RISE;
            end
            RISE: begin
                slice <= 41'($signed({rise, 15'd0}));
                line  <= '0;
                state <= LINE;
            end
            LINE: begin
                rest  <= fits ? dividend - part : dividend;
                slice <= slice >>> 1;
                if (fits) line <= line + slice;
                if (count == '1) state <= FINISH;
            end
            default: begin
                corrected <= here - 48'(answer);
                error     <= answer;
                outside   <= away;
                done      <= 1'b1;
                state     <= IDLE;
            end
        endcase
        if (rst) begin
            state <= IDLE;
            done  <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assume (segments == $past(segments) && segments != 0);
            if (state != IDLE && state != DIVIDE) assert (read_at <= segments);
            cover (state == SECOND && read_at == 1);
        end
    end
`endif
endmodule

`default_nettype wire
