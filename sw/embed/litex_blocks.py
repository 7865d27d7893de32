# SPDX-License-Identifier: Apache-2.0
"""Blocks of Moire as LiteX modules: an axis on the SoC's Wishbone bus, a whole node with CSRs.

    soc.axis = MoireAxis(platform, soc.sys_clk_freq, platform.request("axis"))
    soc.bus.add_slave("axis", soc.axis.bus, SoCRegion(origin=0x9000_0000, size=MAP_BYTES,
                                                      cached=False))
    soc.node = MoireNode(platform, soc.sys_clk_freq, platform.request("node"), FIRMWARE="f.hex")

The pads have the names of the ports of sw/embed/examples/axis_on_wishbone.sv and of rtl/node.sv. An
input without a pad is an error, unless `idle` has the level that it keeps: {"probe": 0}. Parameters
of the Verilog are keyword arguments. Ports, widths and files come from the sources.
"""

from collections.abc import Mapping
from typing import Any

from litex.gen import LiteXModule
from litex.soc.interconnect import wishbone
from litex.soc.interconnect.csr import CSRField, CSRStatus, CSRStorage
from migen import ClockSignal, Constant, Instance, ResetSignal, Signal

from embed import design
from embed.design import DesignError

MAP_BYTES = 0x1_0000  # of the register map of an axis
OWN = ("clk", "rst")  # of the domain `sys`


def of_32_bits(value: int | str) -> Any:
    """A parameter as the Verilog declares it; LiteX writes a number with as few bits as it has."""
    return Constant(value, (32, True)) if isinstance(value, int) else value


class Block(LiteXModule):
    """An instance of a module of rtl/ or of an example. Each port but clk and rst is a signal of
    the same name in `ports`; the files of the module are added to the platform.
    """

    def __init__(self, platform: Any, module: str, parameters: Mapping[str, int | str]) -> None:
        widths = design.widths(module, parameters)
        for file in design.files(module):
            platform.add_source(str(file))
        self.module = module
        self.ports: dict[str, Any] = {
            name: Signal(width, name=f"{module}_{name}")
            for name, width in widths.items()
            if name not in OWN
        }
        self.hold = Signal()  # resets the instance, beside the reset of the domain
        directions = {name: port.direction[0] for name, port in design.ports(module).items()}
        self.specials += Instance(
            module,
            **{f"p_{name}": of_32_bits(value) for name, value in parameters.items()},
            i_clk=ClockSignal("sys"),
            i_rst=ResetSignal("sys") | self.hold,
            **{f"{directions[name]}_{name}": signal for name, signal in self.ports.items()},
        )

    def connect(self, pads: Any, idle: Mapping[str, int], inside: tuple[str, ...] = ()) -> None:
        """Connect the ports to pads of the same names, but for those that are used inside."""
        for name in idle:
            if name not in self.ports:
                raise DesignError(f"{self.module} has no port {name}")
        for name, port in design.ports(self.module).items():
            if name in OWN or name in inside:
                continue
            signal, pad = self.ports[name], getattr(pads, name, None)
            if pad is not None and len(pad) != len(signal):
                raise DesignError(
                    f"port {name} of {self.module} has {len(signal)} bits, its pad {len(pad)}"
                )
            if port.direction == "output":
                self.comb += [] if pad is None else [pad.eq(signal)]
            elif pad is not None:
                self.comb += signal.eq(pad)
            elif name in idle:
                self.comb += signal.eq(idle[name])
            else:
                raise DesignError(f"the input {name} of {self.module} has no pad: {port.meaning}")


class MoireAxis(Block):
    """One axis with its motion engine, for the processor of the SoC; `bus` is its Wishbone device
    with the registers of docs/registers.md. CSR `state`: the drive is on.
    """

    def __init__(
        self,
        platform: Any,
        clk_hz: float,
        pads: Any,
        idle: Mapping[str, int] | None = None,
        **parameters: int,
    ) -> None:
        super().__init__(platform, "axis_on_wishbone", {"CLK_HZ": int(clk_hz), **parameters})
        self.bus = wishbone.Interface(data_width=32, adr_width=30, addressing="word")
        inputs, outputs = ("cyc", "stb", "we", "sel", "dat_w"), ("dat_r", "ack", "err")
        self.comb += [self.ports[f"wb_{name}"].eq(getattr(self.bus, name)) for name in inputs]
        self.comb += [getattr(self.bus, name).eq(self.ports[f"wb_{name}"]) for name in outputs]
        self.comb += self.ports["wb_adr"].eq(self.bus.adr[: len(self.ports["wb_adr"])])
        own = tuple(f"wb_{name}" for name in ("adr", *inputs, *outputs))
        self.connect(pads, idle or {}, own)
        self.state = CSRStatus(
            fields=[CSRField("drive_enable", size=1, description="the drive may be on")]
        )
        self.comb += self.state.fields.drive_enable.eq(self.ports["drive_enable"])


class MoireNode(Block):
    """A complete node with its own soft core, which is commanded over RS-485. CSR `control`: the
    node is held in reset, as after power-up, and its address on the bus; CSR `state`: its drives.
    """

    def __init__(
        self,
        platform: Any,
        clk_hz: float,
        pads: Any,
        idle: Mapping[str, int] | None = None,
        **parameters: int | str,
    ) -> None:
        super().__init__(platform, "node", {"CLK_HZ": int(clk_hz), **parameters})
        self.control = CSRStorage(
            fields=[
                CSRField("hold", size=1, reset=1, description="1: the node is in reset"),
                CSRField("address", size=4, offset=4, reset=1, description="1 to 15; set in reset"),
            ]
        )
        drives = self.ports["drive_enable"]
        self.state = CSRStatus(
            fields=[CSRField("drive_enable", size=len(drives), description="drives that may be on")]
        )
        self.comb += [
            self.hold.eq(self.control.fields.hold),
            self.ports["address"].eq(self.control.fields.address),
            self.state.fields.drive_enable.eq(drives),
        ]
        self.connect(pads, idle or {}, ("address",))
