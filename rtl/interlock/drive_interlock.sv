// SPDX-License-Identifier: Apache-2.0
// drive_interlock -- permit the drive, latch faults, and block commands into a pressed limit
// switch. Firmware can only request the drive.
//
// latency   1 cycle from a cause to faults and to enabled low, and from command_in to command_out;
//           2 cycles from a following error to enabled low.
// behaviour Emergency stop, drive fault and CPU trap always latch. Limit switches (unless homing),
//           encoder fault, bus watchdog, link watchdog, profile underrun, step overrun, servo
//           overrun, sample overrun and following error latch while enable is requested. The
//           following error counts from the second error_valid after enabled and closed_loop are
//           both high, so that no error measured before then counts. reset_faults clears the faults
//           whose cause is gone, and only while enable_request is low; nothing restarts by itself.
//           A command that was made zero stays zero until the next command_in.
// model     tb/interlock/drive_interlock.py, equal in every bit of every cycle
// proved    Whatever the bus writes: enabled is never high with a latched fault, nor one cycle
//           after a cause or without a request. A fault is cleared only by reset_faults with
//           enable_request low and its cause gone. No command into a pressed switch passes, and
//           none without enabled. first_fault is one of the causes and stays while a fault is
//           latched.
`default_nettype none

module drive_interlock (
    input  wire                clk,
    input  wire                rst,
    input  wire                enable_request,    // level: firmware requests the drive
    input  wire                closed_loop,       // level: the following error counts
    input  wire                homing,            // level: a limit switch blocks but is no fault
    input  wire                reset_faults,      // strobe: clear the faults
    input  wire                limit_low,         // level: the lower limit switch is pressed
    input  wire                limit_high,        // level: the upper limit switch is pressed
    input  wire                estop,             // level: the emergency stop is pressed
    input  wire                drive_fault,       // level: the drive reports a fault
    input  wire                encoder_fault,     // level: an encoder event passed the mask
    input  wire                watchdog_expired,  // level: the bus has been silent for too long
    input  wire                cpu_trap,          // level: the soft core has stopped
    input  wire                profile_underrun,  // strobe: the profile ran out of segments
    input  wire                step_overrun,      // level: the step generator lags too far
    input  wire                servo_overrun,     // strobe: a tick came before the last was served
    input  wire                sample_overrun,    // strobe: the shared chain has lost a sample
    input  wire                link_expired,      // level: no good packet over the link in time
    input  wire                error_valid,       // strobe: there is a new following error
    input  wire                error_too_far,     // level: with error_valid, it is above its limit
    input  wire signed  [47:0] position,          // 2^-16 period
    input  wire                valid_in,          // strobe: command_in is new
    input  wire signed  [15:0] command_in,        // full scale 2^15
    output logic               valid_out,         // strobe: command_out is new or was made zero
    output logic signed [15:0] command_out,       // full scale 2^15
    output logic               enabled,           // level: the drive may be on
    output logic        [12:0] faults,            // latched; bits as in axis_registers.faults
    output logic        [12:0] causes_now,        // present causes, same bits as faults
    output logic        [12:0] first_fault,       // the fault that came first, same bits as faults
    output logic signed [47:0] fault_position,    // 2^-16 period, when first_fault latched
    output logic               block_up,          // level: no positive command passes
    output logic               block_down         // level: no negative command passes
);
    // Of several causes in the same cycle, first_fault takes the lowest bit.
    // made by tables/interlock_faults.py, not to be edited
    localparam [12:0] LATCH_ALWAYS = 13'b0000011000100;  // estop, drive, cpu
    // end of the made constants

    // the last error that counted was above the limit
    logic        too_far;
    // the next error was measured with the drive on
    logic        error_counts;

    wire  [12:0] arrived = causes_now & (enable_request ? '1 : LATCH_ALWAYS);
    wire  [12:0] held = reset_faults && !enable_request ? faults & causes_now : faults;
    wire  [12:0] latched = held | arrived;
    wire         allowed = enable_request && latched == '0;

    // command_out is positive, negative; so is the command of this cycle
    logic positive, negative;
    wire         up = valid_in ? !command_in[15] && command_in != '0 : positive;
    wire         down = valid_in ? command_in[15] : negative;
    wire         blocked = !allowed || (limit_high && up) || (limit_low && down);

    logic [12:0] lowest;  // of the causes that have arrived
    logic        lower;
    always_comb begin
        lower = 1'b0;
        for (int n = 0; n < 13; n++) begin
            lowest[n] = arrived[n] && !lower;
            lower     = lower || arrived[n];
        end
    end

    assign causes_now = {
        link_expired,
        sample_overrun,
        servo_overrun,
        step_overrun,
        profile_underrun,
        cpu_trap,
        drive_fault,
        watchdog_expired,
        encoder_fault,
        too_far,
        estop,
        limit_high && !homing,
        limit_low && !homing
    };
    assign block_up   = limit_high || !enabled;
    assign block_down = limit_low || !enabled;

    always_ff @(posedge clk) begin
        if (!enabled || !closed_loop) begin
            too_far      <= 1'b0;
            error_counts <= 1'b0;
        end else if (error_valid) begin
            too_far      <= error_counts && error_too_far;
            error_counts <= 1'b1;
        end

        faults  <= latched;
        enabled <= allowed;
        if (held == '0) begin
            first_fault <= lowest;
            if (arrived != '0) fault_position <= position;
        end

        if (valid_in) command_out <= command_in;
        {positive, negative} <= {up, down};
        if (blocked) {command_out, positive, negative} <= '0;
        valid_out <= valid_in || (blocked && (positive || negative));
        if (rst) begin
            too_far        <= 1'b0;
            error_counts   <= 1'b0;
            faults         <= '0;
            enabled        <= 1'b0;
            first_fault    <= '0;
            fault_position <= '0;
            command_out    <= '0;
            {positive, negative} <= '0;
            valid_out      <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (positive == (command_out > 0) && negative == (command_out < 0));
            assert (!(enabled && faults != '0));
            assert (!enabled || ($past(enable_request) && $past(causes_now) == '0));
            assert (command_out == '0 || enabled);
            assert (!($past(limit_high) && command_out > 0));
            assert (!($past(limit_low) && command_out < 0));
            assert ((first_fault == '0) == (faults == '0));
            assert ((first_fault & (first_fault - 1'b1)) == '0);
            if (!$past(rst)) begin
                if (!($past(reset_faults) && !$past(enable_request)))
                    assert (($past(faults) & ~faults) == '0);
                assert (($past(faults) & $past(causes_now) & ~faults) == '0);
                if ($past(faults) != '0 && faults != '0 && !$past(reset_faults))
                    assert (first_fault == $past(first_fault));
                if (first_fault != $past(first_fault) && faults != '0)
                    assert ((first_fault & $past(causes_now)) != '0);
            end
            cover (enabled && command_out < 0 && limit_high);
            cover (faults[3] && first_fault[3]);
            cover (enabled && first_fault == '0 && $past(faults, 2) != '0);
        end
    end
`endif
endmodule

`default_nettype wire
