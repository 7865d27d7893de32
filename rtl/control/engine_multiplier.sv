// SPDX-License-Identifier: Apache-2.0
// engine_multiplier -- multiply two signed numbers of 35 bits in four hardware multipliers of 18
// bits.
//
// latency   1 cycle from x and y to product: the four parts are kept, and added as they are read
// rate      one product per cycle
// accuracy  exact
// method    Each factor is split at bit 17: the low part is a positive number, the high part is
//           signed. The product of the high parts and that of the low parts do not overlap.
// model     tb/control/engine_multiplier.py, equal in every bit of every cycle
`default_nettype none

module engine_multiplier (
    input  wire                clk,
    input  wire signed  [34:0] x,       // number
    input  wire signed  [34:0] y,       // number
    output logic signed [69:0] product  // of the x and y of the cycle before
);
    wire signed [17:0] x_low = {1'b0, x[16:0]};
    wire signed [17:0] y_low = {1'b0, y[16:0]};
    wire signed [17:0] x_high = x[34:17];
    wire signed [17:0] y_high = y[34:17];

    logic signed [35:0] low, high, first, second;

    wire signed [36:0] middle = {first[35], first} + {second[35], second};
    wire signed [52:0] upper = {high, low[33:17]} + 53'(middle);

    assign product = {upper, low[16:0]};

    always_ff @(posedge clk) begin
        low    <= x_low * y_low;
        high   <= x_high * y_high;
        first  <= x_low * y_high;
        second <= x_high * y_low;
    end

    wire unused = &{1'b0, low[35:34]};
endmodule

`default_nettype wire
