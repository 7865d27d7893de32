# SPDX-License-Identifier: Apache-2.0
"""The command ports."""

from moire.bus.twin_port import MACHINES, PORT
from moire.cli.parser import moire
from moire.cli.session import Call


@moire.command(
    "ports",
    help="List the serial ports of this computer and the simulated machines, and say which port a "
    "call takes that names none.",
    example="moire ports",
)
def ports(call: Call) -> None:
    """Opens no port."""
    from serial.tools import list_ports  # only here: no other command needs it

    serial = {found.device: found.description for found in list_ports.comports()}
    twins = {f"{PORT}:{name}": words for name, words in MACHINES.items()}
    chosen = call.options.port
    rows = [f"{name:<20}{words}" for name, words in serial.items()] or ["no serial port is there"]
    rows += [f"{name:<20}simulated: {words}" for name, words in twins.items()]
    rows.append(f"taken without --port: {chosen or 'none, see MOIRE_PORT and machine.toml'}")
    call.say({"serial": serial, "simulated": twins, "port": chosen}, "\n".join(rows))
