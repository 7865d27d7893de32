# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/engine_outputs.sv in integers: strobes(...) and pending(...) are what it
shows in this cycle, clk(...) then advances one cycle; `levels` is what it holds.
"""

from tables.microcode.numbers import FLAGS, GIVEN

MOVING, ARMED = (1 << FLAGS.index(name) + 1 for name in ("moving", "armed"))


def signed(value, bits):
    return (value + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


class EngineOutputs:
    def __init__(self):
        self.reset()

    def reset(self):
        names = "moving armed target line_up line_down velocity error saturated".split()
        self.levels = dict.fromkeys(names, 0) | dict(queue_free=16)
        self.unshown = False
        self.moves = 0  # the sign of the target's velocity

    def pending(self, waits):
        return int(waits or self.unshown)

    @staticmethod
    def strobes(valid=0, kind=0, **_):
        name = GIVEN[kind] if valid else ""
        strobes = dict(error="error_valid", command="command_valid")
        strobes |= dict(underrun="underrun")
        return {port: int(name == given) for given, port in strobes.items()}

    def clk(self, valid=0, kind=0, result=0, flag=0, waits=0, line_start=0, rst=0):
        name, levels = GIVEN[kind] if valid else "", self.levels
        self.unshown = bool(waits or (self.unshown and name != "state"))
        if line_start:
            levels |= dict(line_up=int(self.moves > 0), line_down=int(self.moves < 0))
        if name == "state":
            queued = result >> 20 & 31
            levels |= dict(moving=int(bool(result & MOVING)), armed=int(bool(result & ARMED)))
            levels |= dict(queue_free=(16 - queued) % 32)
        elif name == "target_velocity":
            self.moves = result
        elif name == "target":
            levels |= dict(target=result)
        elif name in ("velocity", "error"):
            levels |= {name: signed(result, 32)}
        elif name == "command":
            levels |= dict(saturated=flag)
        if rst:
            self.reset()
