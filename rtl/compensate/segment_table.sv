// SPDX-License-Identifier: Apache-2.0
// segment_table -- subtract from a position the error that a table of equal segments gives for it.
//
// latency   INDEX + 22 cycles from valid to done
// rate      one position per INDEX + 22 cycles; one that comes sooner is ignored.
// method    The measured length, from origin on, is divided into `segments` parts of
//           segment_length. Point n is the error at border n of them, measured less true position,
//           and is the same for both directions of motion. In rectangle mode the error inside a
//           segment is the mean of its two borders, with a half rounded up. In linear mode it is on
//           the straight line between them, to 2^-16 of the segment, rounded.
// behaviour Before the first border and after the last one the error is that of the border, and
//           outside is high. rst drops the running position.
// limits    The settings must not change while a position is being processed.
// source    S0: the equal-segment rectangle method, (d_i + d_i+1) / 2
// model     tb/compensate/segment_table.py, equal in every bit of every cycle while the settings
//           are constant
// proved    Only the borders 0..segments are read.
`default_nettype none

module segment_table #(
    parameter int INDEX = 8  // bits of a segment number: segments < 2^INDEX
) (
    input  wire                     clk,
    input  wire                     rst,
    input  wire                     enable,          // level: correct; 0: the position passes
    input  wire                     linear,          // level: straight lines; 0: rectangles
    input  wire signed  [     47:0] origin,          // 2^-16 period: the first border
    input  wire         [     47:0] segment_length,  // 2^-16 period
    input  wire         [INDEX-1:0] segments,        // number of segments
    input  wire                     write,           // strobe: write value to point
    input  wire         [INDEX-1:0] point,           // number of a border
    input  wire signed  [     23:0] value,           // 2^-16 period: measured less true position
    input  wire         [INDEX-1:0] read_point,      // number of the border to be read back
    input  wire                     valid,           // strobe: position is new
    input  wire signed  [     47:0] position,        // 2^-16 period
    output logic                    done,            // strobe: the outputs are new
    output logic signed [     47:0] corrected,       // 2^-16 period: position less its error
    output logic                    outside,         // level: the position is off the table
    output logic signed [     23:0] error,           // 2^-16 period: position less corrected
    output logic signed [     23:0] read_value       // 2^-16 period: point of read_point
);
    // read_value belongs to read_point of one cycle before, and only while no position is being
    // processed.
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

    logic signed [23:0] errors                        [0:(1<<INDEX)-1];
    logic signed [23:0] first;
    state_t             state;
    logic        [ 3:0] count;
    logic signed [47:0] here;  // the running position
    // distance that is still to be divided; segment_length times a power of two
    logic [V-1:0] remainder, part;
    logic [INDEX-1:0] index;
    // the position is below the first border; beyond the longest table
    logic below, beyond;
    // 2^-32 period: rise over half a segment, a quarter …; error above first
    logic signed [40:0] slice, line;

    wire                    after = beyond || index >= segments;
    wire                    away = below || after;
    wire        [INDEX-1:0] border = below ? '0 : after ? segments : index;
    wire                    next_border = state != FIRST && !away;
    wire        [INDEX-1:0] read_at = state == IDLE ? read_point : border + INDEX'(next_border);
    wire        [    V-1:0] dividend = state == LINE ? remainder << 1 : remainder;
    wire                    fits = dividend >= part;
    wire signed [     24:0] rise = 25'(read_value) - 25'(first);
    wire signed [     23:0] mean = 24'((25'(read_value) + 25'(first) + 25'sd1) >>> 1);
    wire signed [     41:0] straight = 42'($signed({first, 16'd0})) + 42'(line) + 42'sd32768;
    wire signed [     23:0] answer = !enable ? '0 : linear ? 24'(straight >>> 16) : mean;

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
                here      <= position;
                below     <= position < origin;
                remainder <= V'(48'(position - origin));
                part      <= V'(segment_length) << INDEX;
                state     <= DIVIDE;
            end
            DIVIDE: begin
                if (count == '0) beyond <= fits;
                else begin
                    index <= {index[INDEX-2:0], fits};
                    if (fits) remainder <= remainder - part;
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
                remainder <= fits ? dividend - part : dividend;
                slice     <= slice >>> 1;
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
