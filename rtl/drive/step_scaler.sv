// SPDX-License-Identifier: Apache-2.0
// step_scaler -- convert a position in signal periods to motor steps: multiply by a ratio and round
// down, with one shift-and-add multiplier.
//
// latency   49 cycles from valid to done
// rate      one position per 49 cycles; one that comes sooner is ignored.
// accuracy  exact: steps = floor(position * ratio / 2^32) modulo 2^48
// model     tb/drive/step_scaler.py, equal in every bit of every cycle
// proved    done comes 49 cycles after a position was taken, and at no other time. steps changes
//           with done only.
// proof     depth 54
`default_nettype none

module step_scaler (
    input  wire                clk,
    input  wire                rst,
    input  wire signed  [47:0] ratio,     // 2^-32 step per period; taken with a position
    input  wire                valid,     // strobe: position is new
    input  wire signed  [47:0] position,  // 2^-16 period
    output logic               done,      // strobe: steps is new
    output logic signed [47:0] steps      // 2^-16 step
);
    logic       busy;
    logic [5:0] bits;  // bits of position that are done
    // high and low are the product; low still holds the bits of position that are to come
    logic signed [47:0] factor, high;
    logic [47:0] low;

    // the top bit of position has a negative weight
    wire signed [48:0] part = !low[0] ? 49'sd0 : bits == 6'd47 ? 49'sd0 - 49'(factor) : 49'(factor);
    wire signed [48:0] sum = 49'(high) + part;

    always_ff @(posedge clk) begin
        done <= busy && bits == 6'd47;
        if (!busy) begin
            busy   <= valid;
            bits   <= '0;
            factor <= ratio;
            high   <= '0;
            low    <= position;
        end else begin
            busy <= bits != 6'd47;
            bits <= bits + 1'b1;
            high <= sum[48:1];
            low  <= {sum[0], low[47:1]};
            if (bits == 6'd47) steps <= {sum[32:0], low[47:33]};
        end
        if (rst) begin
            busy  <= 1'b0;
            done  <= 1'b0;
            steps <= '0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    // cycles since a position was taken: 49 with done, then 0
    logic [5:0] since = '0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        since <= rst ? '0 : !busy ? 6'(valid) : since + 1'b1;
        if (past) begin
            assert (busy ? since == bits + 1'b1 && bits < 6'd48 : since == (done ? 6'd49 : 6'd0));
            if (!$past(rst) && !done) assert (steps == $past(steps));
            cover (done && steps != 0);
        end
    end
`endif
endmodule

`default_nettype wire
