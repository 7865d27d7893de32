# SPDX-License-Identifier: Apache-2.0
"""The commands of `moire`. A module here adds its commands to the parser when it is imported, which
the parser does when a command is used: a call of one command does not wait for all of them.
"""

SECTIONS = {  # of the help: every command, and the module of this package that makes it
    "Nodes": {
        "ports": "ports",
        "find": "nodes",
        "built": "built",
        "counters": "nodes",
        "baud": "nodes",
        "update": "update",
        "selftest": "fault",
        "register": "register",
    },
    "Drives and motion": {
        "status": "axis",
        "enable": "axis",
        "disable": "axis",
        "home": "motion",
        "move": "motion",
        "stream": "stream",
        "finish": "motion",
        "stop": "axis",
        "pause": "motion",
        "resume": "motion",
        "override": "motion",
        "prepare": "motion",
        "start": "motion",
        "wait": "axis",
        "watch": "watch",
        "drive": "drive",
    },
    "Faults": {"fault": "fault", "reset": "axis"},
    "Parameters and tuning": {
        "params": "params",
        "machine": "machine",
        "tune": "tune",
        "fine": "fine",
        "scope": "scope",
    },
    "Sensor": {
        "encoder": "sensor",
        "signal": "sensor",
        "calibrate": "calibrate",
        "commission": "calibrate",
        "correction": "correction",
        "segments": "segments",
        "index": "index",
    },
    "Events": {"capture": "capture", "compare": "compare"},
    "Stations and rings": {
        "turn": "turn",
        "settings": "settings",
        "job": "job",
        "relay": "relay",
    },
    "Files, shell and servers": {
        "run": "script",
        "shell": "script",
        "replay": "replay",
        "serve": "serve",
        "twin": "twin",
        "study": "study",
    },
}
MODULES = {name: module for names in SECTIONS.values() for name, module in names.items()}
