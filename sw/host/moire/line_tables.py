# SPDX-License-Identifier: Apache-2.0
"""Made by tables/line.py from tables/line.toml: do not edit."""
from fractions import Fraction
from typing import NamedTuple


class Operation(NamedTuple):
    name: str
    code: int
    text: str
    request: tuple          # (field, type) after sequence and operation
    reply: tuple            # (field, type) after sequence, operation and cause


class Parameter(NamedTuple):
    name: str
    id: int
    unit: str
    lsb: Fraction           # value of one count of the wire, in unit
    min: int                # counts of the wire, as are max and default
    max: int
    default: int
    text: str


PROTOCOL_CRC = 0x478DAD3C
VERSION = 1
LONGEST_BODY = 64

# code: (name, words)
CAUSES = {
    0: ("ok", "done"),
    1: ("unknown_operation", "the node does not know this command"),
    2: ("wrong_length", "the command has the wrong length"),
    3: ("no_such_axis", "the node has no axis of this number"),
    4: ("unknown_parameter", "the node has no parameter of this number"),
    5: ("out_of_range", "the value is outside what this parameter allows"),
    6: ("out_of_travel", "the target is outside the travel"),
    7: ("not_homed", "the axis has no zero yet: home it first"),
    8: ("not_enabled", "the drive is off: enable it first"),
    9: ("faulted", "a fault is latched: remove its cause and reset it first"),
    10: ("fault_stands", "the cause of the fault still stands"),
    11: ("busy", "the axis is moving: stop it or wait"),
    12: ("wrong_map", "firmware and hardware were not made for each other (register maps differ)"),
    13: ("no_such_register", "the node has no register at this address"),
    14: ("stopped", "stopped by the host"),
    15: ("no_switch", "no limit switch was found within the travel"),
    16: ("switch_stuck", "the limit switch did not open within the home distance"),
    17: ("not_settled", "the target was not reached within the settling time"),
    18: ("ended_by_fault", "a fault ended the motion"),
    19: ("running", "the motion is under way"),
    20: ("never", "no motion was asked for yet"),
}

# bit: (name, words)
FAULTS = {
    0: ("limit_low", "limit switch at the low end"),
    1: ("limit_high", "limit switch at the high end"),
    2: ("estop", "emergency stop"),
    3: ("following_error", "following error too large"),
    4: ("encoder", "encoder fault"),
    5: ("line_watchdog", "the line fell silent"),
    6: ("drive", "the drive reports a fault"),
    7: ("cpu", "the soft core stopped"),
    8: ("profile_underrun", "the profile ran out of segments"),
}

# bit: (name, words)
ENCODER_EVENTS = {
    0: ("illegal_edge", "both quadrature levels changed at once"),
    1: ("overspeed", "the phase jumped: too fast, or the signal is broken"),
    2: ("amplitude_low", "signal too small"),
    3: ("amplitude_high", "signal too large"),
    4: ("disagreement", "interpolated position and quadrature count differ"),
}

# code: (name, words)
STATES = {
    0: ("off", "drive off"),
    1: ("holding", "holding position"),
    2: ("homing", "homing"),
    3: ("moving", "moving"),
    4: ("settling", "settling"),
    5: ("stopping", "stopping"),
    6: ("faulted", "faulted"),
}

# bit: (name, words)
FLAGS = {
    0: ("enabled", "drive on"),
    1: ("homed", "zero known"),
    2: ("limit_low", "switch at the low end pressed"),
    3: ("limit_high", "switch at the high end pressed"),
    4: ("estop", "emergency stop pressed"),
    5: ("settled", "inside the settling window"),
    6: ("saturated", "command at its limit"),
}

OPERATIONS = {operation.name: operation for operation in (
    Operation("identify", 1, "who is there, and what was it built from",
              (),
              (("map_crc", "u32"), ("protocol_crc", "u32"), ("version", "u16"), ("address", "u8"),
               ("axes", "u8"), ("clk_hz", "u32"), ("tick_hz", "u32"), ("sample_hz", "u32"),)),
    Operation("status", 2, "state, position and faults of an axis; ended is the cause of the last motion",
              (("axis", "u8"),),
              (("state", "u8"), ("ended", "u8"), ("flags", "u8"), ("encoder_events", "u8"),
               ("faults", "u16"), ("first_fault", "u16"), ("position", "i64"), ("target", "i64"),
               ("velocity", "i32"), ("command", "i16"), ("counts", "i64"),)),
    Operation("enable", 3, "drive on (1) or off (0)",
              (("axis", "u8"), ("on", "u8"),),
              ()),
    Operation("home", 4, "find the zero: to the limit switch, away from it, nearest phase zero",
              (("axis", "u8"),),
              ()),
    Operation("move", 5, "go to a position",
              (("axis", "u8"), ("target", "i64"),),
              (("duration_ticks", "u32"),)),
    Operation("stop", 6, "controlled stop; the drive stays on",
              (("axis", "u8"),),
              ()),
    Operation("reset_faults", 7, "clear latched faults whose cause is gone; the drive stays off",
              (("axis", "u8"),),
              ()),
    Operation("get_parameter", 8, "read a parameter",
              (("axis", "u8"), ("parameter", "u8"),),
              (("value", "i64"),)),
    Operation("set_parameter", 9, "write a parameter; not while the axis moves",
              (("axis", "u8"), ("parameter", "u8"), ("value", "i64"),),
              ()),
    Operation("counters", 10, "what happened on the line",
              (),
              (("frames_good", "u32"), ("frames_bad", "u32"), ("framing_errors", "u32"), ("start_glitches", "u32"),
               ("overruns", "u32"), ("repeated", "u32"), ("refused", "u32"),)),
    Operation("encoder", 11, "the sensor as it is now, and where the last homing met its phase zero",
              (("axis", "u8"),),
              (("sin", "i16"), ("cos", "i16"), ("phase", "u16"), ("amplitude", "u16"),
               ("quadrature_count", "i32"), ("rejected_pulses", "u32"), ("rejected_samples", "u32"), ("home_phase", "i32"),
               ("fault_position", "i64"),)),
    Operation("read_register", 12, "one word of the register map, by byte address",
              (("address", "u16"),),
              (("value", "u32"),)),
)}

PARAMETERS = {parameter.name: parameter for parameter in (
    Parameter("period", 1, "pm", Fraction(1, 1),
              1, 4000000000, 800000,
              "length of one signal period"),
    Parameter("counts_per_period", 2, "", Fraction(1, 1),
              1, 65536, 160,
              "subdivision N of the read-out"),
    Parameter("travel_low", 3, "period", Fraction(1, 65536),
              -140737488355328, 140737488355327, -65536000,
              "lowest target"),
    Parameter("travel_high", 4, "period", Fraction(1, 65536),
              -140737488355328, 140737488355327, 9797632000,
              "highest target"),
    Parameter("velocity", 5, "period/s", Fraction(1, 1),
              1, 1000000, 6000,
              "top speed of a move"),
    Parameter("acceleration", 6, "period/s2", Fraction(1, 1),
              1, 100000000, 125000,
              "largest acceleration"),
    Parameter("jerk", 7, "period/s3", Fraction(1, 1),
              1, 2000000000, 12500000,
              "largest jerk"),
    Parameter("home_velocity", 8, "period/s", Fraction(1, 1),
              1, 1000000, 5000,
              "speed towards the limit switch"),
    Parameter("home_creep", 9, "period/s", Fraction(1, 1),
              1, 1000000, 125,
              "speed while the switch edge is sought"),
    Parameter("home_distance", 10, "period", Fraction(1, 65536),
              65536, 1000000000, 81920000,
              "from the switch edge to the zero"),
    Parameter("home_end", 11, "", Fraction(1, 1),
              0, 1, 0,
              "switch that homing uses: 0 low end, 1 high end"),
    Parameter("settle_window", 12, "period", Fraction(1, 65536),
              1, 65536000, 1638,
              "a move has ended when the error stays inside this"),
    Parameter("settle_time", 13, "s", Fraction(1, 1000),
              1, 10000, 20,
              "for this long"),
    Parameter("settle_timeout", 14, "s", Fraction(1, 1000),
              1, 60000, 2000,
              "or is given up after this"),
    Parameter("kp", 15, "", Fraction(1, 65536),
              0, 16777215, 1600,
              "servo: proportional gain, see axis_registers.kp"),
    Parameter("ki", 16, "", Fraction(1, 16777216),
              0, 16777215, 16000,
              "servo: integral gain per tick"),
    Parameter("kd", 17, "", Fraction(1, 65536),
              0, 16777215, 20000,
              "servo: derivative gain"),
    Parameter("kv", 18, "", Fraction(1, 65536),
              0, 16777215, 4942,
              "servo: velocity feed-forward"),
    Parameter("ka", 19, "", Fraction(1, 256),
              0, 16777215, 643,
              "servo: acceleration feed-forward"),
    Parameter("output_limit", 20, "", Fraction(1, 32768),
              0, 32767, 32000,
              "servo: largest command, of full scale"),
    Parameter("integral_limit", 21, "", Fraction(1, 32768),
              0, 32767, 20000,
              "servo: largest integral term, of full scale"),
    Parameter("dead_band", 22, "period", Fraction(1, 65536),
              0, 65535, 400,
              "servo: the integrator rests inside this at standstill"),
    Parameter("following_limit", 23, "period", Fraction(1, 65536),
              1, 2147483647, 4096000,
              "guard: largest following error"),
    Parameter("deglitch", 24, "s", Fraction(1, 1000000000),
              0, 1000000, 10000,
              "deglitcher: a level must be stable this long"),
    Parameter("spike_step", 25, "", Fraction(1, 1),
              0, 255, 0,
              "limit filter 1: largest step between samples; 0 off"),
    Parameter("spike_hold", 26, "", Fraction(1, 1),
              0, 255, 3,
              "limit filter 1: samples in a row it may hold back"),
    Parameter("amplitude_low", 27, "", Fraction(1, 1),
              0, 65535, 32,
              "encoder: smallest good amplitude, converter counts"),
    Parameter("amplitude_high", 28, "", Fraction(1, 1),
              0, 65535, 160,
              "encoder: largest good amplitude, converter counts"),
    Parameter("disagreement_limit", 29, "period", Fraction(1, 65536),
              0, 1048575, 49152,
              "encoder: interpolated position against quadrature count; 0 off"),
    Parameter("encoder_fault_mask", 30, "", Fraction(1, 1),
              0, 31, 30,
              "encoder: which events are a fault (bits of encoder_event)"),
    Parameter("pwm_frequency", 31, "Hz", Fraction(1, 1),
              1000, 200000, 20000,
              "drive: PWM frequency"),
    Parameter("watchdog_time", 32, "s", Fraction(1, 1000),
              10, 65535, 500,
              "guard: longest silence of the line while a drive is on (all axes)"),
)}
