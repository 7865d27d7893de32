// SPDX-License-Identifier: Apache-2.0
// Made by tables/bus.py from tables/bus.toml: do not edit.
#ifndef MOIRE_BUS_PROTOCOL_H
#define MOIRE_BUS_PROTOCOL_H

#define PROTOCOL_CRC         0xDD208892u    // CRC-32 of bus.toml
#define BUS_VERSION         1u
#define BUS_LONGEST_BODY    64u
#define BUS_REQUEST_HEAD    2u  // sequence, operation
#define BUS_REPLY_HEAD      3u  // sequence, operation, cause

#define BUS_STREAM_SHORTEST 2u    // fewest ticks from one set-point of a stream to the next
#define BUS_STREAM_LONGEST 256u    // most ticks from one set-point of a stream to the next
#define BUS_STREAM_LATEST 400u    // largest late_limit, in ticks
#define BUS_WAVEFORM_LONGEST 4096u    // most values of the waveform of an excitation
// bits b: a stream may exceed its limits by 2^-b of them, for rounding
#define BUS_STREAM_TOLERANCE 10u

enum bus_cause {
    BUS_CAUSE_OK = 0,    // done
    BUS_CAUSE_UNKNOWN_OPERATION = 1,    // the node does not know this command
    BUS_CAUSE_WRONG_LENGTH = 2,    // the command has the wrong length
    BUS_CAUSE_NO_SUCH_AXIS = 3,    // the node has no axis of this number
    BUS_CAUSE_UNKNOWN_PARAMETER = 4,    // the node has no parameter of this number
    BUS_CAUSE_OUT_OF_RANGE = 5,    // the value is outside the range of this parameter
    BUS_CAUSE_OUT_OF_TRAVEL = 6,    // the target is outside the travel
    BUS_CAUSE_NOT_HOMED = 7,    // the axis has no zero yet: home it first
    BUS_CAUSE_NOT_ENABLED = 8,    // the drive is off: enable it first
    BUS_CAUSE_FAULTED = 9,    // a fault is latched: remove its cause and reset it first
    BUS_CAUSE_FAULT_PERSISTS = 10,    // the cause of the fault is still present
    BUS_CAUSE_BUSY = 11,    // the axis is moving: stop it or wait
    BUS_CAUSE_WRONG_MAP = 12,    // firmware and FPGA do not match (register maps differ)
    BUS_CAUSE_NO_SUCH_REGISTER = 13,    // the node has no register at this address
    BUS_CAUSE_STOPPED = 14,    // stopped by the host
    BUS_CAUSE_NO_SWITCH = 15,    // no limit switch was found within the travel
    BUS_CAUSE_SWITCH_STUCK = 16,    // the limit switch did not open within the home distance
    BUS_CAUSE_NOT_SETTLED = 17,    // the target was not reached within the settling time
    BUS_CAUSE_ENDED_BY_FAULT = 18,    // a fault ended the motion
    BUS_CAUSE_RUNNING = 19,    // the motion is in progress
    BUS_CAUSE_NO_MOTION_YET = 20,    // no motion was requested yet
    BUS_CAUSE_NO_INDEX = 21,    // no index was found within the home distance
    BUS_CAUSE_NOT_PREPARED = 22,    // the axis has no motion prepared
    BUS_CAUSE_NOT_BUILT = 23,    // this axis or node was built without this function
    BUS_CAUSE_TOO_LONG = 24,    // the motion would take days, or is too long for a change of target
    // the steps of the stepped profile are not in order, or too many
    BUS_CAUSE_STEPPED_PROFILE_INVALID = 25,
    BUS_CAUSE_NO_SEGMENTS = 26,    // no complete segment table is loaded
    BUS_CAUSE_SEGMENTS_IN_USE = 27,    // the segment table is in use: switch it off first
    // another client moves this axis: wait until it has stopped, or stop it
    BUS_CAUSE_OTHER_CLIENT = 28,
    // no good frame came from the angle sensor: check its power and its cable
    BUS_CAUSE_SENSOR_TIMED_OUT = 30,
    // the angle sensor is stuck: it sent the same angle while the table was turned
    BUS_CAUSE_SENSOR_STUCK = 31,
    // the table did not follow its steps: it sticks, or the motor lost steps
    BUS_CAUSE_STICTION = 32,
    // the table turned against its steps: reverse the sign of steps_per_period
    BUS_CAUSE_WRONG_SIGN = 33,
    BUS_CAUSE_NOT_CONVERGED = 34,    // the tolerance was not reached within the allowed tries
    // angle sensor and steps disagree: they show different movements of the table
    BUS_CAUSE_SENSOR_DISAGREES = 35,
    // the other node does not answer: check the cable between the nodes and its peer_mode
    BUS_CAUSE_PEER_SILENT = 36,
    // the other node has no such station: write the station list to both
    BUS_CAUSE_NO_STATION = 37,
    // the peer port is not in use: see the settings peer_mode and peer_role
    BUS_CAUSE_PEER_OFF = 38,
    BUS_CAUSE_PEER_RESTARTED = 39,    // the other node lost its power while it turned its table
    BUS_CAUSE_EEPROM_MISSING = 40,    // the EEPROM does not answer
    BUS_CAUSE_EEPROM_FAILED = 41,    // the EEPROM did not store the data
    BUS_CAUSE_EEPROM_BUSY = 42,    // the EEPROM is being read or written
    BUS_CAUSE_NO_JOB = 43,    // no station list is stored
    BUS_CAUSE_JOB_DAMAGED = 44,    // the stored station list is damaged
    BUS_CAUSE_JOB_INCOMPLETE = 45,    // write all stations of a list in order
    BUS_CAUSE_NO_STATIONS = 46,    // a station list needs at least one station
    BUS_CAUSE_TOO_MANY_STATIONS = 47,    // the EEPROM is full: it holds 360 stations
    BUS_CAUSE_ANGLE_OUT_OF_TURN = 48,    // angles must be below 360 degrees
    BUS_CAUSE_ANGLES_NOT_ASCENDING = 49,    // each angle must be larger than the last
    BUS_CAUSE_JOB_ACTIVE = 50,    // a job is in progress: stop it first
    BUS_CAUSE_NOT_NOW = 51,    // the job does not expect this now
    BUS_CAUSE_EDM_BUSY = 52,    // the EDM cuts, or its keys are pending
    BUS_CAUSE_EDM_ALARM = 53,    // the EDM reports an alarm
    BUS_CAUSE_KEYS_NOT_TAKEN = 54,    // the EDM does not accept our keys
    BUS_CAUSE_CUT_NOT_STARTED = 55,    // the cut did not start in time
    BUS_CAUSE_CUT_NOT_ENDED = 56,    // the cut did not end in time
    BUS_CAUSE_POWER_LOST = 57,    // the power was lost during the job
    BUS_CAUSE_PAUSED_BY_OPERATOR = 58,    // paused by the operator
    BUS_CAUSE_KEY_WITHOUT_FUNCTION = 59,    // this key has no function
    BUS_CAUSE_TABLE_POSITION_UNKNOWN = 60,    // the position of the table is not known
    BUS_CAUSE_JOB_CHANGED = 61,    // this is not the list of the job
    // no stream is open on this axis: begin one, or it has ended: see how
    BUS_CAUSE_NO_STREAM = 62,
    // the queue of set-points is full: send this one again a little later
    BUS_CAUSE_QUEUE_FULL = 63,
    // the set-point is late: it came too late, or none came at all
    BUS_CAUSE_SET_POINT_LATE = 64,
    // the set-point is out of limits: too fast, or the last one is not at rest
    BUS_CAUSE_SET_POINT_LIMITS = 65,
    // check the sub-node: it did not report the end of its turn; its faults are shown and reset
    // there
    BUS_CAUSE_CHECK_SUB_NODE = 66,
    BUS_CAUSE_NOTHING_SAVED = 67,    // no values are saved: the defaults are in use
    BUS_CAUSE_SAVED_DAMAGED = 68,    // the saved values are damaged: the defaults are in use
    // the saved values are from another build: the defaults are in use
    BUS_CAUSE_SAVED_OTHER_BUILD = 69,
    BUS_CAUSE_SAVED_REFUSED = 70,    // some saved values are not allowed: the others are in use
    // the saved values were not read: the EEPROM did not answer at power-up, the defaults are in
    // use
    BUS_CAUSE_SAVED_NOT_READ = 71,
    BUS_CAUSE_FIRMWARE_TOO_LONG = 72,    // the firmware is too long: the node has no room for it
    // this is firmware of another node: another register map, more memory, or too few axes
    BUS_CAUSE_FIRMWARE_OF_OTHER_NODE = 73,
    // the firmware is damaged: its CRC-32 is wrong in the flash; send it again
    BUS_CAUSE_FIRMWARE_DAMAGED = 74,
    // firmware is on trial: confirm it first, or switch the node off and on
    BUS_CAUSE_FIRMWARE_ON_TRIAL = 75,
    BUS_CAUSE_DRIVE_ON = 76,    // a drive is on: switch all drives of the node off first
    // the flash failed: it does not answer, or did not store the data
    BUS_CAUSE_FLASH_FAILED = 77,
};

enum bus_fault {    // bits
    BUS_FAULT_LIMIT_LOW = 1 << 0,    // limit switch at the low end
    BUS_FAULT_LIMIT_HIGH = 1 << 1,    // limit switch at the high end
    BUS_FAULT_ESTOP = 1 << 2,    // emergency stop
    BUS_FAULT_FOLLOWING_ERROR = 1 << 3,    // following error too large
    BUS_FAULT_ENCODER = 1 << 4,    // encoder fault
    BUS_FAULT_BUS_WATCHDOG = 1 << 5,    // the bus is silent
    BUS_FAULT_DRIVE = 1 << 6,    // the drive reports a fault
    BUS_FAULT_CPU = 1 << 7,    // the soft core stopped or hangs
    BUS_FAULT_PROFILE_UNDERRUN = 1 << 8,    // the profile ran out of segments
    // too many steps are pending: too fast for the step timing, or blocked
    BUS_FAULT_STEP_OVERRUN = 1 << 9,
    // a servo tick came before the motion engine had served the last one
    BUS_FAULT_SERVO_OVERRUN = 1 << 10,
    // a sample came before the shared interpolation chain had served the last one
    BUS_FAULT_SAMPLE_OVERRUN = 1 << 11,
    BUS_FAULT_LINK_WATCHDOG = 1 << 12,    // no good packet came over the real-time link in time
};

enum bus_encoder_event {    // bits
    BUS_ENCODER_EVENT_ILLEGAL_EDGE = 1 << 0,    // both quadrature levels changed at once
    // the phase jumped: too fast, the signal is damaged, or a sample was lost
    BUS_ENCODER_EVENT_OVERSPEED = 1 << 1,
    BUS_ENCODER_EVENT_AMPLITUDE_LOW = 1 << 2,    // signal too small
    BUS_ENCODER_EVENT_AMPLITUDE_HIGH = 1 << 3,    // signal too large
    BUS_ENCODER_EVENT_DISAGREEMENT = 1 << 4,    // interpolated position and quadrature count differ
    // a pulse, or the gap between two pulses, was shorter than deglitch and was not counted
    BUS_ENCODER_EVENT_PULSE_TOO_SHORT = 1 << 5,
};

enum bus_state {
    BUS_STATE_OFF = 0,    // drive off
    BUS_STATE_HOLDING = 1,    // holding position
    BUS_STATE_HOMING = 2,    // homing
    BUS_STATE_MOVING = 3,    // moving
    BUS_STATE_SETTLING = 4,    // settling
    BUS_STATE_STOPPING = 5,    // stopping
    BUS_STATE_FAULTED = 6,    // faulted
    BUS_STATE_PREPARED = 7,    // waiting for the common start
    BUS_STATE_EXCITED = 8,    // driven in open loop for a recording
};

enum bus_flag {    // bits
    BUS_FLAG_ENABLED = 1 << 0,    // drive on
    BUS_FLAG_HOMED = 1 << 1,    // zero known
    BUS_FLAG_LIMIT_LOW = 1 << 2,    // switch at the low end pressed
    BUS_FLAG_LIMIT_HIGH = 1 << 3,    // switch at the high end pressed
    BUS_FLAG_ESTOP = 1 << 4,    // emergency stop pressed
    BUS_FLAG_SETTLED = 1 << 5,    // inside the settling window
    BUS_FLAG_SATURATED = 1 << 6,    // command at its limit
};

enum bus_calibration_reason {
    BUS_CALIBRATION_REASON_CALIBRATING = 0,    // calibrating
    BUS_CALIBRATION_REASON_FROZEN = 1,    // frozen
    BUS_CALIBRATION_REASON_STANDSTILL = 2,    // the scale does not move
    BUS_CALIBRATION_REASON_PARTIAL_CIRCLE = 3,    // too little motion: no complete periods
    BUS_CALIBRATION_REASON_AMPLITUDE = 4,    // the amplitude is outside its window
    // offset, gain or quadrature error is larger than the correction allows
    BUS_CALIBRATION_REASON_DISTORTED = 5,
    BUS_CALIBRATION_REASON_TOO_FAST = 6,    // fewer than eight samples per period
    BUS_CALIBRATION_REASON_UNSTEADY = 7,    // the speed changes too much
    // all data are from one speed: a vibration that is synchronous to the signal would not be seen
    BUS_CALIBRATION_REASON_ONE_SPEED = 8,
    // a vibration is synchronous to the signal: the bursts disagree
    BUS_CALIBRATION_REASON_VIBRATION = 9,
};

enum bus_signal_fault {    // bits
    BUS_SIGNAL_FAULT_TOO_LOW = 1 << 0,    // signal too small
    BUS_SIGNAL_FAULT_TOO_HIGH = 1 << 1,    // signal too large
    BUS_SIGNAL_FAULT_CLIPPED = 1 << 2,    // the ADC is at the end of its range
    BUS_SIGNAL_FAULT_OFF_CIRCLE = 1 << 3,    // sine and cosine left their circle
    BUS_SIGNAL_FAULT_JUMP = 1 << 4,    // a sudden jump that no motion causes
    BUS_SIGNAL_FAULT_CHANNEL_STUCK = 1 << 5,    // one channel does not change while the other does
    // the same code for too long: the noise of a working ADC is missing
    BUS_SIGNAL_FAULT_NO_NOISE = 1 << 6,
    BUS_SIGNAL_FAULT_COMPARATOR_MISMATCH = 1 << 7,    // comparators and samples have opposite signs
    // a channel changes its sign, its comparator does not
    BUS_SIGNAL_FAULT_COMPARATOR_STUCK = 1 << 8,
    // the comparators change, a channel never changes its sign
    BUS_SIGNAL_FAULT_CHANNEL_MISSING = 1 << 9,
    BUS_SIGNAL_FAULT_OFFSET_DRIFT = 1 << 10,    // offset too large
    BUS_SIGNAL_FAULT_UNBALANCED = 1 << 11,    // amplitudes of sine and cosine differ too much
    BUS_SIGNAL_FAULT_NOT_IN_QUADRATURE = 1 << 12,    // sine and cosine are not at right angles
    BUS_SIGNAL_FAULT_PHASE_JUMP = 1 << 13,    // the phase jumped
    BUS_SIGNAL_FAULT_LOST_COUNT = 1 << 14,    // interpolated position and quadrature count differ
};

enum bus_calibration_action {
    BUS_CALIBRATION_ACTION_READ = 0,    // change nothing, only report
    BUS_CALIBRATION_ACTION_CALIBRATE = 1,    // calibrate during every motion from now on
    BUS_CALIBRATION_ACTION_FREEZE = 2,    // stop the calibration; the correction stays in force
    // remove the correction: nothing is corrected any more, and a calibration starts again
    BUS_CALIBRATION_ACTION_CLEAR = 3,
    // follow the drift of offsets, gain and quadrature error from now on
    BUS_CALIBRATION_ACTION_FOLLOW = 4,
};

enum bus_scope_trigger {
    BUS_SCOPE_TRIGGER_NOW = 0,    // at once
    BUS_SCOPE_TRIGGER_MOTION = 1,    // the axis moves or homes
    BUS_SCOPE_TRIGGER_SETTLING = 2,    // a motion has ended and settling begins
    BUS_SCOPE_TRIGGER_ERROR = 3,    // the following error reaches the level
    BUS_SCOPE_TRIGGER_FAULT = 4,    // a fault latches
};

enum bus_scope_state {
    BUS_SCOPE_STATE_EMPTY = 0,    // nothing was recorded
    BUS_SCOPE_STATE_WAITING = 1,    // waiting for the trigger
    BUS_SCOPE_STATE_RECORDING = 2,    // recording
    BUS_SCOPE_STATE_FULL = 3,    // complete
};

enum bus_tick_signal {
    BUS_TICK_SIGNAL_SINE_COSINE = 0,    // samples of sine, lower half, and cosine, upper half
    BUS_TICK_SIGNAL_TARGET = 1,    // target, low word, 2^-16 period
    BUS_TICK_SIGNAL_TARGET_VELOCITY = 2,    // velocity of the target, 2^-16 period per tick
    BUS_TICK_SIGNAL_VELOCITY = 3,    // measured velocity, 2^-16 period per tick
    BUS_TICK_SIGNAL_ERROR = 4,    // target - position, 2^-16 period
    BUS_TICK_SIGNAL_COMMAND = 5,    // command to the drive, full scale 2^15
    BUS_TICK_SIGNAL_INTEGRAL = 6,    // integral of the position loop, full scale 2^31
    BUS_TICK_SIGNAL_POSITION = 7,    // position, low word, 2^-16 period
    BUS_TICK_SIGNAL_PHASE = 8,    // interpolated phase, 2^-16 period
    BUS_TICK_SIGNAL_FINE_COMMAND = 9,    // command to the fine stage, full scale 2^15
    BUS_TICK_SIGNAL_FAULTS = 10,    // latched faults, bits of a fault
};

enum bus_tick_trigger {
    BUS_TICK_TRIGGER_NOW = 0,    // at once
    BUS_TICK_TRIGGER_RISES = 1,    // it rises to the level
    BUS_TICK_TRIGGER_FALLS = 2,    // it falls below the level
    BUS_TICK_TRIGGER_BEYOND = 3,    // its size reaches the level
    BUS_TICK_TRIGGER_BITS = 4,    // it has a bit of the level
};

enum bus_turn_phase {
    BUS_TURN_PHASE_IDLE = 0,    // at rest
    BUS_TURN_PHASE_READING = 1,    // waiting for the table to settle, and reading its angle
    BUS_TURN_PHASE_GOING_BELOW = 2,    // moving down to below the target
    BUS_TURN_PHASE_COMING_UP = 3,    // approaching the target from below
    BUS_TURN_PHASE_CLOSING_IN = 4,    // closing in on the target
};

enum bus_peer_phase {
    BUS_PEER_PHASE_IDLE = 0,    // nothing was requested
    BUS_PEER_PHASE_TURNING = 1,    // the sub-node is turning
    BUS_PEER_PHASE_TURNED = 2,    // the sub-node has turned
    BUS_PEER_PHASE_FAILED = 3,    // the sub-node failed
    BUS_PEER_PHASE_SILENT = 4,    // the sub-node does not answer
};

enum bus_job_state {
    BUS_JOB_STATE_LOADING = 0,    // loading
    BUS_JOB_STATE_IDLE = 1,    // ready
    BUS_JOB_STATE_FINISHED = 2,    // all cut
    BUS_JOB_STATE_STARTING = 3,    // starting
    BUS_JOB_STATE_TURNING = 4,    // table turns
    BUS_JOB_STATE_ARRIVED = 5,    // at station
    BUS_JOB_STATE_BEGINNING = 6,    // cut begins
    BUS_JOB_STATE_CUTTING = 7,    // cutting
    BUS_JOB_STATE_FOLLOWING = 8,    // cutting
    BUS_JOB_STATE_ENDED = 9,    // cut done
    BUS_JOB_STATE_LEAVING = 10,    // leaving
    BUS_JOB_STATE_FINISHING = 11,    // finishing
    BUS_JOB_STATE_PAUSED = 12,    // paused
    BUS_JOB_STATE_UNSURE = 13,    // is it cut?
    BUS_JOB_STATE_STOPPING = 14,    // stopping
};

enum bus_job_action {
    BUS_JOB_ACTION_START = 0,    // cut all stations from the first one on
    BUS_JOB_ACTION_PAUSE = 1,    // stop before the next cut or the next station
    // continue; if it is not known whether a station was cut, wait for the end of the cut in
    // progress
    BUS_JOB_ACTION_RESUME = 2,
    BUS_JOB_ACTION_STOP = 3,    // end the job; the EDM finishes a cut in progress
    BUS_JOB_ACTION_AGAIN = 4,    // cut the station again
    BUS_JOB_ACTION_NEXT = 5,    // the station is cut: continue with the next one
};

enum bus_save_action {
    // save all values that differ from their defaults, for the next power-up
    BUS_SAVE_ACTION_SAVE = 0,
    BUS_SAVE_ACTION_CLEAR = 1,    // use the defaults from the next power-up on
};

enum bus_update_action {
    // compare the new firmware in the flash with its CRC-32, and enter it in the flash
    BUS_UPDATE_ACTION_CHECK = 0,
    BUS_UPDATE_ACTION_RUN = 1,    // start the new firmware on trial, 0.1 s after the reply
    // keep the firmware that is on trial: it runs from the next power-up on
    BUS_UPDATE_ACTION_CONFIRM = 2,
};

enum bus_update_state {
    BUS_UPDATE_STATE_IDLE = 0,    // no update is in progress
    BUS_UPDATE_STATE_ERASING = 1,    // the flash is being erased
    BUS_UPDATE_STATE_WRITING = 2,    // the new firmware is expected
    BUS_UPDATE_STATE_CHECKING = 3,    // the new firmware is being checked
    BUS_UPDATE_STATE_CHECKED = 4,    // the new firmware is complete: it can be started
    BUS_UPDATE_STATE_STARTING = 5,    // the new firmware will be started
};

enum bus_job_flag {    // bits
    BUS_JOB_FLAG_EEPROM = 1 << 0,    // the EEPROM answers
    BUS_JOB_FLAG_KEYPAD = 1 << 1,    // the keypad answers
    BUS_JOB_FLAG_DISPLAY = 1 << 2,    // the character display answers
    BUS_JOB_FLAG_CUTTING = 1 << 3,    // the EDM is cutting
    BUS_JOB_FLAG_ALARM = 1 << 4,    // the EDM reports an alarm
    // keys for the EDM are pending: a person is typing, or it does not accept them
    BUS_JOB_FLAG_KEYS_PENDING = 1 << 5,
    BUS_JOB_FLAG_PAUSING = 1 << 6,    // the job pauses next
    // one copy of the station list is damaged, the other one is in use
    BUS_JOB_FLAG_COPY_DAMAGED = 1 << 7,
};

// X(code, words), up to a colon
#define BUS_CAUSE_WORDS(X) \
    X(0, "done") \
    X(1, "the node does not know this command") \
    X(2, "the command has the wrong length") \
    X(3, "the node has no axis of this number") \
    X(4, "the node has no parameter of this number") \
    X(5, "the value is outside the range of this parameter") \
    X(6, "the target is outside the travel") \
    X(7, "the axis has no zero yet") \
    X(8, "the drive is off") \
    X(9, "a fault is latched") \
    X(10, "the cause of the fault is still present") \
    X(11, "the axis is moving") \
    X(12, "firmware and FPGA do not match (register maps differ)") \
    X(13, "the node has no register at this address") \
    X(14, "stopped by the host") \
    X(15, "no limit switch was found within the travel") \
    X(16, "the limit switch did not open within the home distance") \
    X(17, "the target was not reached within the settling time") \
    X(18, "a fault ended the motion") \
    X(19, "the motion is in progress") \
    X(20, "no motion was requested yet") \
    X(21, "no index was found within the home distance") \
    X(22, "the axis has no motion prepared") \
    X(23, "this axis or node was built without this function") \
    X(24, "the motion would take days, or is too long for a change of target") \
    X(25, "the steps of the stepped profile are not in order, or too many") \
    X(26, "no complete segment table is loaded") \
    X(27, "the segment table is in use") \
    X(28, "another client moves this axis") \
    X(30, "no good frame came from the angle sensor") \
    X(31, "the angle sensor is stuck") \
    X(32, "the table did not follow its steps") \
    X(33, "the table turned against its steps") \
    X(34, "the tolerance was not reached within the allowed tries") \
    X(35, "angle sensor and steps disagree") \
    X(36, "the other node does not answer") \
    X(37, "the other node has no such station") \
    X(38, "the peer port is not in use") \
    X(39, "the other node lost its power while it turned its table") \
    X(40, "the EEPROM does not answer") \
    X(41, "the EEPROM did not store the data") \
    X(42, "the EEPROM is being read or written") \
    X(43, "no station list is stored") \
    X(44, "the stored station list is damaged") \
    X(45, "write all stations of a list in order") \
    X(46, "a station list needs at least one station") \
    X(47, "the EEPROM is full") \
    X(48, "angles must be below 360 degrees") \
    X(49, "each angle must be larger than the last") \
    X(50, "a job is in progress") \
    X(51, "the job does not expect this now") \
    X(52, "the EDM cuts, or its keys are pending") \
    X(53, "the EDM reports an alarm") \
    X(54, "the EDM does not accept our keys") \
    X(55, "the cut did not start in time") \
    X(56, "the cut did not end in time") \
    X(57, "the power was lost during the job") \
    X(58, "paused by the operator") \
    X(59, "this key has no function") \
    X(60, "the position of the table is not known") \
    X(61, "this is not the list of the job") \
    X(62, "no stream is open on this axis") \
    X(63, "the queue of set-points is full") \
    X(64, "the set-point is late") \
    X(65, "the set-point is out of limits") \
    X(66, "check the sub-node") \
    X(67, "no values are saved") \
    X(68, "the saved values are damaged") \
    X(69, "the saved values are from another build") \
    X(70, "some saved values are not allowed") \
    X(71, "the saved values were not read") \
    X(72, "the firmware is too long") \
    X(73, "this is firmware of another node") \
    X(74, "the firmware is damaged") \
    X(75, "firmware is on trial") \
    X(76, "a drive is on") \
    X(77, "the flash failed")

// X(code, words), up to a colon
#define BUS_FAULT_WORDS(X) \
    X(0, "limit switch at the low end") \
    X(1, "limit switch at the high end") \
    X(2, "emergency stop") \
    X(3, "following error too large") \
    X(4, "encoder fault") \
    X(5, "the bus is silent") \
    X(6, "the drive reports a fault") \
    X(7, "the soft core stopped or hangs") \
    X(8, "the profile ran out of segments") \
    X(9, "too many steps are pending") \
    X(10, "a servo tick came before the motion engine had served the last one") \
    X(11, "a sample came before the shared interpolation chain had served the last one") \
    X(12, "no good packet came over the real-time link in time")

// X(code, words), up to a colon
#define BUS_JOB_STATE_WORDS(X) \
    X(0, "loading") \
    X(1, "ready") \
    X(2, "all cut") \
    X(3, "starting") \
    X(4, "table turns") \
    X(5, "at station") \
    X(6, "cut begins") \
    X(7, "cutting") \
    X(8, "cutting") \
    X(9, "cut done") \
    X(10, "leaving") \
    X(11, "finishing") \
    X(12, "paused") \
    X(13, "is it cut?") \
    X(14, "stopping")

enum bus_operation {
    BUS_OPERATION_IDENTIFY = 1,    // build and identity of the node
    // state, position and faults of an axis; ended is how the last motion ended (a cause)
    BUS_OPERATION_STATUS = 2,
    BUS_OPERATION_ENABLE = 3,    // switch the drive on (1) or off (0)
    BUS_OPERATION_HOME = 4,    // find the zero with the method of the parameter home_method
    // move to a position; while the axis is already moving it changes the target in flight, and
    // duration_ticks is 0
    BUS_OPERATION_MOVE = 5,
    BUS_OPERATION_STOP = 6,    // controlled stop; the drive stays on
    // clear latched faults whose cause is gone; the drive stays off
    BUS_OPERATION_RESET_FAULTS = 7,
    BUS_OPERATION_GET_PARAMETER = 8,    // read a parameter
    BUS_OPERATION_SET_PARAMETER = 9,    // write a parameter; not while the axis moves
    BUS_OPERATION_COUNTERS = 10,    // counters of the bus
    // signals of the encoder now, and the phase zero that the last homing found
    BUS_OPERATION_ENCODER = 11,
    BUS_OPERATION_READ_REGISTER = 12,    // one word of the register map, by byte address
    // read or control the sine/cosine calibration; scatter is in 2^-20 period
    BUS_OPERATION_CALIBRATION = 13,
    // offsets in 2^-15 of full scale, factors in 2^-16: sin' = gain (sin - offset) +
    // quadrature_error (cos - offset)
    BUS_OPERATION_GET_CORRECTION = 14,
    // phase error of order k, 1 to 10, in 2^-24 period: cosine cos k phase + sine sin k phase is
    // subtracted
    BUS_OPERATION_GET_HARMONIC = 15,
    // the fields of get_correction; apply 1 puts them into use, with all harmonics that were set
    // before, apply 0 keeps them waiting
    BUS_OPERATION_SET_CORRECTION = 16,
    // the fields of get_harmonic; they wait for set_correction; harmonics that are not set are 0
    BUS_OPERATION_SET_HARMONIC = 17,
    // signal faults of sine and cosine that are present now, and the first since reset_faults (bits
    // of signal_fault)
    BUS_OPERATION_SIGNAL = 18,
    // one word of the register map: only index, capture and compare of the feedback channels, and
    // in images that play streams the set-points and requests of a host
    BUS_OPERATION_WRITE_REGISTER = 19,
    BUS_OPERATION_PREPARE = 20,    // plan a motion to a position, and wait for start
    // start the prepared motions of these axes (bit n: axis n) in the same tick; none starts if one
    // of them has no prepared motion
    BUS_OPERATION_START = 21,
    // the segment table: number of loaded points, the use in force (as the parameter segments), and
    // why the requested use is not in force
    BUS_OPERATION_SEGMENTS = 22,
    // points of the segment table from this border on, in order: measured minus true position;
    // border 0 starts a new table
    BUS_OPERATION_SET_SEGMENTS = 23,
    BUS_OPERATION_GET_SEGMENTS = 24,    // points of the segment table from this border on
    BUS_OPERATION_POSITION = 30,    // position of an axis, in the shortest reply
    // until the next request, each read of the reply returns the position at that moment
    BUS_OPERATION_FOLLOW = 34,
    // change the baud rate after this reply; it returns to 115200 after a break, or after 5 s
    // without a request
    BUS_OPERATION_SET_BAUD = 35,
    // as start, but at the next sync, which all nodes of the bus receive at the same time; 0
    // cancels it
    BUS_OPERATION_START_AT_SYNC = 36,
    // record a sample every so many ticks, from before a trigger on; an amplitude other than 0
    // drives the axis in open loop, until it has moved farther than level
    BUS_OPERATION_ARM_SCOPE = 31,
    BUS_OPERATION_SCOPE = 32,    // progress of the recording; count is 0 until it is complete
    // five samples from this one on, 0 after the end; time between two samples in 64 cycles,
    // position: low word
    BUS_OPERATION_READ_SCOPE = 33,
    // record signals of one axis or several at each servo tick, or one tick in so many. A channel
    // is a tick_signal (bits 0 to 3) of an axis (bits 4 to 6), `last` is the number of the last
    // channel, and no two channels are the same. The trigger is a tick_signal of `axis` and a
    // tick_trigger, the mode; so many samples are from before it, or the first one comes so many
    // ticks after it, with the first value of an excitation. With 0 samples the recording has no
    // end and is read while it goes on. What does not fit into the memory ends it
    BUS_OPERATION_RECORD_TICKS = 28,
    // progress of that recording (a scope_state), and its next `count` words, in order from `first`
    // on: for each sample one word of each channel. There are none before it is complete, unless it
    // has no end
    BUS_OPERATION_READ_TICKS = 29,
    // values of the waveform of an excitation from this number on, full scale 2^15; nothing is
    // stored behind value 4096 - 1
    BUS_OPERATION_LOAD_EXCITATION = 39,
    // add that waveform, of so many values, to the commands of an axis whose drive is on, one value
    // at each servo tick, from the trigger of the next recording of ticks to its end. 0 withdraws
    // it, and so does any request to the axis but that which begins a motion
    BUS_OPERATION_EXCITE = 46,
    // add an offset to the DAC of the fine stage, in open loop, and record the phase from then on,
    // one in so many samples; before the first step both loops open, the command of the motor
    // returns to 0 and the fine stage to its middle; stop, or a fault, ends it
    BUS_OPERATION_STEP_FINE = 37,
    // progress of that recording (a scope_state); once it is complete, its next words, in order
    // from `first` on: two phases each, in 2^-16 period, the earlier one in the lower half; invalid
    // 1: the signal was disturbed
    BUS_OPERATION_READ_FINE = 38,
    // open a stream of set-points on an axis at rest; `start` begins it; for at most late_limit
    // ticks a missing set-point is extrapolated, 400 at most
    BUS_OPERATION_BEGIN_STREAM = 25,
    // append a set-point: its tick since the start, 2 to 256 after the one before, its position,
    // and its velocity in 2^-40 period per tick; last 1 ends the stream, at rest; room: set-points
    // that fit now
    BUS_OPERATION_SET_POINT = 26,
    // the stream: open 1 until it has ended, set-points that fit now, ticks that are queued at
    // least, the tick at which the queue ends, and since begin_stream the set-points accepted and
    // late, and the ticks extrapolated
    BUS_OPERATION_STREAM = 27,
    BUS_OPERATION_GET_SETTING = 40,    // read a setting of a station
    BUS_OPERATION_SET_SETTING = 41,    // write a setting of a station
    // turn the table of axis 0 to an absolute angle, in 0.01 arcsec; refused while an axis moves
    BUS_OPERATION_TURN_TO = 42,
    // what the table does, how its last turn ended, and the angle of its last reading; all angles
    // in 0.01 arcsec
    BUS_OPERATION_TURN_STATE = 43,
    // the last good frame of the angle sensor in 0.01 arcsec, its age in cycles, and the frames
    // since power-up
    BUS_OPERATION_SENSOR = 44,
    // state of the peer port: the last turn that was requested, the stations of a sub-node that
    // counts them, and what was received
    BUS_OPERATION_PEER = 45,
    // the station of its list to which the next order goes in mode legacy; saved in the EEPROM
    BUS_OPERATION_PEER_NEXT = 47,
    // what the job does, its station (from 0), why it waits, and which answers it expects (bits of
    // job_action)
    BUS_OPERATION_JOB = 48,
    BUS_OPERATION_JOB_DO = 49,    // start, pause, resume or stop the job, or answer its question
    // the stored station list; writing is 1 while it is written or read; ended is how that ended,
    // or why there is no list
    BUS_OPERATION_JOB_STATIONS = 50,
    BUS_OPERATION_JOB_ANGLE = 51,    // angle of a station of the stored list, in 0.01 arcsec
    // begin a new station list; it replaces the stored one when it is saved; refused while a job is
    // in progress
    BUS_OPERATION_JOB_BEGIN = 52,
    // add a station to the new list: in order, from 0 on, with ascending angles
    BUS_OPERATION_JOB_ADD = 53,
    // write the new station list and the settings to the EEPROM; job_stations reports the end
    BUS_OPERATION_JOB_SAVE = 54,
    // one of the saved values, by its number from 0 on, as it is in the EEPROM; owner: an axis, or
    // 255 for a setting. Refused with eeprom_busy while it is being read: ask again
    BUS_OPERATION_SAVED_VALUE = 55,
    // save parameters and settings to the EEPROM, or clear them; saved_settings reports the end
    BUS_OPERATION_SAVE_SETTINGS = 58,
    // the saved values, or why there are none; writing is 1 while the EEPROM is written or read;
    // damaged 1: one copy was damaged
    BUS_OPERATION_SAVED_SETTINGS = 59,
    // progress of an update; cause: how its last step ended; image that runs: 0 the factory image,
    // 1 or 2 an updated one, with its CRC-32; trial 1: it is not confirmed; longest: bytes for
    // which there is room
    BUS_OPERATION_UPDATE_STATE = 60,
    // erase the image that is not in use, for new firmware of so many bytes with this CRC-32, made
    // for this register map, memory and number of axes; refused while a drive is on
    BUS_OPERATION_BEGIN_UPDATE = 61,
    BUS_OPERATION_WRITE_UPDATE = 62,    // write block number `block` of the new firmware, 32 bytes
    // check, start or confirm the new firmware (an update_action); update_state reports the end;
    // refused while a drive is on
    BUS_OPERATION_UPDATE = 63,
};

// Lengths of whole bodies and offsets of their fields, in bytes, little endian.
#define BUS_IDENTIFY_REQUEST_LENGTH 2u
#define BUS_IDENTIFY_REPLY_LENGTH 27u
#define BUS_IDENTIFY_REPLY_MAP_CRC 3u    // u32
#define BUS_IDENTIFY_REPLY_PROTOCOL_CRC 7u    // u32
#define BUS_IDENTIFY_REPLY_VERSION 11u    // u16
#define BUS_IDENTIFY_REPLY_ADDRESS 13u    // u8
#define BUS_IDENTIFY_REPLY_AXES 14u    // u8
#define BUS_IDENTIFY_REPLY_CLK_HZ 15u    // u32
#define BUS_IDENTIFY_REPLY_TICK_HZ 19u    // u32
#define BUS_IDENTIFY_REPLY_SAMPLE_HZ 23u    // u32
#define BUS_STATUS_REQUEST_LENGTH 3u
#define BUS_STATUS_REQUEST_AXIS 2u    // u8
#define BUS_STATUS_REPLY_LENGTH 41u
#define BUS_STATUS_REPLY_STATE 3u    // u8
#define BUS_STATUS_REPLY_ENDED 4u    // u8
#define BUS_STATUS_REPLY_FLAGS 5u    // u8
#define BUS_STATUS_REPLY_ENCODER_EVENTS 6u    // u8
#define BUS_STATUS_REPLY_FAULTS 7u    // u16
#define BUS_STATUS_REPLY_FIRST_FAULT 9u    // u16
#define BUS_STATUS_REPLY_POSITION 11u    // i64
#define BUS_STATUS_REPLY_TARGET 19u    // i64
#define BUS_STATUS_REPLY_VELOCITY 27u    // i32
#define BUS_STATUS_REPLY_COMMAND 31u    // i16
#define BUS_STATUS_REPLY_COUNTS 33u    // i64
#define BUS_ENABLE_REQUEST_LENGTH 4u
#define BUS_ENABLE_REQUEST_AXIS 2u    // u8
#define BUS_ENABLE_REQUEST_ON 3u    // u8
#define BUS_ENABLE_REPLY_LENGTH 3u
#define BUS_HOME_REQUEST_LENGTH 3u
#define BUS_HOME_REQUEST_AXIS 2u    // u8
#define BUS_HOME_REPLY_LENGTH 3u
#define BUS_MOVE_REQUEST_LENGTH 11u
#define BUS_MOVE_REQUEST_AXIS 2u    // u8
#define BUS_MOVE_REQUEST_TARGET 3u    // i64
#define BUS_MOVE_REPLY_LENGTH 7u
#define BUS_MOVE_REPLY_DURATION_TICKS 3u    // u32
#define BUS_STOP_REQUEST_LENGTH 3u
#define BUS_STOP_REQUEST_AXIS 2u    // u8
#define BUS_STOP_REPLY_LENGTH 3u
#define BUS_RESET_FAULTS_REQUEST_LENGTH 3u
#define BUS_RESET_FAULTS_REQUEST_AXIS 2u    // u8
#define BUS_RESET_FAULTS_REPLY_LENGTH 3u
#define BUS_GET_PARAMETER_REQUEST_LENGTH 4u
#define BUS_GET_PARAMETER_REQUEST_AXIS 2u    // u8
#define BUS_GET_PARAMETER_REQUEST_PARAMETER 3u    // u8
#define BUS_GET_PARAMETER_REPLY_LENGTH 11u
#define BUS_GET_PARAMETER_REPLY_VALUE 3u    // i64
#define BUS_SET_PARAMETER_REQUEST_LENGTH 12u
#define BUS_SET_PARAMETER_REQUEST_AXIS 2u    // u8
#define BUS_SET_PARAMETER_REQUEST_PARAMETER 3u    // u8
#define BUS_SET_PARAMETER_REQUEST_VALUE 4u    // i64
#define BUS_SET_PARAMETER_REPLY_LENGTH 3u
#define BUS_COUNTERS_REQUEST_LENGTH 2u
#define BUS_COUNTERS_REPLY_LENGTH 43u
#define BUS_COUNTERS_REPLY_FRAMES_GOOD 3u    // u32
#define BUS_COUNTERS_REPLY_FRAMES_BAD 7u    // u32
#define BUS_COUNTERS_REPLY_FRAMING_ERRORS 11u    // u32
#define BUS_COUNTERS_REPLY_START_GLITCHES 15u    // u32
#define BUS_COUNTERS_REPLY_OVERRUNS 19u    // u32
#define BUS_COUNTERS_REPLY_REPEATED 23u    // u32
#define BUS_COUNTERS_REPLY_REFUSED 27u    // u32
#define BUS_COUNTERS_REPLY_BREAKS 31u    // u32
#define BUS_COUNTERS_REPLY_TRANSMIT_TIMEOUTS 35u    // u32
#define BUS_COUNTERS_REPLY_SYNCS 39u    // u32
#define BUS_ENCODER_REQUEST_LENGTH 3u
#define BUS_ENCODER_REQUEST_AXIS 2u    // u8
#define BUS_ENCODER_REPLY_LENGTH 35u
#define BUS_ENCODER_REPLY_SIN 3u    // i16
#define BUS_ENCODER_REPLY_COS 5u    // i16
#define BUS_ENCODER_REPLY_PHASE 7u    // u16
#define BUS_ENCODER_REPLY_AMPLITUDE 9u    // u16
#define BUS_ENCODER_REPLY_QUADRATURE_COUNT 11u    // i32
#define BUS_ENCODER_REPLY_REJECTED_PULSES 15u    // u32
#define BUS_ENCODER_REPLY_REJECTED_SAMPLES 19u    // u32
#define BUS_ENCODER_REPLY_HOME_PHASE 23u    // i32
#define BUS_ENCODER_REPLY_FAULT_POSITION 27u    // i64
#define BUS_READ_REGISTER_REQUEST_LENGTH 4u
#define BUS_READ_REGISTER_REQUEST_ADDRESS 2u    // u16
#define BUS_READ_REGISTER_REPLY_LENGTH 7u
#define BUS_READ_REGISTER_REPLY_VALUE 3u    // u32
#define BUS_CALIBRATION_REQUEST_LENGTH 4u
#define BUS_CALIBRATION_REQUEST_AXIS 2u    // u8
#define BUS_CALIBRATION_REQUEST_ACTION 3u    // u8
#define BUS_CALIBRATION_REPLY_LENGTH 18u
#define BUS_CALIBRATION_REPLY_REASON 3u    // u8
#define BUS_CALIBRATION_REPLY_CONVERGED 4u    // u8
#define BUS_CALIBRATION_REPLY_FROZEN 5u    // u8
#define BUS_CALIBRATION_REPLY_ACCEPTED 6u    // u32
#define BUS_CALIBRATION_REPLY_REFUSED 10u    // u32
#define BUS_CALIBRATION_REPLY_SCATTER 14u    // u32
#define BUS_GET_CORRECTION_REQUEST_LENGTH 3u
#define BUS_GET_CORRECTION_REQUEST_AXIS 2u    // u8
#define BUS_GET_CORRECTION_REPLY_LENGTH 15u
#define BUS_GET_CORRECTION_REPLY_SIN_OFFSET 3u    // i16
#define BUS_GET_CORRECTION_REPLY_COS_OFFSET 5u    // i16
#define BUS_GET_CORRECTION_REPLY_GAIN 7u    // i32
#define BUS_GET_CORRECTION_REPLY_QUADRATURE_ERROR 11u    // i32
#define BUS_GET_HARMONIC_REQUEST_LENGTH 4u
#define BUS_GET_HARMONIC_REQUEST_AXIS 2u    // u8
#define BUS_GET_HARMONIC_REQUEST_ORDER 3u    // u8
#define BUS_GET_HARMONIC_REPLY_LENGTH 11u
#define BUS_GET_HARMONIC_REPLY_COSINE 3u    // i32
#define BUS_GET_HARMONIC_REPLY_SINE 7u    // i32
#define BUS_SET_CORRECTION_REQUEST_LENGTH 16u
#define BUS_SET_CORRECTION_REQUEST_AXIS 2u    // u8
#define BUS_SET_CORRECTION_REQUEST_SIN_OFFSET 3u    // i16
#define BUS_SET_CORRECTION_REQUEST_COS_OFFSET 5u    // i16
#define BUS_SET_CORRECTION_REQUEST_GAIN 7u    // i32
#define BUS_SET_CORRECTION_REQUEST_QUADRATURE_ERROR 11u    // i32
#define BUS_SET_CORRECTION_REQUEST_APPLY 15u    // u8
#define BUS_SET_CORRECTION_REPLY_LENGTH 3u
#define BUS_SET_HARMONIC_REQUEST_LENGTH 12u
#define BUS_SET_HARMONIC_REQUEST_AXIS 2u    // u8
#define BUS_SET_HARMONIC_REQUEST_ORDER 3u    // u8
#define BUS_SET_HARMONIC_REQUEST_COSINE 4u    // i32
#define BUS_SET_HARMONIC_REQUEST_SINE 8u    // i32
#define BUS_SET_HARMONIC_REPLY_LENGTH 3u
#define BUS_SIGNAL_REQUEST_LENGTH 3u
#define BUS_SIGNAL_REQUEST_AXIS 2u    // u8
#define BUS_SIGNAL_REPLY_LENGTH 7u
#define BUS_SIGNAL_REPLY_FAULTS 3u    // u16
#define BUS_SIGNAL_REPLY_FIRST 5u    // u16
#define BUS_WRITE_REGISTER_REQUEST_LENGTH 8u
#define BUS_WRITE_REGISTER_REQUEST_ADDRESS 2u    // u16
#define BUS_WRITE_REGISTER_REQUEST_VALUE 4u    // u32
#define BUS_WRITE_REGISTER_REPLY_LENGTH 3u
#define BUS_PREPARE_REQUEST_LENGTH 11u
#define BUS_PREPARE_REQUEST_AXIS 2u    // u8
#define BUS_PREPARE_REQUEST_TARGET 3u    // i64
#define BUS_PREPARE_REPLY_LENGTH 7u
#define BUS_PREPARE_REPLY_DURATION_TICKS 3u    // u32
#define BUS_START_REQUEST_LENGTH 3u
#define BUS_START_REQUEST_AXES 2u    // u8
#define BUS_START_REPLY_LENGTH 3u
#define BUS_SEGMENTS_REQUEST_LENGTH 3u
#define BUS_SEGMENTS_REQUEST_AXIS 2u    // u8
#define BUS_SEGMENTS_REPLY_LENGTH 7u
#define BUS_SEGMENTS_REPLY_LOADED 3u    // u16
#define BUS_SEGMENTS_REPLY_IN_FORCE 5u    // u8
#define BUS_SEGMENTS_REPLY_REASON 6u    // u8
#define BUS_SET_SEGMENTS_REQUEST_LENGTH 53u
#define BUS_SET_SEGMENTS_REQUEST_AXIS 2u    // u8
#define BUS_SET_SEGMENTS_REQUEST_BORDER 3u    // u8
#define BUS_SET_SEGMENTS_REQUEST_POINTS 4u    // u8
#define BUS_SET_SEGMENTS_REQUEST_POINT_0 5u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_1 9u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_2 13u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_3 17u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_4 21u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_5 25u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_6 29u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_7 33u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_8 37u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_9 41u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_10 45u    // i32
#define BUS_SET_SEGMENTS_REQUEST_POINT_11 49u    // i32
#define BUS_SET_SEGMENTS_REPLY_LENGTH 3u
#define BUS_GET_SEGMENTS_REQUEST_LENGTH 4u
#define BUS_GET_SEGMENTS_REQUEST_AXIS 2u    // u8
#define BUS_GET_SEGMENTS_REQUEST_BORDER 3u    // u8
#define BUS_GET_SEGMENTS_REPLY_LENGTH 51u
#define BUS_GET_SEGMENTS_REPLY_POINT_0 3u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_1 7u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_2 11u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_3 15u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_4 19u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_5 23u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_6 27u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_7 31u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_8 35u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_9 39u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_10 43u    // i32
#define BUS_GET_SEGMENTS_REPLY_POINT_11 47u    // i32
#define BUS_POSITION_REQUEST_LENGTH 3u
#define BUS_POSITION_REQUEST_AXIS 2u    // u8
#define BUS_POSITION_REPLY_LENGTH 11u
#define BUS_POSITION_REPLY_POSITION 3u    // i64
#define BUS_FOLLOW_REQUEST_LENGTH 3u
#define BUS_FOLLOW_REQUEST_AXIS 2u    // u8
#define BUS_FOLLOW_REPLY_LENGTH 11u
#define BUS_FOLLOW_REPLY_POSITION 3u    // i64
#define BUS_SET_BAUD_REQUEST_LENGTH 6u
#define BUS_SET_BAUD_REQUEST_BAUD 2u    // u32
#define BUS_SET_BAUD_REPLY_LENGTH 3u
#define BUS_START_AT_SYNC_REQUEST_LENGTH 3u
#define BUS_START_AT_SYNC_REQUEST_AXES 2u    // u8
#define BUS_START_AT_SYNC_REPLY_LENGTH 3u
#define BUS_ARM_SCOPE_REQUEST_LENGTH 13u
#define BUS_ARM_SCOPE_REQUEST_AXIS 2u    // u8
#define BUS_ARM_SCOPE_REQUEST_TRIGGER 3u    // u8
#define BUS_ARM_SCOPE_REQUEST_BEFORE 4u    // u8
#define BUS_ARM_SCOPE_REQUEST_EVERY 5u    // u16
#define BUS_ARM_SCOPE_REQUEST_LEVEL 7u    // u32
#define BUS_ARM_SCOPE_REQUEST_AMPLITUDE 11u    // i16
#define BUS_ARM_SCOPE_REPLY_LENGTH 3u
#define BUS_SCOPE_REQUEST_LENGTH 2u
#define BUS_SCOPE_REPLY_LENGTH 6u
#define BUS_SCOPE_REPLY_STATE 3u    // u8
#define BUS_SCOPE_REPLY_COUNT 4u    // u8
#define BUS_SCOPE_REPLY_BEFORE 5u    // u8
#define BUS_READ_SCOPE_REQUEST_LENGTH 3u
#define BUS_READ_SCOPE_REQUEST_FIRST 2u    // u8
#define BUS_READ_SCOPE_REPLY_LENGTH 63u
#define BUS_READ_SCOPE_REPLY_POSITION_0 3u    // i32
#define BUS_READ_SCOPE_REPLY_ERROR_0 7u    // i32
#define BUS_READ_SCOPE_REPLY_COMMAND_0 11u    // i16
#define BUS_READ_SCOPE_REPLY_TIME_0 13u    // u16
#define BUS_READ_SCOPE_REPLY_POSITION_1 15u    // i32
#define BUS_READ_SCOPE_REPLY_ERROR_1 19u    // i32
#define BUS_READ_SCOPE_REPLY_COMMAND_1 23u    // i16
#define BUS_READ_SCOPE_REPLY_TIME_1 25u    // u16
#define BUS_READ_SCOPE_REPLY_POSITION_2 27u    // i32
#define BUS_READ_SCOPE_REPLY_ERROR_2 31u    // i32
#define BUS_READ_SCOPE_REPLY_COMMAND_2 35u    // i16
#define BUS_READ_SCOPE_REPLY_TIME_2 37u    // u16
#define BUS_READ_SCOPE_REPLY_POSITION_3 39u    // i32
#define BUS_READ_SCOPE_REPLY_ERROR_3 43u    // i32
#define BUS_READ_SCOPE_REPLY_COMMAND_3 47u    // i16
#define BUS_READ_SCOPE_REPLY_TIME_3 49u    // u16
#define BUS_READ_SCOPE_REPLY_POSITION_4 51u    // i32
#define BUS_READ_SCOPE_REPLY_ERROR_4 55u    // i32
#define BUS_READ_SCOPE_REPLY_COMMAND_4 59u    // i16
#define BUS_READ_SCOPE_REPLY_TIME_4 61u    // u16
#define BUS_RECORD_TICKS_REQUEST_LENGTH 26u
#define BUS_RECORD_TICKS_REQUEST_AXIS 2u    // u8
#define BUS_RECORD_TICKS_REQUEST_LAST 3u    // u8
#define BUS_RECORD_TICKS_REQUEST_TRIGGER 4u    // u8
#define BUS_RECORD_TICKS_REQUEST_MODE 5u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_0 6u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_1 7u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_2 8u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_3 9u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_4 10u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_5 11u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_6 12u    // u8
#define BUS_RECORD_TICKS_REQUEST_CHANNEL_7 13u    // u8
#define BUS_RECORD_TICKS_REQUEST_SAMPLES 14u    // u16
#define BUS_RECORD_TICKS_REQUEST_EVERY 16u    // u16
#define BUS_RECORD_TICKS_REQUEST_EARLIER 18u    // u16
#define BUS_RECORD_TICKS_REQUEST_DELAY 20u    // u16
#define BUS_RECORD_TICKS_REQUEST_LEVEL 22u    // i32
#define BUS_RECORD_TICKS_REPLY_LENGTH 3u
#define BUS_READ_TICKS_REQUEST_LENGTH 2u
#define BUS_READ_TICKS_REPLY_LENGTH 63u
#define BUS_READ_TICKS_REPLY_STATE 3u    // u8
#define BUS_READ_TICKS_REPLY_FIRST 4u    // u16
#define BUS_READ_TICKS_REPLY_COUNT 6u    // u8
#define BUS_READ_TICKS_REPLY_WORD_0 7u    // u32
#define BUS_READ_TICKS_REPLY_WORD_1 11u    // u32
#define BUS_READ_TICKS_REPLY_WORD_2 15u    // u32
#define BUS_READ_TICKS_REPLY_WORD_3 19u    // u32
#define BUS_READ_TICKS_REPLY_WORD_4 23u    // u32
#define BUS_READ_TICKS_REPLY_WORD_5 27u    // u32
#define BUS_READ_TICKS_REPLY_WORD_6 31u    // u32
#define BUS_READ_TICKS_REPLY_WORD_7 35u    // u32
#define BUS_READ_TICKS_REPLY_WORD_8 39u    // u32
#define BUS_READ_TICKS_REPLY_WORD_9 43u    // u32
#define BUS_READ_TICKS_REPLY_WORD_10 47u    // u32
#define BUS_READ_TICKS_REPLY_WORD_11 51u    // u32
#define BUS_READ_TICKS_REPLY_WORD_12 55u    // u32
#define BUS_READ_TICKS_REPLY_WORD_13 59u    // u32
#define BUS_LOAD_EXCITATION_REQUEST_LENGTH 52u
#define BUS_LOAD_EXCITATION_REQUEST_FIRST 2u    // u16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_0 4u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_1 6u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_2 8u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_3 10u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_4 12u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_5 14u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_6 16u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_7 18u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_8 20u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_9 22u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_10 24u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_11 26u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_12 28u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_13 30u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_14 32u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_15 34u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_16 36u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_17 38u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_18 40u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_19 42u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_20 44u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_21 46u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_22 48u    // i16
#define BUS_LOAD_EXCITATION_REQUEST_VALUE_23 50u    // i16
#define BUS_LOAD_EXCITATION_REPLY_LENGTH 3u
#define BUS_EXCITE_REQUEST_LENGTH 5u
#define BUS_EXCITE_REQUEST_AXIS 2u    // u8
#define BUS_EXCITE_REQUEST_PERIOD 3u    // u16
#define BUS_EXCITE_REPLY_LENGTH 3u
#define BUS_STEP_FINE_REQUEST_LENGTH 7u
#define BUS_STEP_FINE_REQUEST_AXIS 2u    // u8
#define BUS_STEP_FINE_REQUEST_OFFSET 3u    // i16
#define BUS_STEP_FINE_REQUEST_EVERY 5u    // u16
#define BUS_STEP_FINE_REPLY_LENGTH 3u
#define BUS_READ_FINE_REQUEST_LENGTH 3u
#define BUS_READ_FINE_REQUEST_AXIS 2u    // u8
#define BUS_READ_FINE_REPLY_LENGTH 63u
#define BUS_READ_FINE_REPLY_STATE 3u    // u8
#define BUS_READ_FINE_REPLY_INVALID 4u    // u8
#define BUS_READ_FINE_REPLY_FIRST 5u    // u16
#define BUS_READ_FINE_REPLY_WORD_0 7u    // u32
#define BUS_READ_FINE_REPLY_WORD_1 11u    // u32
#define BUS_READ_FINE_REPLY_WORD_2 15u    // u32
#define BUS_READ_FINE_REPLY_WORD_3 19u    // u32
#define BUS_READ_FINE_REPLY_WORD_4 23u    // u32
#define BUS_READ_FINE_REPLY_WORD_5 27u    // u32
#define BUS_READ_FINE_REPLY_WORD_6 31u    // u32
#define BUS_READ_FINE_REPLY_WORD_7 35u    // u32
#define BUS_READ_FINE_REPLY_WORD_8 39u    // u32
#define BUS_READ_FINE_REPLY_WORD_9 43u    // u32
#define BUS_READ_FINE_REPLY_WORD_10 47u    // u32
#define BUS_READ_FINE_REPLY_WORD_11 51u    // u32
#define BUS_READ_FINE_REPLY_WORD_12 55u    // u32
#define BUS_READ_FINE_REPLY_WORD_13 59u    // u32
#define BUS_BEGIN_STREAM_REQUEST_LENGTH 5u
#define BUS_BEGIN_STREAM_REQUEST_AXIS 2u    // u8
#define BUS_BEGIN_STREAM_REQUEST_LATE_LIMIT 3u    // u16
#define BUS_BEGIN_STREAM_REPLY_LENGTH 3u
#define BUS_SET_POINT_REQUEST_LENGTH 24u
#define BUS_SET_POINT_REQUEST_AXIS 2u    // u8
#define BUS_SET_POINT_REQUEST_LAST 3u    // u8
#define BUS_SET_POINT_REQUEST_TICK 4u    // u32
#define BUS_SET_POINT_REQUEST_POSITION 8u    // i64
#define BUS_SET_POINT_REQUEST_VELOCITY 16u    // i64
#define BUS_SET_POINT_REPLY_LENGTH 4u
#define BUS_SET_POINT_REPLY_ROOM 3u    // u8
#define BUS_STREAM_REQUEST_LENGTH 3u
#define BUS_STREAM_REQUEST_AXIS 2u    // u8
#define BUS_STREAM_REPLY_LENGTH 23u
#define BUS_STREAM_REPLY_OPEN 3u    // u8
#define BUS_STREAM_REPLY_ROOM 4u    // u8
#define BUS_STREAM_REPLY_QUEUED 5u    // u16
#define BUS_STREAM_REPLY_END 7u    // u32
#define BUS_STREAM_REPLY_ACCEPTED 11u    // u32
#define BUS_STREAM_REPLY_LATE 15u    // u32
#define BUS_STREAM_REPLY_EXTRAPOLATED 19u    // u32
#define BUS_GET_SETTING_REQUEST_LENGTH 3u
#define BUS_GET_SETTING_REQUEST_SETTING 2u    // u8
#define BUS_GET_SETTING_REPLY_LENGTH 11u
#define BUS_GET_SETTING_REPLY_VALUE 3u    // i64
#define BUS_SET_SETTING_REQUEST_LENGTH 11u
#define BUS_SET_SETTING_REQUEST_SETTING 2u    // u8
#define BUS_SET_SETTING_REQUEST_VALUE 3u    // i64
#define BUS_SET_SETTING_REPLY_LENGTH 3u
#define BUS_TURN_TO_REQUEST_LENGTH 6u
#define BUS_TURN_TO_REQUEST_ANGLE 2u    // u32
#define BUS_TURN_TO_REPLY_LENGTH 3u
#define BUS_TURN_STATE_REQUEST_LENGTH 2u
#define BUS_TURN_STATE_REPLY_LENGTH 19u
#define BUS_TURN_STATE_REPLY_PHASE 3u    // u8
#define BUS_TURN_STATE_REPLY_ENDED 4u    // u8
#define BUS_TURN_STATE_REPLY_TRIES 5u    // u8
#define BUS_TURN_STATE_REPLY_OVERSHOOTS 6u    // u8
#define BUS_TURN_STATE_REPLY_TARGET 7u    // u32
#define BUS_TURN_STATE_REPLY_READING 11u    // u32
#define BUS_TURN_STATE_REPLY_LEFT 15u    // i32
#define BUS_SENSOR_REQUEST_LENGTH 2u
#define BUS_SENSOR_REPLY_LENGTH 28u
#define BUS_SENSOR_REPLY_ANGLE 3u    // u32
#define BUS_SENSOR_REPLY_AGE 7u    // u32
#define BUS_SENSOR_REPLY_TIMED_OUT 11u    // u8
#define BUS_SENSOR_REPLY_FRAMES 12u    // u32
#define BUS_SENSOR_REPLY_WRONG_CRC 16u    // u32
#define BUS_SENSOR_REPLY_BROKEN 20u    // u32
#define BUS_SENSOR_REPLY_MISSED 24u    // u32
#define BUS_PEER_REQUEST_LENGTH 2u
#define BUS_PEER_REPLY_LENGTH 23u
#define BUS_PEER_REPLY_PHASE 3u    // u8
#define BUS_PEER_REPLY_ENDED 4u    // u8
#define BUS_PEER_REPLY_STATION 5u    // u16
#define BUS_PEER_REPLY_STATIONS 7u    // u16
#define BUS_PEER_REPLY_NEXT 9u    // u16
#define BUS_PEER_REPLY_HEARD 11u    // u32
#define BUS_PEER_REPLY_GARBAGE 15u    // u32
#define BUS_PEER_REPLY_REPEATED 19u    // u32
#define BUS_PEER_NEXT_REQUEST_LENGTH 4u
#define BUS_PEER_NEXT_REQUEST_STATION 2u    // u16
#define BUS_PEER_NEXT_REPLY_LENGTH 3u
#define BUS_JOB_REQUEST_LENGTH 2u
#define BUS_JOB_REPLY_LENGTH 13u
#define BUS_JOB_REPLY_STATE 3u    // u8
#define BUS_JOB_REPLY_CAUSE 4u    // u8
#define BUS_JOB_REPLY_STATION 5u    // u16
#define BUS_JOB_REPLY_STATIONS 7u    // u16
#define BUS_JOB_REPLY_ANSWERS 9u    // u8
#define BUS_JOB_REPLY_FLAGS 10u    // u8
#define BUS_JOB_REPLY_TABLE_FAULTS 11u    // u16
#define BUS_JOB_DO_REQUEST_LENGTH 3u
#define BUS_JOB_DO_REQUEST_ACTION 2u    // u8
#define BUS_JOB_DO_REPLY_LENGTH 3u
#define BUS_JOB_STATIONS_REQUEST_LENGTH 2u
#define BUS_JOB_STATIONS_REPLY_LENGTH 15u
#define BUS_JOB_STATIONS_REPLY_WRITING 3u    // u8
#define BUS_JOB_STATIONS_REPLY_ENDED 4u    // u8
#define BUS_JOB_STATIONS_REPLY_GENERATION 5u    // u32
#define BUS_JOB_STATIONS_REPLY_STATIONS 9u    // u16
#define BUS_JOB_STATIONS_REPLY_JOURNAL 11u    // u32
#define BUS_JOB_ANGLE_REQUEST_LENGTH 4u
#define BUS_JOB_ANGLE_REQUEST_STATION 2u    // u16
#define BUS_JOB_ANGLE_REPLY_LENGTH 7u
#define BUS_JOB_ANGLE_REPLY_ANGLE 3u    // u32
#define BUS_JOB_BEGIN_REQUEST_LENGTH 2u
#define BUS_JOB_BEGIN_REPLY_LENGTH 3u
#define BUS_JOB_ADD_REQUEST_LENGTH 8u
#define BUS_JOB_ADD_REQUEST_STATION 2u    // u16
#define BUS_JOB_ADD_REQUEST_ANGLE 4u    // u32
#define BUS_JOB_ADD_REPLY_LENGTH 3u
#define BUS_JOB_SAVE_REQUEST_LENGTH 2u
#define BUS_JOB_SAVE_REPLY_LENGTH 3u
#define BUS_SAVED_VALUE_REQUEST_LENGTH 4u
#define BUS_SAVED_VALUE_REQUEST_NUMBER 2u    // u16
#define BUS_SAVED_VALUE_REPLY_LENGTH 13u
#define BUS_SAVED_VALUE_REPLY_OWNER 3u    // u8
#define BUS_SAVED_VALUE_REPLY_ID 4u    // u8
#define BUS_SAVED_VALUE_REPLY_VALUE 5u    // i64
#define BUS_SAVE_SETTINGS_REQUEST_LENGTH 3u
#define BUS_SAVE_SETTINGS_REQUEST_ACTION 2u    // u8
#define BUS_SAVE_SETTINGS_REPLY_LENGTH 3u
#define BUS_SAVED_SETTINGS_REQUEST_LENGTH 2u
#define BUS_SAVED_SETTINGS_REPLY_LENGTH 12u
#define BUS_SAVED_SETTINGS_REPLY_WRITING 3u    // u8
#define BUS_SAVED_SETTINGS_REPLY_CAUSE 4u    // u8
#define BUS_SAVED_SETTINGS_REPLY_DAMAGED 5u    // u8
#define BUS_SAVED_SETTINGS_REPLY_GENERATION 6u    // u32
#define BUS_SAVED_SETTINGS_REPLY_VALUES 10u    // u16
#define BUS_UPDATE_STATE_REQUEST_LENGTH 2u
#define BUS_UPDATE_STATE_REPLY_LENGTH 15u
#define BUS_UPDATE_STATE_REPLY_STATE 3u    // u8
#define BUS_UPDATE_STATE_REPLY_ENDED 4u    // u8
#define BUS_UPDATE_STATE_REPLY_IMAGE 5u    // u8
#define BUS_UPDATE_STATE_REPLY_TRIAL 6u    // u8
#define BUS_UPDATE_STATE_REPLY_CRC 7u    // u32
#define BUS_UPDATE_STATE_REPLY_LONGEST 11u    // u32
#define BUS_BEGIN_UPDATE_REQUEST_LENGTH 19u
#define BUS_BEGIN_UPDATE_REQUEST_BYTES 2u    // u32
#define BUS_BEGIN_UPDATE_REQUEST_CRC 6u    // u32
#define BUS_BEGIN_UPDATE_REQUEST_MAP_CRC 10u    // u32
#define BUS_BEGIN_UPDATE_REQUEST_MEMORY 14u    // u32
#define BUS_BEGIN_UPDATE_REQUEST_AXES 18u    // u8
#define BUS_BEGIN_UPDATE_REPLY_LENGTH 3u
#define BUS_WRITE_UPDATE_REQUEST_LENGTH 36u
#define BUS_WRITE_UPDATE_REQUEST_BLOCK 2u    // u16
#define BUS_WRITE_UPDATE_REQUEST_WORD_0 4u    // u32
#define BUS_WRITE_UPDATE_REQUEST_WORD_1 8u    // u32
#define BUS_WRITE_UPDATE_REQUEST_WORD_2 12u    // u32
#define BUS_WRITE_UPDATE_REQUEST_WORD_3 16u    // u32
#define BUS_WRITE_UPDATE_REQUEST_WORD_4 20u    // u32
#define BUS_WRITE_UPDATE_REQUEST_WORD_5 24u    // u32
#define BUS_WRITE_UPDATE_REQUEST_WORD_6 28u    // u32
#define BUS_WRITE_UPDATE_REQUEST_WORD_7 32u    // u32
#define BUS_WRITE_UPDATE_REPLY_LENGTH 3u
#define BUS_UPDATE_REQUEST_LENGTH 3u
#define BUS_UPDATE_REQUEST_ACTION 2u    // u8
#define BUS_UPDATE_REPLY_LENGTH 3u

// X(name, code, length of the request body, length of the reply body if the cause is ok, 1 if the
// first field is an axis)
#define BUS_OPERATIONS(X) \
    X(identify, 1, 2, 27, 0) \
    X(status, 2, 3, 41, 1) \
    X(enable, 3, 4, 3, 1) \
    X(home, 4, 3, 3, 1) \
    X(move, 5, 11, 7, 1) \
    X(stop, 6, 3, 3, 1) \
    X(reset_faults, 7, 3, 3, 1) \
    X(get_parameter, 8, 4, 11, 1) \
    X(set_parameter, 9, 12, 3, 1) \
    X(counters, 10, 2, 43, 0) \
    X(encoder, 11, 3, 35, 1) \
    X(read_register, 12, 4, 7, 0) \
    X(calibration, 13, 4, 18, 1) \
    X(get_correction, 14, 3, 15, 1) \
    X(get_harmonic, 15, 4, 11, 1) \
    X(set_correction, 16, 16, 3, 1) \
    X(set_harmonic, 17, 12, 3, 1) \
    X(signal, 18, 3, 7, 1) \
    X(write_register, 19, 8, 3, 0) \
    X(prepare, 20, 11, 7, 1) \
    X(start, 21, 3, 3, 0) \
    X(segments, 22, 3, 7, 1) \
    X(set_segments, 23, 53, 3, 1) \
    X(get_segments, 24, 4, 51, 1) \
    X(position, 30, 3, 11, 1) \
    X(follow, 34, 3, 11, 1) \
    X(set_baud, 35, 6, 3, 0) \
    X(start_at_sync, 36, 3, 3, 0) \
    X(arm_scope, 31, 13, 3, 1) \
    X(scope, 32, 2, 6, 0) \
    X(read_scope, 33, 3, 63, 0) \
    X(record_ticks, 28, 26, 3, 1) \
    X(read_ticks, 29, 2, 63, 0) \
    X(load_excitation, 39, 52, 3, 0) \
    X(excite, 46, 5, 3, 1) \
    X(step_fine, 37, 7, 3, 1) \
    X(read_fine, 38, 3, 63, 1) \
    X(begin_stream, 25, 5, 3, 1) \
    X(set_point, 26, 24, 4, 1) \
    X(stream, 27, 3, 23, 1) \
    X(get_setting, 40, 3, 11, 0) \
    X(set_setting, 41, 11, 3, 0) \
    X(turn_to, 42, 6, 3, 0) \
    X(turn_state, 43, 2, 19, 0) \
    X(sensor, 44, 2, 28, 0) \
    X(peer, 45, 2, 23, 0) \
    X(peer_next, 47, 4, 3, 0) \
    X(job, 48, 2, 13, 0) \
    X(job_do, 49, 3, 3, 0) \
    X(job_stations, 50, 2, 15, 0) \
    X(job_angle, 51, 4, 7, 0) \
    X(job_begin, 52, 2, 3, 0) \
    X(job_add, 53, 8, 3, 0) \
    X(job_save, 54, 2, 3, 0) \
    X(saved_value, 55, 4, 13, 0) \
    X(save_settings, 58, 3, 3, 0) \
    X(saved_settings, 59, 2, 12, 0) \
    X(update_state, 60, 2, 15, 0) \
    X(begin_update, 61, 19, 3, 0) \
    X(write_update, 62, 36, 3, 0) \
    X(update, 63, 3, 3, 0)

enum bus_parameter {
    BUS_PARAMETER_PERIOD = 1,    // [1 pm] length of one signal period
    BUS_PARAMETER_COUNTS_PER_PERIOD = 2,    // counts of the read-out in one period
    BUS_PARAMETER_TRAVEL_LOW = 3,    // [1/65536 period] lowest target
    BUS_PARAMETER_TRAVEL_HIGH = 4,    // [1/65536 period] highest target
    BUS_PARAMETER_VELOCITY = 5,    // [1 period/s] top speed of a move
    BUS_PARAMETER_ACCELERATION = 6,    // [1 period/s2] largest acceleration
    BUS_PARAMETER_JERK = 7,    // [1 period/s3] largest jerk
    // [1 period/s] speed at which homing searches the switch or the index
    BUS_PARAMETER_HOMING_SEARCH_SPEED = 8,
    // [1 period/s] speed at which homing searches the edge of the switch
    BUS_PARAMETER_HOMING_LATCH_SPEED = 9,
    // [1/65536 period] distance from the edge of the switch to the zero
    BUS_PARAMETER_HOME_DISTANCE = 10,
    BUS_PARAMETER_HOME_END = 11,    // switch that homing uses: 0 low end, 1 high end
    // [1/65536 period] a motion has ended when the error has stayed inside this window
    BUS_PARAMETER_SETTLE_WINDOW = 12,
    BUS_PARAMETER_SETTLE_TIME = 13,    // [0.001 s] for this time
    // [0.001 s] a motion that has not ended after this time has failed
    BUS_PARAMETER_SETTLE_TIMEOUT = 14,
    // [1/65536] servo: proportional gain, command (2^-15 of full scale) per 2^-16 period
    BUS_PARAMETER_KP = 15,
    BUS_PARAMETER_KI = 16,    // [1/16777216] servo: integral gain per tick
    BUS_PARAMETER_KD = 17,    // [1/65536] servo: derivative gain
    BUS_PARAMETER_KV = 18,    // [1/65536] servo: velocity feed-forward
    BUS_PARAMETER_KA = 19,    // [1/256] servo: acceleration feed-forward
    BUS_PARAMETER_OUTPUT_LIMIT = 20,    // [1/32768] servo: largest command, of full scale
    BUS_PARAMETER_INTEGRAL_LIMIT = 21,    // [1/32768] servo: largest integral term, of full scale
    // [1/65536 period] servo: the integrator holds while the error at standstill is inside this
    BUS_PARAMETER_DEAD_BAND = 22,
    BUS_PARAMETER_FOLLOWING_LIMIT = 23,    // [1/65536 period] interlock: largest following error
    // [1e-9 s] deglitcher: a level counts when it is stable for this time; a pulse in pulse and
    // direction mode too
    BUS_PARAMETER_DEGLITCH = 24,
    BUS_PARAMETER_OUTLIER_STEP = 25,    // outlier filter: largest difference of two samples; 0 off
    // outlier filter: largest number of samples in a row that it replaces
    BUS_PARAMETER_OUTLIER_HOLD = 26,
    BUS_PARAMETER_AMPLITUDE_LOW = 27,    // encoder: smallest good amplitude, in ADC counts
    BUS_PARAMETER_AMPLITUDE_HIGH = 28,    // encoder: largest good amplitude, in ADC counts
    // [1/65536 period] encoder: largest difference of interpolated position and quadrature count; 0
    // off
    BUS_PARAMETER_DISAGREEMENT_LIMIT = 29,
    // encoder: events that are a fault (bits of encoder_event)
    BUS_PARAMETER_ENCODER_FAULT_MASK = 30,
    BUS_PARAMETER_PWM_FREQUENCY = 31,    // [1 Hz] drive: PWM frequency
    // [0.001 s] interlock: longest silence of the bus while a drive is on (all axes); 0: no limit,
    // for a machine that runs without a host
    BUS_PARAMETER_WATCHDOG_TIME = 32,
    // correction of sine and cosine: 0 frozen, 1 calibrates while the axis moves, 2 follows the
    // drift of offsets, gain and quadrature error
    BUS_PARAMETER_AUTO_CALIBRATION = 33,
    // decoder: 0 every edge, 1 every second, 2 every fourth, 3 pulse and direction; other than 0
    // needs disagreement_limit 0
    BUS_PARAMETER_DECODER_MODE = 34,
    // [1e-9 s] deglitcher: time between two samples of a level; 0: a sample in each cycle
    BUS_PARAMETER_FILTER_SKIP = 35,
    // deglitcher: samples of the old level that are tolerated in between
    BUS_PARAMETER_FILTER_TOLERATED = 36,
    // [1/65536 period] velocity: smallest step of the position; 0 plain difference
    BUS_PARAMETER_VELOCITY_QUANTUM = 37,
    // signal: signal faults that switch the drive off (bits of signal_fault)
    BUS_PARAMETER_SIGNAL_FAULT_MASK = 38,
    // signal: largest good code, in ADC counts, as all limits below; 65535 off
    BUS_PARAMETER_SIGNAL_CLIP_LEVEL = 39,
    // signal: largest good distance from the circle; 65535 off
    BUS_PARAMETER_SIGNAL_TOLERANCE = 40,
    // signal: smallest jump between two samples that is a fault; 65535 off
    BUS_PARAMETER_SIGNAL_JUMP = 41,
    // signal: number of samples with the same code that is a fault; 0 off. It needs noise: 1024 for
    // 0.5 counts rms
    BUS_PARAMETER_SIGNAL_NO_NOISE_SAMPLES = 42,
    // signal: movement of one channel in which the other must leave its band; 65535 off
    BUS_PARAMETER_SIGNAL_SPAN = 43,
    // signal: largest deviation by noise of a channel that does not move
    BUS_PARAMETER_SIGNAL_BAND = 44,
    // signal: the sign of samples above this is reliable; 65535 off
    BUS_PARAMETER_SIGNAL_SIGN_THRESHOLD = 45,
    BUS_PARAMETER_SIGNAL_OFFSET = 46,    // signal: largest good offset; 65535 off
    // signal: largest good difference of the amplitudes; 65535 off
    BUS_PARAMETER_SIGNAL_BALANCE = 47,
    // signal: largest good amplitude times sine of the phase error; 65535 off
    BUS_PARAMETER_SIGNAL_QUADRATURE_ERROR = 48,
    // position from: 0 interpolated sine and cosine (needs HAS_SINE, else 1 is the default), 1
    // counts of A/B, 2 the steps that the axis sends
    BUS_PARAMETER_POSITION_SOURCE = 49,
    // homing: CiA 402 methods 1, 2, 17, 18, 33, 34, 35, 37; -1 S0 (switch, distance, phase zero),
    // -2 S3 (index on either side)
    BUS_PARAMETER_HOME_METHOD = 50,
    BUS_PARAMETER_HOME_OFFSET = 51,    // [1 period] position of the zero that homing finds
    BUS_PARAMETER_DRIVE = 52,    // drive: 0 bridge, 1 steps, 2 DAC
    // [1/4294967296] steps: number in one period; a negative sign reverses the direction
    BUS_PARAMETER_STEPS_PER_PERIOD = 53,
    BUS_PARAMETER_STEP_HIGH = 54,    // [1e-9 s] steps: shortest pulse
    BUS_PARAMETER_STEP_LOW = 55,    // [1e-9 s] steps: shortest gap
    BUS_PARAMETER_STEP_SETUP = 56,    // [1e-9 s] steps: shortest time from direction to a pulse
    BUS_PARAMETER_STEP_HOLD = 57,    // [1e-9 s] steps: shortest time from a pulse to direction
    // steps: 0 step and direction, 1 quadrature, 2 pulses up and pulses down
    BUS_PARAMETER_STEP_OUTPUT = 58,
    // steps: 1 step is active low, 2 direction is low when going up, 3 both
    BUS_PARAMETER_STEP_INVERT = 59,
    // steps: the servo command shifts the target by command 2^trim / 65536 period
    BUS_PARAMETER_STEP_TRIM = 60,
    BUS_PARAMETER_DAC_CLOCK = 61,    // [1 Hz] DAC: highest clock of its frames
    BUS_PARAMETER_DAC_TRIM = 62,    // [1/32768] DAC: value for an output of 0 V, of full scale
    BUS_PARAMETER_FINE_KP = 63,    // [1/65536] fine stage: proportional gain
    BUS_PARAMETER_FINE_KI = 64,    // [1/16777216] fine stage: integral gain per tick
    BUS_PARAMETER_FINE_LIMIT = 65,    // [1/32768] fine stage: largest command, of full scale
    // [1/65536 period] fine stage: it takes over when the error is inside this; 0: there is no fine
    // stage
    BUS_PARAMETER_FINE_REACH = 66,
    // [1/65536] feed override: fraction of full speed of all profiles; 0 pauses; it may change
    // during a motion
    BUS_PARAMETER_FEED_OVERRIDE = 67,
    BUS_PARAMETER_FILTERS = 68,    // servo: filters in use, 1 the first, 2 the second, 3 both
    BUS_PARAMETER_FILTER_1_B0 = 69,    // [1/1073741824] servo: filter 1, coefficient b0
    BUS_PARAMETER_FILTER_1_B1 = 70,    // [1/1073741824] servo: filter 1, coefficient b1
    BUS_PARAMETER_FILTER_1_B2 = 71,    // [1/1073741824] servo: filter 1, coefficient b2
    BUS_PARAMETER_FILTER_1_A1 = 72,    // [1/1073741824] servo: filter 1, coefficient -a1
    BUS_PARAMETER_FILTER_1_A2 = 73,    // [1/1073741824] servo: filter 1, coefficient -a2
    BUS_PARAMETER_FILTER_2_B0 = 74,    // [1/1073741824] servo: filter 2, coefficient b0
    BUS_PARAMETER_FILTER_2_B1 = 75,    // [1/1073741824] servo: filter 2, coefficient b1
    BUS_PARAMETER_FILTER_2_B2 = 76,    // [1/1073741824] servo: filter 2, coefficient b2
    BUS_PARAMETER_FILTER_2_A1 = 77,    // [1/1073741824] servo: filter 2, coefficient -a1
    BUS_PARAMETER_FILTER_2_A2 = 78,    // [1/1073741824] servo: filter 2, coefficient -a2
    // profile of motions: 0 S-curve, 1 trapezoid (jerk is ignored), 2 stepped (velocity and the
    // stepped_ parameters)
    BUS_PARAMETER_PROFILE = 79,
    // [1/65536 period/s] stepped profile (S4): speed of the first step, f0
    BUS_PARAMETER_STEPPED_FIRST = 80,
    BUS_PARAMETER_STEPPED_TIME = 81,    // [0.00025 s] stepped profile: duration of each step
    // [1/65536 period/s] stepped profile: increment of a step in section 1, mirrored in 7
    BUS_PARAMETER_STEPPED_RISE_1 = 82,
    // [1/65536 period/s] stepped profile: increment in section 2, mirrored in 6
    BUS_PARAMETER_STEPPED_RISE_2 = 83,
    // [1/65536 period/s] stepped profile: increment in section 3, mirrored in 5
    BUS_PARAMETER_STEPPED_RISE_3 = 84,
    // [1/65536] stepped profile: where section 2 begins, as a fraction between stepped_first and
    // velocity
    BUS_PARAMETER_STEPPED_BORDER_2 = 85,
    // [1/65536] stepped profile: where section 3 begins: 1/2 gives 1:2:3, S4 prints 1/3
    BUS_PARAMETER_STEPPED_BORDER_3 = 86,
    BUS_PARAMETER_SEGMENT_COUNT = 87,    // segment table: number of segments
    BUS_PARAMETER_SEGMENT_LENGTH = 88,    // [1/65536 period] segment table: length of a segment
    // [1/65536 period] segment table: first border, from the position that homing finds
    BUS_PARAMETER_SEGMENT_FIRST = 89,
    // segment table: 0 off, 1 each segment has the mean of its borders (S0), 2 linear
    // interpolation; it is in force after homing
    BUS_PARAMETER_SEGMENTS = 90,
    // [1/65536] fine stage: derivative gain, for the change of the error in a tick
    BUS_PARAMETER_FINE_KD = 91,
    // index: it counts only at these levels of A and B: 0 any, 1 both low, 2 A high, 3 both high, 4
    // B high; found by `moire index survey`
    BUS_PARAMETER_INDEX_GATE = 92,
};
#define BUS_PARAMETER_COUNT 92u

// X(name, id, min, max, default): all int64_t, in counts of the wire
#define BUS_PARAMETERS(X) \
    X(period, 1, 1LL, 4000000000LL, 800000LL) \
    X(counts_per_period, 2, 1LL, 65536LL, 160LL) \
    X(travel_low, 3, -140737488355328LL, 140737488355327LL, -65536000LL) \
    X(travel_high, 4, -140737488355328LL, 140737488355327LL, 9797632000LL) \
    X(velocity, 5, 1LL, 1000000LL, 6000LL) \
    X(acceleration, 6, 1LL, 100000000LL, 125000LL) \
    X(jerk, 7, 1LL, 2000000000LL, 12500000LL) \
    X(homing_search_speed, 8, 1LL, 1000000LL, 5000LL) \
    X(homing_latch_speed, 9, 1LL, 1000000LL, 125LL) \
    X(home_distance, 10, 65536LL, 1000000000LL, 81920000LL) \
    X(home_end, 11, 0LL, 1LL, 0LL) \
    X(settle_window, 12, 1LL, 65536000LL, 1638LL) \
    X(settle_time, 13, 1LL, 10000LL, 20LL) \
    X(settle_timeout, 14, 1LL, 60000LL, 2000LL) \
    X(kp, 15, 0LL, 16777215LL, 1600LL) \
    X(ki, 16, 0LL, 16777215LL, 16000LL) \
    X(kd, 17, 0LL, 16777215LL, 20000LL) \
    X(kv, 18, 0LL, 16777215LL, 4942LL) \
    X(ka, 19, 0LL, 16777215LL, 643LL) \
    X(output_limit, 20, 0LL, 32767LL, 32000LL) \
    X(integral_limit, 21, 0LL, 32767LL, 20000LL) \
    X(dead_band, 22, 0LL, 65535LL, 400LL) \
    X(following_limit, 23, 1LL, 2147483647LL, 4096000LL) \
    X(deglitch, 24, 0LL, 1000000LL, 10000LL) \
    X(outlier_step, 25, 0LL, 255LL, 0LL) \
    X(outlier_hold, 26, 0LL, 255LL, 3LL) \
    X(amplitude_low, 27, 0LL, 65535LL, 32LL) \
    X(amplitude_high, 28, 0LL, 65535LL, 160LL) \
    X(disagreement_limit, 29, 0LL, 1048575LL, 32768LL) \
    X(encoder_fault_mask, 30, 0LL, 63LL, 30LL) \
    X(pwm_frequency, 31, 1000LL, 200000LL, 20000LL) \
    X(watchdog_time, 32, 0LL, 65535LL, 500LL) \
    X(auto_calibration, 33, 0LL, 2LL, 0LL) \
    X(decoder_mode, 34, 0LL, 3LL, 0LL) \
    X(filter_skip, 35, 0LL, 1000000LL, 0LL) \
    X(filter_tolerated, 36, 0LL, 15LL, 0LL) \
    X(velocity_quantum, 37, 0LL, 65535LL, 128LL) \
    X(signal_fault_mask, 38, 0LL, 32767LL, 0LL) \
    X(signal_clip_level, 39, 0LL, 65535LL, 126LL) \
    X(signal_tolerance, 40, 0LL, 65535LL, 9LL) \
    X(signal_jump, 41, 0LL, 65535LL, 13LL) \
    X(signal_no_noise_samples, 42, 0LL, 65535LL, 0LL) \
    X(signal_span, 43, 0LL, 65535LL, 80LL) \
    X(signal_band, 44, 0LL, 255LL, 3LL) \
    X(signal_sign_threshold, 45, 0LL, 65535LL, 20LL) \
    X(signal_offset, 46, 0LL, 65535LL, 12LL) \
    X(signal_balance, 47, 0LL, 65535LL, 16LL) \
    X(signal_quadrature_error, 48, 0LL, 65535LL, 16LL) \
    X(position_source, 49, 0LL, 2LL, 0LL) \
    X(home_method, 50, -2LL, 37LL, -1LL) \
    X(home_offset, 51, -1000000000LL, 1000000000LL, 0LL) \
    X(drive, 52, 0LL, 2LL, 0LL) \
    X(steps_per_period, 53, -140737488355328LL, 140737488355327LL, 0LL) \
    X(step_high, 54, 0LL, 100000LL, 2000LL) \
    X(step_low, 55, 0LL, 100000LL, 2000LL) \
    X(step_setup, 56, 0LL, 100000LL, 5000LL) \
    X(step_hold, 57, 0LL, 100000LL, 5000LL) \
    X(step_output, 58, 0LL, 2LL, 0LL) \
    X(step_invert, 59, 0LL, 3LL, 0LL) \
    X(step_trim, 60, 0LL, 15LL, 0LL) \
    X(dac_clock, 61, 10000LL, 50000000LL, 1000000LL) \
    X(dac_trim, 62, -32768LL, 32767LL, 0LL) \
    X(fine_kp, 63, 0LL, 16777215LL, 0LL) \
    X(fine_ki, 64, 0LL, 16777215LL, 0LL) \
    X(fine_limit, 65, 0LL, 32767LL, 30000LL) \
    X(fine_reach, 66, 0LL, 65536000LL, 0LL) \
    X(feed_override, 67, 0LL, 65536LL, 65536LL) \
    X(filters, 68, 0LL, 3LL, 0LL) \
    X(filter_1_b0, 69, -2147483648LL, 2147483647LL, 1073741824LL) \
    X(filter_1_b1, 70, -2147483648LL, 2147483647LL, 0LL) \
    X(filter_1_b2, 71, -2147483648LL, 2147483647LL, 0LL) \
    X(filter_1_a1, 72, -2147483648LL, 2147483647LL, 0LL) \
    X(filter_1_a2, 73, -2147483648LL, 2147483647LL, 0LL) \
    X(filter_2_b0, 74, -2147483648LL, 2147483647LL, 1073741824LL) \
    X(filter_2_b1, 75, -2147483648LL, 2147483647LL, 0LL) \
    X(filter_2_b2, 76, -2147483648LL, 2147483647LL, 0LL) \
    X(filter_2_a1, 77, -2147483648LL, 2147483647LL, 0LL) \
    X(filter_2_a2, 78, -2147483648LL, 2147483647LL, 0LL) \
    X(profile, 79, 0LL, 2LL, 0LL) \
    X(stepped_first, 80, 1LL, 65536000000LL, 819200LL) \
    X(stepped_time, 81, 1LL, 400000LL, 80LL) \
    X(stepped_rise_1, 82, 1LL, 65536000000LL, 819200LL) \
    X(stepped_rise_2, 83, 1LL, 65536000000LL, 1638400LL) \
    X(stepped_rise_3, 84, 1LL, 65536000000LL, 3276800LL) \
    X(stepped_border_2, 85, 0LL, 65536LL, 10923LL) \
    X(stepped_border_3, 86, 0LL, 65536LL, 32768LL) \
    X(segment_count, 87, 1LL, 255LL, 120LL) \
    X(segment_length, 88, 1LL, 70368744177664LL, 81920000LL) \
    X(segment_first, 89, -70368744177664LL, 70368744177664LL, 0LL) \
    X(segments, 90, 0LL, 2LL, 0LL) \
    X(fine_kd, 91, 0LL, 16777215LL, 0LL) \
    X(index_gate, 92, 0LL, 4LL, 0LL)

// X(parameter, field of axis.built without which it accepts only 0 and its default)
#define BUS_PARAMETER_NEEDS(X) \
    X(KP, DRIVE) \
    X(KI, DRIVE) \
    X(KD, DRIVE) \
    X(KV, DRIVE) \
    X(KA, DRIVE) \
    X(OUTPUT_LIMIT, DRIVE) \
    X(INTEGRAL_LIMIT, DRIVE) \
    X(DEAD_BAND, DRIVE) \
    X(FOLLOWING_LIMIT, DRIVE) \
    X(OUTLIER_STEP, SINE) \
    X(OUTLIER_HOLD, SINE) \
    X(AMPLITUDE_LOW, MONITOR) \
    X(AMPLITUDE_HIGH, MONITOR) \
    X(DISAGREEMENT_LIMIT, SINE) \
    X(PWM_FREQUENCY, BRIDGE) \
    X(AUTO_CALIBRATION, RECORDER) \
    X(VELOCITY_QUANTUM, VELOCITY) \
    X(SIGNAL_FAULT_MASK, MONITOR) \
    X(SIGNAL_CLIP_LEVEL, MONITOR) \
    X(SIGNAL_TOLERANCE, MONITOR) \
    X(SIGNAL_JUMP, MONITOR) \
    X(SIGNAL_NO_NOISE_SAMPLES, MONITOR) \
    X(SIGNAL_SPAN, MONITOR) \
    X(SIGNAL_BAND, MONITOR) \
    X(SIGNAL_SIGN_THRESHOLD, MONITOR) \
    X(SIGNAL_OFFSET, MONITOR) \
    X(SIGNAL_BALANCE, MONITOR) \
    X(SIGNAL_QUADRATURE_ERROR, MONITOR) \
    X(STEPS_PER_PERIOD, STEPPER) \
    X(STEP_HIGH, STEPPER) \
    X(STEP_LOW, STEPPER) \
    X(STEP_SETUP, STEPPER) \
    X(STEP_HOLD, STEPPER) \
    X(STEP_OUTPUT, STEPPER) \
    X(STEP_INVERT, STEPPER) \
    X(STEP_TRIM, STEPPER) \
    X(DAC_CLOCK, DAC) \
    X(DAC_TRIM, DAC) \
    X(FINE_KP, FINE_STAGE) \
    X(FINE_KI, FINE_STAGE) \
    X(FINE_LIMIT, FINE_STAGE) \
    X(FINE_REACH, FINE_STAGE) \
    X(FILTERS, FILTERS) \
    X(FILTER_1_B0, FILTERS) \
    X(FILTER_1_B1, FILTERS) \
    X(FILTER_1_B2, FILTERS) \
    X(FILTER_1_A1, FILTERS) \
    X(FILTER_1_A2, FILTERS) \
    X(FILTER_2_B0, FILTERS) \
    X(FILTER_2_B1, FILTERS) \
    X(FILTER_2_B2, FILTERS) \
    X(FILTER_2_A1, FILTERS) \
    X(FILTER_2_A2, FILTERS) \
    X(SEGMENTS, SEGMENTS) \
    X(FINE_KD, FINE_STAGE)

// X(parameter, block, register, field), in the order of the addresses
#define BUS_PARAMETER_REGISTERS(X) \
    X(FOLLOWING_LIMIT, AXIS, FOLLOWING_LIMIT, FOLLOWING_LIMIT) \
    X(AMPLITUDE_LOW, AXIS, AMPLITUDE_WINDOW, AMPLITUDE_WINDOW_LOW) \
    X(AMPLITUDE_HIGH, AXIS, AMPLITUDE_WINDOW, AMPLITUDE_WINDOW_HIGH) \
    X(DISAGREEMENT_LIMIT, AXIS, DISAGREEMENT_LIMIT, DISAGREEMENT_LIMIT) \
    X(ENCODER_FAULT_MASK, AXIS, ENCODER_FAULT_MASK, ENCODER_FAULT_MASK) \
    X(INTEGRAL_LIMIT, AXIS, INTEGRAL_LIMIT, INTEGRAL_LIMIT) \
    X(KP, AXIS, KP, KP) \
    X(KI, AXIS, KI, KI) \
    X(KD, AXIS, KD, KD) \
    X(KV, AXIS, KV, KV) \
    X(KA, AXIS, KA, KA) \
    X(OUTPUT_LIMIT, AXIS, OUTPUT_LIMIT, OUTPUT_LIMIT) \
    X(DEAD_BAND, AXIS, DEAD_BAND, DEAD_BAND) \
    X(FEED_OVERRIDE, AXIS, FEED_OVERRIDE, FEED_OVERRIDE) \
    X(SIGNAL_FAULT_MASK, FEEDBACK, SIGNAL_FAULT_MASK, SIGNAL_FAULT_MASK) \
    X(SIGNAL_CLIP_LEVEL, FEEDBACK, LISSAJOUS_LIMITS, LISSAJOUS_LIMITS_CLIP_LEVEL) \
    X(SIGNAL_TOLERANCE, FEEDBACK, LISSAJOUS_LIMITS, LISSAJOUS_LIMITS_TOLERANCE) \
    X(SIGNAL_JUMP, FEEDBACK, JUMP_LIMITS, JUMP_LIMITS_JUMP) \
    X(SIGNAL_NO_NOISE_SAMPLES, FEEDBACK, JUMP_LIMITS, JUMP_LIMITS_NO_NOISE_SAMPLES) \
    X(SIGNAL_SPAN, FEEDBACK, CHANNEL_LIMITS, CHANNEL_LIMITS_SPAN) \
    X(SIGNAL_BAND, FEEDBACK, CHANNEL_LIMITS, CHANNEL_LIMITS_BAND) \
    X(SIGNAL_OFFSET, FEEDBACK, DRIFT_LIMITS, DRIFT_LIMITS_OFFSET) \
    X(SIGNAL_BALANCE, FEEDBACK, DRIFT_LIMITS, DRIFT_LIMITS_BALANCE) \
    X(SIGNAL_QUADRATURE_ERROR, FEEDBACK, QUADRATURE_LIMITS, QUADRATURE_LIMITS_QUADRATURE_ERROR) \
    X(SIGNAL_SIGN_THRESHOLD, FEEDBACK, QUADRATURE_LIMITS, QUADRATURE_LIMITS_SIGN_THRESHOLD) \
    X(VELOCITY_QUANTUM, FEEDBACK, VELOCITY_QUANTUM, VELOCITY_QUANTUM) \
    X(DRIVE, ACTUATOR, DRIVE, DRIVE) \
    X(DAC_TRIM, ACTUATOR, DAC_TRIM, DAC_TRIM) \
    X(FINE_KP, ACTUATOR, FINE_KP, FINE_KP) \
    X(FINE_KI, ACTUATOR, FINE_KI, FINE_KI) \
    X(FINE_LIMIT, ACTUATOR, FINE_LIMIT, FINE_LIMIT) \
    X(FINE_KD, ACTUATOR, FINE_KD, FINE_KD)

// X(number, function), and X(parameter, number of the function that applies it)
#define BUS_PARAMETER_FUNCTIONS(X) \
    X(MOTION, motion) \
    X(SENSING, sensing) \
    X(PWM, pwm) \
    X(WATCHDOG, watchdog) \
    X(SOURCE, source) \
    X(STEPS, steps) \
    X(DAC, dac) \
    X(FILTERS, filters) \
    X(INDEX, index)

#define BUS_PARAMETERS_APPLIED(X) \
    X(VELOCITY, MOTION) \
    X(ACCELERATION, MOTION) \
    X(JERK, MOTION) \
    X(DEGLITCH, SENSING) \
    X(OUTLIER_STEP, SENSING) \
    X(OUTLIER_HOLD, SENSING) \
    X(PWM_FREQUENCY, PWM) \
    X(WATCHDOG_TIME, WATCHDOG) \
    X(DECODER_MODE, SOURCE) \
    X(FILTER_SKIP, SENSING) \
    X(FILTER_TOLERATED, SENSING) \
    X(POSITION_SOURCE, SOURCE) \
    X(STEPS_PER_PERIOD, STEPS) \
    X(STEP_HIGH, STEPS) \
    X(STEP_LOW, STEPS) \
    X(STEP_SETUP, STEPS) \
    X(STEP_HOLD, STEPS) \
    X(STEP_OUTPUT, STEPS) \
    X(STEP_INVERT, STEPS) \
    X(STEP_TRIM, STEPS) \
    X(DAC_CLOCK, DAC) \
    X(FILTERS, FILTERS) \
    X(FILTER_1_B0, FILTERS) \
    X(FILTER_1_B1, FILTERS) \
    X(FILTER_1_B2, FILTERS) \
    X(FILTER_1_A1, FILTERS) \
    X(FILTER_1_A2, FILTERS) \
    X(FILTER_2_B0, FILTERS) \
    X(FILTER_2_B1, FILTERS) \
    X(FILTER_2_B2, FILTERS) \
    X(FILTER_2_A1, FILTERS) \
    X(FILTER_2_A2, FILTERS) \
    X(PROFILE, MOTION) \
    X(INDEX_GATE, INDEX)

enum bus_setting {
    // [0.01 arcsec] turn: it has ended when the remainder by the sensor is not larger than this
    BUS_SETTING_TURN_TOLERANCE = 1,
    // [0.01 arcsec] turn: the first move ends this far below the target; more than the error of the
    // worm
    BUS_SETTING_TURN_ALLOWANCE = 2,
    // [0.01 arcsec] turn: shortest move up before a reading is valid; more than the backlash
    BUS_SETTING_TURN_TAKE_UP = 3,
    BUS_SETTING_TURN_SHARE = 4,    // [1/100] turn: each try moves this share of the remainder
    BUS_SETTING_TURN_TRIES = 5,    // turn: number of tries before it fails
    // turn: how often it may move back from above the target and approach again
    BUS_SETTING_TURN_OVERSHOOTS = 6,
    // [0.001 s] turn: time at rest before a reading; more than the latency of the sensor
    BUS_SETTING_TURN_SETTLE = 7,
    BUS_SETTING_TURN_FRAMES = 8,    // turn: number of frames that are averaged for a reading
    // [0.01 arcsec] turn: largest difference of sensor and steps; more than worm error and backlash
    BUS_SETTING_TURN_DISAGREEMENT = 9,
    // turn: 0 never through angle 0, 1 the shorter direction, 2 always up
    BUS_SETTING_TURN_DIRECTION = 10,
    // periods of axis 0 in one turn of the table; four steps are a period
    BUS_SETTING_PERIODS_PER_TURN = 11,
    // [0.001 s] sensor: it has failed when no good frame has come for this time
    BUS_SETTING_SENSOR_TIMEOUT = 12,
    BUS_SETTING_SENSOR_ZERO = 13,    // [0.01 arcsec] sensor: its reading at angle 0
    BUS_SETTING_READOUT_DECIMALS = 14,    // numeric display: decimals of the position in mm
    // peer port: 0 not in use, 1 legacy (bytes of S4), 2 frames with CRC-32
    BUS_SETTING_PEER_MODE = 15,
    // peer port: 0 this is the main node, 1 the sub-node, which turns its table
    BUS_SETTING_PEER_ROLE = 16,
    // [0.001 s] peer port: in mode legacy, a turn that takes longer has failed
    BUS_SETTING_PEER_TIMEOUT = 17,
    // [1 s] job: longest time from the start keys to the beginning of the cut
    BUS_SETTING_JOB_START_LIMIT = 18,
    BUS_SETTING_JOB_CUT_LIMIT = 19,    // [1 s] job: longest cut
    // [1/100] job: speed of the table, of full; sent to the sub-node with each order, in mode
    // frames
    BUS_SETTING_JOB_SPEED = 20,
};
#define BUS_SETTING_COUNT 20u

// X(name, id, min, max, default): all int64_t, in counts of the wire
#define BUS_SETTINGS(X) \
    X(turn_tolerance, 1, 1LL, 360000LL, 50LL) \
    X(turn_allowance, 2, 0LL, 3600000LL, 6000LL) \
    X(turn_take_up, 3, 1LL, 3600000LL, 6000LL) \
    X(turn_share, 4, 5LL, 95LL, 50LL) \
    X(turn_tries, 5, 1LL, 255LL, 40LL) \
    X(turn_overshoots, 6, 0LL, 255LL, 3LL) \
    X(turn_settle, 7, 0LL, 10000LL, 100LL) \
    X(turn_frames, 8, 1LL, 64LL, 4LL) \
    X(turn_disagreement, 9, 100LL, 16000000LL, 12000LL) \
    X(turn_direction, 10, 0LL, 2LL, 0LL) \
    X(periods_per_turn, 11, 1LL, 2147483647LL, 1800000LL) \
    X(sensor_timeout, 12, 10LL, 10000LL, 200LL) \
    X(sensor_zero, 13, 0LL, 129599999LL, 0LL) \
    X(readout_decimals, 14, 0LL, 6LL, 5LL) \
    X(peer_mode, 15, 0LL, 2LL, 0LL) \
    X(peer_role, 16, 0LL, 1LL, 0LL) \
    X(peer_timeout, 17, 100LL, 3600000LL, 300000LL) \
    X(job_start_limit, 18, 1LL, 3600LL, 30LL) \
    X(job_cut_limit, 19, 1LL, 1000000LL, 14400LL) \
    X(job_speed, 20, 1LL, 100LL, 100LL)

// Of all parameters and settings: it changes with the meaning of a saved number.
#define BUS_VALUES_CRC 0xD2740A3Au

#endif
