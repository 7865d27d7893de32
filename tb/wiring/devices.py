# SPDX-License-Identifier: Apache-2.0
"""What is connected to the pins of the peripherals: an EEPROM, a keyboard, a machine."""

from tb.peripheral.eeprom_24aa128 import Eeprom
from tb.peripheral.ps2_lines import Host, Keyboard


class Devices:
    """The devices of a bench. They take part while they are in `active`."""

    def connect(self, clk_hz):
        self.eeprom, self.keyboard = Eeprom(write_clk=clk_hz // 200), Keyboard(clk_hz)
        self.machine, self.stuck = Host(clk_hz), (0, 0)
        self.active = set()

    def clk(self, cycles=1):
        """So many cycles, with the active devices."""
        if not self.active:
            self.run(cycles)
            return
        for _ in range(cycles):
            self.run(1)
            if "eeprom" in self.active:
                e = self.eeprom
                pulls = self.get("i2c_scl_low"), self.get("i2c_sda_low")
                devices = (e.scl_low > 0, e.sda_low)
                lines = [
                    int(not (own or device or stuck))
                    for own, device, stuck in zip(pulls, devices, self.stuck)
                ]
                e.step(*lines)
                self.set(i2c_scl=lines[0], i2c_sda=lines[1])
            for device, name in ((self.keyboard, "keyboard"), (self.machine, "edm")):
                if name in self.active:
                    device.step(
                        1 - (self.get(f"{name}_clock_low") | device.clock_low),
                        1 - (self.get(f"{name}_data_low") | device.data_low),
                    )
                    self.set(**{f"{name}_clock": device.clock, f"{name}_data": device.data})
