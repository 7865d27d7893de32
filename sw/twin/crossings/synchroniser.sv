// SPDX-License-Identifier: Apache-2.0
// synchroniser -- rtl/common/synchroniser.sv as a chip has it: a change that comes with the clock
// edge is taken by this edge or by the next one. For simulations with CROSSINGS=seed only.
//
// Each change of each bit is kept back for one cycle or not, by chance. A change that does not last
// until the next edge is lost if it is kept back. The random numbers come from the name of the
// instance and from the seed, and are the same ones after each reset, so a run can be repeated; one
// is used in each cycle in which a bit changes. tb/common/synchroniser.py is the model, equal in
// every bit of every cycle.
`default_nettype none

module synchroniser #(
    parameter int W      = 1,  // number of independent levels, 32 at most
    parameter int STAGES = 2,  // flip-flops in each chain, at least 2
    parameter int RESET  = 0   // value of q during reset and until the first level arrives
) (
    input  wire          clk,
    input  wire          rst,  // level: q becomes RESET
    input  wire  [W-1:0] d,    // levels, asynchronous
    output logic [W-1:0] q     // levels, synchronous to clk
);
    if (STAGES < 2 || W > 32) begin : g_check
        STAGES_MUST_BE_AT_LEAST_2_AND_W_AT_MOST_32 u_error ();
    end

    logic [W*STAGES-1:0] stages;
    logic [       W-1:0] late;  // bits whose change was kept back in the last cycle
    logic [        31:0] first;  // random number after reset
    logic [        31:0] drawn;  // the random number of the next change

    wire  [       W-1:0] fresh = (d ^ stages[W-1:0]) & ~late;  // changes that may be kept back
    wire  [       W-1:0] kept = fresh & drawn[W-1:0];

    function automatic [31:0] following(input [31:0] number);  // xorshift32 of Marsaglia
        following = number ^ (number << 13);
        following = following ^ (following >> 17);
        following = following ^ (following << 5);
    endfunction

    string  name;
    integer seed;
    initial begin
        $sformat(name, "%m");
        if ($value$plusargs("crossings=%d", seed) == 0) seed = 1;
        first = 32'h811C_9DC5 ^ seed;
        for (int n = 0; n < name.len(); n++)
        first = (first ^ {24'd0, name[n]}) * 32'h0100_0193;  // FNV-1a
        if (first == 0) first = 1;
        drawn = first;
    end

    assign q = stages[W*STAGES-1-:W];

    always_ff @(posedge clk) begin
        stages <= {stages[W*(STAGES-1)-1:0], d ^ kept};
        late   <= kept;
        if (fresh != 0) drawn <= following(drawn);
        if (rst) begin
            stages <= {STAGES{W'(RESET)}};
            late   <= '0;
            drawn  <= first;
        end
    end
endmodule

`default_nettype wire
