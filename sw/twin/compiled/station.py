# SPDX-License-Identifier: Apache-2.0
"""A main node of S4 without hardware: the compiled firmware, with its devices behind the registers
of the block `peripherals`. On PS/2 are the wire-EDM machine and a person at its keyboard, on the
peer port a sub-node.
"""

import random
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.station_devices import (
    Display,
    Edm,
    Eeprom,
    I2cBus,
    Keypad,
)
from twin.compiled.sub_node import SubNode
from twin.compiled.tables import CAUSE, CLK_HZ, DEFINES, TABLE

JOB_STATE: dict[int, str] = {code: name for name, (code, _) in TABLE["job_state"].items()}
JOB_ACTION = {name: code for name, (code, _) in TABLE["job_action"].items()}
JOB_FLAG = {name: 1 << bit for name, (bit, _) in TABLE["job_flag"].items()}
SETTING = {name: setting["id"] for name, setting in TABLE["setting"].items()}
TURN = 129_600_000  # 0.01 arcsec
WRITING = 2  # a store_state


class Station(CompiledNode):
    """The node, powered up. `absent` names the devices that are missing: eeprom, keypad, display.
    `peripherals_built` is the register peripherals.built, `seed` is that of the damage by power
    cuts.
    """

    CLK_HZ, POLL_CLK = CLK_HZ, CLK_HZ // 2000

    def __init__(
        self, absent: Sequence[str] = (), peripherals_built: int = 63, seed: int = 0
    ) -> None:
        self.source = random.Random(seed)
        self.eeprom, self.keypad, self.display, self.edm, self.bus = (
            Eeprom(),
            Keypad(),
            Display(),
            Edm(),
            I2cBus(),
        )
        self.sub_node: SubNode | None = None
        self.peripherals_built = peripherals_built
        self.peer_received: deque[int] = deque()
        self.bus.devices = {
            address: device
            for name, address, device in (
                ("eeprom", 0x50, self.eeprom),
                ("keypad", 0x34, self.keypad),
                ("display", 0x27, self.display),
            )
            if name not in absent
        }
        super().__init__(Axis(), image="station")

    def power_cut(self) -> bool:
        """Cut the power of the node and of what it supplies; it has power again at once. Returns
        whether a page of the EEPROM was being written.
        """
        self.bus.work(self.clk)
        writing = self.eeprom.power_cut(self.clk, self.source)
        self.keypad.power_cut()
        self.display.power_cut(self.clk)
        self.edm.power_cut()
        self.bus.power_cut()
        self.peer_received.clear()
        self.firmware.firmware_start()
        return writing

    def read(self, offset: int) -> int:
        """A register, as the firmware reads it."""
        d, at = DEFINES, offset - DEFINES["PERIPHERALS_BASE"]
        if not 0 <= at < 0x100:
            return super().read(offset)
        if at == d["PERIPHERALS_BUILT"]:
            return self.peripherals_built
        if at == d["PERIPHERALS_I2C_ANSWER"]:
            return self.bus.take(self.clk)
        if at == d["PERIPHERALS_I2C_STATE"]:
            return self.bus.state(self.clk)
        if at == d["PERIPHERALS_PS2_STATE"]:
            return (
                32 - len(self.edm.queue)
                | d["PERIPHERALS_PS2_STATE_INJECTING_MASK"] * self.edm.injecting
            )
        if at == d["PERIPHERALS_PS2_TYPED"]:
            return self.edm.typed
        if at == d["PERIPHERALS_EDM_STATUS"]:
            return self.edm.inputs | self.edm.edges
        if at == d["PERIPHERALS_PEER_RECEIVE"]:
            return (
                self.peer_received.popleft() | d["PERIPHERALS_PEER_RECEIVE_PRESENT_MASK"]
                if self.peer_received
                else 0
            )
        if at == d["PERIPHERALS_PEER_STATE"]:
            return 64
        return self.word.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        """Write a register, as the firmware does."""
        d, at = DEFINES, offset - DEFINES["PERIPHERALS_BASE"]
        if not 0 <= at < 0x100:
            super().write(offset, value)
        elif at == d["PERIPHERALS_I2C"]:
            self.bus.command(self.clk, value)
        elif at == d["PERIPHERALS_PS2_STATE"]:
            if value & d["PERIPHERALS_PS2_STATE_DROP_MASK"]:
                self.edm.take_back()
        elif at == d["PERIPHERALS_PS2_TYPED"]:
            self.edm.typed = 0
        elif at == d["PERIPHERALS_PS2_INJECT"]:
            self.edm.queue.append((value & 0xFF, value >> 8 & 1))
        elif at == d["PERIPHERALS_EDM_STATUS"]:
            self.edm.edges &= ~value
        elif at == d["PERIPHERALS_PEER_TRANSMIT"]:
            if self.sub_node:
                self.sub_node.receive(self.clk, value)
        else:
            self.word[offset] = value

    def run(self, ms: float, until: Callable[[], object] | None = None) -> bool:
        """Run for `ms`, with two polls of the firmware a millisecond. Stops early and returns True
        once `until` is true.
        """
        for _ in range(int(ms * 2)):
            self.clk += self.POLL_CLK
            self.edm.work(self.clk)
            if self.sub_node:
                self.peer_received.extend(self.sub_node.work(self.clk))
            self.poll()
            if until and until():
                return True
        return False

    def job(self) -> dict[str, Any]:
        """The reply to `job`, with the names of state, cause, actions, flags and faults."""
        reported = self.ask("job")
        return {
            **reported,
            "state": JOB_STATE[reported["state"]],
            "cause": CAUSE[reported["cause"]],
            "answers": {
                name for name, code in JOB_ACTION.items() if reported["answers"] >> code & 1
            },
            "flags": {name for name, bit in JOB_FLAG.items() if reported["flags"] & bit},
            "table_faults": {
                name
                for name, (bit, _) in TABLE["fault"].items()
                if reported["table_faults"] >> bit & 1
            },
        }

    def do(self, action: str) -> str:
        """Do a job_action; returns the cause."""
        return self.request("job_do", action=JOB_ACTION[action])[0]

    def setting(self, **values: int) -> None:
        """Set settings by their names, in their LSB."""
        for name, value in values.items():
            self.ask("set_setting", setting=SETTING[name], value=value)

    def until(self, *states: str, ms: float = 60_000) -> dict[str, Any]:
        """Run until the job is in one of the states; returns its report. Fails after `ms`."""
        codes = {code for code, name in JOB_STATE.items() if name in states}
        assert self.run(ms, until=lambda: self.firmware.job_state() in codes), (self.job(), states)
        return self.job()

    def ready(self) -> dict[str, Any]:
        """Run until the EEPROM is loaded; returns the report of the job."""
        return self.until("idle", "paused", "unsure", "finished")

    def load(self, angles: Iterable[int]) -> str:
        """Save a station list, in 0.01 arcsec; returns the cause with which that ended."""
        self.ask("job_begin")
        for station, angle in enumerate(angles):
            self.ask("job_add", station=station, angle=angle)
        self.ask("job_save")
        return self.saved()

    def saved(self) -> str:
        """Run until nothing is being written; returns the cause with which that ended."""
        assert self.run(60_000, until=lambda: self.firmware.store_state() != WRITING)
        return CAUSE[self.ask("job_stations")["ended"]]

    def save_settings(self, action: str = "save") -> str:
        """Do a save_action; returns the cause with which that ended."""
        self.ask("save_settings", action=TABLE["save_action"][action][0])
        assert self.run(60_000, until=lambda: self.firmware.store_state() != WRITING)
        return CAUSE[self.ask("saved_settings")["cause"]]

    def saved_settings(self) -> dict[str, Any]:
        """The reply to `saved_settings`, with the name of the cause."""
        reported = self.ask("saved_settings")
        return {**reported, "cause": CAUSE[reported["cause"]]}

    def station_list(self) -> list[int]:
        """The angles of the list in force, 0.01 arcsec."""
        return [
            self.ask("job_angle", station=n)["angle"]
            for n in range(self.ask("job_stations")["stations"])
        ]

    def press(self, *keys: str | int) -> None:
        """Press keys one after the other."""
        for key in keys:
            self.keypad.press(key)
            self.run(60)

    def shown(self) -> list[str]:
        """The lines of the display after a refresh."""
        self.run(400)
        return [line.rstrip() for line in self.display.lines()]
