// SPDX-License-Identifier: Apache-2.0
// engine_inputs -- sample position and levels of one axis for motion_engine at each tick, and hold
// its requests until they are served.
//
// latency   1 cycle from tick or sample to what is seen, from a request to asked and waiting
// rate      a tick or a sample per cycle, a request of each kind per cycle
// behaviour A tick takes everything, a sample takes position and requests without gains_changed.
//           A request is seen from the tick or the sample after it until `done` says that it was
//           served. A request that comes while one of its kind waits is joined with it, unless that
//           one has been taken already: then it is served again. A step in the cycle of the tick
//           belongs to the next tick.
// model     tb/control/engine_inputs.py, equal in every bit of every cycle
// proved    A request waits until it is done, and none is forgotten: a request that comes after the
//           last tick or sample is still asked for after `done`.
// proof     depth 6
`default_nettype none

module engine_inputs (
    input  wire                clk,
    input  wire                rst,
    input  wire                tick,           // strobe: take everything
    input  wire                sample,         // strobe: take position and requests
    input  wire         [23:0] elapsed,        // cycles since the last tick, before this one
    // the axis
    input  wire signed  [47:0] position,       // 2^-16 period
    input  wire                stepped,        // strobe: position has made a step
    input  wire                downward,       // level: with stepped, the step went down
    input  wire                block_up,       // level: the interlock blocks positive commands
    input  wire                block_down,     // level: the interlock blocks negative commands
    input  wire                closed_loop,    // level: the servo commands the drive
    input  wire         [ 6:0] request,        // strobes: gains, stop, arm, start, push, set, shift
    input  wire         [ 6:0] done,           // strobes: the request was served
    // what is seen
    output logic signed [47:0] seen_position,  // 2^-16 period
    output logic        [23:0] seen_elapsed,   // cycles from the tick before to the last step
    output logic        [ 6:0] seen,           // level: the request is to be served, as request
    output logic        [ 6:0] levels,         // powerless: ever off, ever; closed, blocked; step
    output logic               asked,          // level: a request other than gains waits
    output logic               gains           // level: a gain changed, taken or not
);
    // levels: {lost_off, lost, closed_loop, block_down, block_up, down, stepped}; lost: the loop
    // was open or the drive was off in some cycle since the tick before, lost_off: the drive was
    // off
    logic [6:0] live;
    logic step_live, step_down, lost_live, lost_off_live;
    logic [23:0] step_elapsed;

    wire         off = block_up && block_down;
    wire         powerless = !closed_loop || off;
    wire  [ 6:0] taken = {tick, {6{tick || sample}}};

    assign asked = |{live[5:0], seen[5:0]};
    assign gains = live[6] || seen[6];

    always_ff @(posedge clk) begin
        live          <= (live & ~taken) | request;
        seen          <= (seen & ~done) | (live & taken);
        step_live     <= stepped || (step_live && !tick);
        lost_live     <= !tick && (lost_live || powerless);
        lost_off_live <= !tick && (lost_off_live || off);
        if (stepped) {step_down, step_elapsed} <= {downward, tick ? 24'd0 : elapsed};
        if (tick || sample) seen_position <= position;
        if (tick) begin
            seen_elapsed <= step_elapsed;
            levels <= {
                lost_off_live || off,
                lost_live || powerless,
                closed_loop,
                block_down,
                block_up,
                step_down,
                step_live
            };
        end
        if (rst) begin
            live <= '0;
            seen <= '0;
            {step_live, lost_live, lost_off_live} <= 3'b011;
            levels <= '0;
            seen_position <= '0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [6:0] owed;  // requests that are neither done nor joined with one that waits
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        owed <= rst ? '0 : (owed & ~(done & ~live)) | request;
        if (past) begin
            assert ((owed & ~(live | seen)) == '0);
            assert (asked == |((live | seen) & 7'h3F));
            if (!$past(rst) && !$past(tick || sample))
                assert (seen_position == $past(seen_position));
            cover (owed[2] && seen[2] && live[2]);
        end
    end
`endif
endmodule

`default_nettype wire
