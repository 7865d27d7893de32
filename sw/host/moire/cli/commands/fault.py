# SPDX-License-Identifier: Apache-2.0
"""The commands that find what is wrong: fault, selftest."""

from itertools import chain

import click

from moire import units
from moire.analysis import loopback
from moire.analysis import selftest as checks
from moire.cli.commands.axis import table
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.cli.values import Name
from moire.client import remedies
from moire.client.records import Signal

NAMES = sorted({name for remedies_of, _ in remedies.TABLES.values() for name in remedies_of})
WALKS = {"open": loopback.open_checks, "plug": loopback.plug_checks}  # of the pins, by --pins


@moire.command(
    "fault",
    help="Show the latched faults, which of them came first and where, and what to do; or explain "
    "a fault or a cause by its name.",
    example="moire --port /dev/ttyUSB0 fault -- reset",
)
@click.argument(
    "name",
    required=False,
    type=Name("fault or cause", NAMES, "fault --help"),
    metavar="NAME",
    help="The name of a fault, a cause or an event of the encoder, such as following_error. "
    "docs/faults.md lists them.",
)
def fault(call: Call, name: str | None) -> None:
    """Clears nothing, and opens no port for an explanation."""
    if name is not None:
        explain(call, name)
        return
    axis = call.axis
    status, encoder = axis.status(), axis.encoder()
    signal = axis.signal() if axis.built().has("monitor") else Signal((), ())
    values = {
        "faults": status.faults,
        "first_fault": status.first_fault,
        "words": status.fault_words,
        "fault_position_nm": encoder.fault_position_nm if status.faults else None,
        "encoder_events": status.encoder_events,
        "signal_faults": signal.faults,
        "first_signal_faults": signal.first,
        "to_do": remedies.of_faults(status.first_fault if status.faults else ()),
    }
    if not status.faults:
        call.say_of_axis(values, f"{call.where}: no fault is latched")
        return
    place = units.format_length(encoder.fault_position_nm)
    rows = [("first", f"{status.first_fault_words}, at {place}")]
    if status.encoder_events:
        rows.append(("encoder", status.encoder_event_words))
    if signal.first:
        rows.append(("signal", signal.first_words))
    home = "" if status.homed else ", then 'moire home'"
    to_do = remedies.of_faults(status.first_fault or status.faults)
    rows.append(("to do", f"{to_do}; then 'moire reset'{home}"))
    call.say_of_axis(values, table(f"{call.where}: {status.fault_words}", rows, 9))


def explain(call: Call, name: str) -> None:
    """Print what a name means, what to check, and the parameters that matter."""
    found = remedies.explained(name)
    parameters = remedies.parameters_in(" ".join(to_do for _, _, to_do in found))
    rows = []
    for what, meaning, to_do in found:
        rows += [f"{name}, a {what}".replace("a event", "an event")]
        rows += [f"  {'means':<12}{meaning}", f"  {'to do':<12}{to_do}"]
    if parameters:
        rows.append(f"  {'parameters':<12}{', '.join(parameters)}")
    entries = [{"kind": what, "words": meaning, "to_do": to_do} for what, meaning, to_do in found]
    call.say({"name": name, "found": entries, "parameters": parameters}, "\n".join(rows))


@moire.command(
    "selftest",
    help="Check a node without moving anything, or its pins without a machine.",
    example="moire --port /dev/ttyUSB0 selftest",
)
@click.option(
    "--pins",
    type=Name("check of the pins", WALKS),
    metavar="CHECK",
    help="Check the pins of the axes instead, with the machine taken off: 'open' checks that "
    "inputs without a wire read as pressed; 'plug' switches the drives on and steps, through the "
    "loop-back plug that the wiring page describes.",
)
def selftest(call: Call, pins: str | None) -> None:
    """Every check is made, even if one has failed."""
    found, address = [], call.options.address
    made = (
        chain(checks.node_checks(call.node), WALKS[pins](call.node))
        if pins
        else checks.checks(call.node)
    )
    for check in made:
        found.append(check)
        if not call.options.json:
            result = "passed" if check.passed else "FAILED"
            call.say({}, f"{result:<8} {check.name:<18} {check.words}")
    failed = [check.name for check in found if not check.passed]
    if call.options.json:
        reports = [check._asdict() for check in found]
        call.say({"address": address, "passed": not failed, "checks": reports}, "")
    if failed:
        raise checks.SelfTestFailed(
            f"node {address} failed {len(failed)} of {len(found)} checks: {', '.join(failed)}"
        )
