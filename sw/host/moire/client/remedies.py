# SPDX-License-Identifier: Apache-2.0
"""What to do about each fault of an axis, and about each cause with which a node refuses a request
or ends a motion.

The names are those of moire.made.bus_tables; the words for what happened are there.
"""

from collections.abc import Iterable

FAULTS = {
    "limit_low": "move the axis off the switch by hand or clear the fault and home it; check "
    "travel_low and the wiring of the switch",
    "limit_high": "move the axis off the switch by hand or clear the fault and home it; check "
    "travel_high and the wiring of the switch",
    "estop": "make the machine safe and release the emergency stop",
    "following_error": "look for what blocks the axis; then check the gains (kp, ki, kd), "
    "velocity, acceleration and following_limit, and that drive and encoder count in the same "
    "direction",
    "encoder": "check the cable of the encoder and its signal; encoder_events and the command "
    "'signal' say what is wrong",
    "bus_watchdog": "keep a client connected while a drive is on, or change watchdog_time; if a "
    "client was connected, check the bus and the load of the computer",
    "drive": "read the fault that the drive itself shows, and check its supply and its motor",
    "cpu": "switch the node off and on; if it happens again, load its bitstream again",
    "profile_underrun": "lower velocity or acceleration; report it, since it should not happen",
    "step_overrun": "lower velocity, or step_high and step_low; check steps_per_period",
    "servo_overrun": "build the node with fewer axes or a faster clock; report it",
    "sample_overrun": "build the node with fewer axes or slower converters; report it",
    "link_watchdog": "keep the master of the real-time link running while a drive is on, or switch "
    "the link off; if the master ran, check the line and the counts of refused packets",
}
CAUSES = {
    "no_such_axis": "ask the node for its axes: GET /api/nodes/{node}, or 'moire find'",
    "out_of_range": "give a value in the range of the parameter: 'moire params list' shows it",
    "out_of_travel": "give a target within travel_low and travel_high, or change these",
    "not_homed": "home the axis",
    "not_enabled": "switch the drive on",
    "faulted": "remove the cause of the fault, then clear it",
    "fault_persists": "remove the cause of the fault first",
    "busy": "stop the axis, or wait until it is at rest",
    "stopped": "begin the motion again when it is safe",
    "no_switch": "check the limit switch, its wiring and home_end",
    "switch_stuck": "check the limit switch, and home_distance",
    "not_settled": "check the gains, settle_window, settle_time and settle_timeout",
    "ended_by_fault": "read the fault, remove its cause, clear it and home the axis if it has no "
    "zero",
    "no_index": "check the reference mark, its wiring and home_distance",
    "not_built": "build the node with the function, or do without it",
    "too_long": "give a nearer target, or stop the axis first",
    "other_client": "wait until the axis is at rest, stop it, or take it over",
    "segments_in_use": "set the parameter segments to off first",
    "wrong_map": "load firmware and bitstream of the same build",
}


def of_faults(names: Iterable[str]) -> str:
    """What to do about these faults, one after the other; empty without any."""
    return "; ".join(FAULTS.get(name, f"find the cause of {name}") for name in names)
