# SPDX-License-Identifier: Apache-2.0
"""What to check, and what to do, about each fault of an axis, each event of its encoder, each cause
with which a node refuses a request or ends a motion, and each reason of the calibration.

The names are those of moire.made.bus_tables; the words for what happened are there. docs/faults.md
is made from both. A parameter or a command that helps is named in the text itself.
"""

import re
from collections.abc import Iterable, Mapping

from moire.made import bus_tables

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
ENCODER_EVENTS = {
    "illegal_edge": "look at A and B with an oscilloscope: noise, a missing termination or a head "
    "out of adjustment; deglitch and filter_tolerated suppress short pulses",
    "overspeed": "lower velocity: at least two samples are needed in a period; check the cable for "
    "noise",
    "amplitude_low": "clean scale and head, check gap, alignment and supply of the head; "
    "amplitude_low is the limit, and 'moire signal' shows the present amplitude",
    "amplitude_high": "lower the gain or the light of the head; amplitude_high is the limit",
    "disagreement": "check the comparators and their thresholds, and the levels of sine and "
    "cosine; disagreement_limit is the limit",
    "pulse_too_short": "check the pulses of the source; deglitch is the shortest one that counts",
}
CAUSES = {
    "unknown_operation": "load firmware and host package of the same build",
    "wrong_length": "load firmware and host package of the same build",
    "no_such_axis": "ask the node for its axes: GET /api/nodes/{node}, or 'moire find'",
    "unknown_parameter": "load firmware and host package of the same build",
    "out_of_range": "give a value in the range of the parameter: 'moire params list' shows it",
    "out_of_travel": "give a target within travel_low and travel_high, or change these",
    "not_homed": "home the axis",
    "not_enabled": "switch the drive on",
    "faulted": "remove the cause of the fault, then clear it",
    "fault_persists": "remove the cause of the fault first",
    "busy": "stop the axis, or wait until it is at rest",
    "wrong_map": "load firmware and bitstream of the same build",
    "no_such_register": "look the address up in docs/registers.md; blocks that were not built have "
    "none",
    "stopped": "begin the motion again when it is safe",
    "no_switch": "check the limit switch, its wiring and home_end",
    "switch_stuck": "check the limit switch, and home_distance",
    "not_settled": "check the gains, settle_window, settle_time and settle_timeout",
    "ended_by_fault": "read the fault, remove its cause, clear it and home the axis if it has no "
    "zero",
    "no_index": "check the reference mark, its wiring, home_distance and index_gate",
    "not_prepared": "prepare the motion of each axis before the common start",
    "not_built": "build the node with the function, or do without it",
    "too_long": "give a nearer target, or stop the axis first",
    "stepped_profile_invalid": "make stepped_first lower than velocity, and stepped_border_2 lower "
    "than stepped_border_3; larger increments make fewer steps",
    "no_segments": "load a segment table: 'moire segments'",
    "segments_in_use": "set the parameter segments to off first",
    "other_client": "wait until the axis is at rest, stop it, or take it over",
    "sensor_timed_out": "check power, cable and baud rate of the angle sensor",
    "sensor_stuck": "check that the angle sensor turns with the table",
    "stiction": "check the clamp and the current of the motor; lower velocity or acceleration",
    "wrong_sign": "reverse the sign of steps_per_period",
    "not_converged": "look for slip and vibration; widen turn_tolerance, or raise turn_tries",
    "sensor_disagrees": "check the coupling of the sensor, and steps_per_period",
    "peer_silent": "check the cable between the nodes, peer_mode and peer_role",
    "no_station": "write the same station list to both nodes",
    "peer_off": "set peer_mode and peer_role",
    "peer_restarted": "check the supply of the other node, then start the job again",
    "eeprom_missing": "check wiring and address of the EEPROM",
    "eeprom_failed": "write again; if it fails again, replace the EEPROM",
    "eeprom_busy": "wait a moment and ask again",
    "no_job": "write a station list",
    "job_damaged": "write the station list again",
    "job_incomplete": "write all stations of the list, in order",
    "no_stations": "write at least one station",
    "too_many_stations": "write at most 360 stations",
    "angle_out_of_turn": "give angles from 0 to below 360 degrees",
    "angles_not_ascending": "sort the angles of the list",
    "job_active": "stop the job first",
    "not_now": "'moire job status' shows what the job expects",
    "edm_busy": "wait until the EDM is idle",
    "edm_alarm": "clear the alarm at the EDM",
    "keys_not_taken": "check the cable to the keyboard input of the EDM",
    "cut_not_started": "check that the EDM is ready; job_start_limit is the limit",
    "cut_not_ended": "check the EDM; job_cut_limit is the limit",
    "power_lost": "check the workpiece, then continue or begin again",
    "paused_by_operator": "continue the job at the panel, or with 'moire job resume'",
    "key_without_function": "use another key; docs/job.md lists them",
    "table_position_unknown": "turn the table to a station first",
    "job_changed": "write the list of the job again, or stop the job",
    "no_stream": "begin a stream; if one has ended, the status says how",
    "queue_full": "send the set-point again a little later",
    "set_point_late": "send further ahead, or allow a larger late_limit; check the load of the "
    "computer and the bus",
    "set_point_limits": "make the path slower, or raise velocity and acceleration",
    "check_sub_node": "read the fault of the other node with --address, and clear it there",
    "nothing_saved": "'moire params save-to-node' saves the values that are in force",
    "saved_damaged": "save the values again",
    "saved_other_build": "load the parameters from a file and save them again",
    "saved_refused": "compare with a file ('moire params diff'), mend and save again",
    "saved_not_read": "check the EEPROM, then switch the node off and on",
    "firmware_too_long": "build a smaller image, or a node with more memory",
    "firmware_of_other_node": "build the firmware for the machine file of this node",
    "firmware_damaged": "send the firmware again",
    "firmware_on_trial": "let 'moire update' end, or switch the node off and on",
    "drive_on": "switch all drives of the node off",
    "flash_failed": "switch the node off and on, and try again; then suspect the flash",
}
CALIBRATION_REASONS = {
    "frozen": "'moire calibrate' starts it again",
    "standstill": "move the axis during the calibration",
    "partial_circle": "move over several signal periods",
    "amplitude": "bring the amplitude between amplitude_low and amplitude_high first",
    "distorted": "align the head, adjust offsets and gains in the front end; then calibrate",
    "too_fast": "move more slowly",
    "unsteady": "move at constant speed; tune the servo first",
    "one_speed": "move at several speeds, as 'moire calibrate' does",
    "vibration": "calibrate at another speed, or remove the vibration; a longer pass averages it",
}
TABLES: Mapping[str, tuple[Mapping[str, str], Mapping[int, tuple[str, str]]]] = {
    "fault": (FAULTS, bus_tables.FAULTS),
    "event of the encoder": (ENCODER_EVENTS, bus_tables.ENCODER_EVENTS),
    "cause": (CAUSES, bus_tables.CAUSES),
    "reason of the calibration": (CALIBRATION_REASONS, bus_tables.CALIBRATION_REASONS),
}
HARMLESS = ("ok", "running", "no_motion_yet", "calibrating")  # nothing is to be done


def explained(name: str) -> list[tuple[str, str, str]]:
    """(what it is, meaning, what to do) of a name, in each table that has it."""
    return [
        (what, dict(words.values())[name], remedies[name])
        for what, (remedies, words) in TABLES.items()
        if name in remedies
    ]


def parameters_in(text: str) -> list[str]:
    """The parameters that a text names, in its order."""
    return list(dict.fromkeys(word for word in re.findall(r"\w+", text) if word in NAMED))


# a parameter whose name is also a plain word is none in a text
PLAIN_WORDS = ("drive", "period", "profile", "filters", "segments", "jerk")
NAMED = (bus_tables.PARAMETERS.keys() | bus_tables.SETTINGS.keys()) - set(PLAIN_WORDS)


def of_faults(names: Iterable[str]) -> str:
    """What to do about these faults, one after the other; empty without any."""
    return "; ".join(FAULTS.get(name, f"find the cause of {name}") for name in names)
