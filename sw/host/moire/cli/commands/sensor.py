# SPDX-License-Identifier: Apache-2.0
"""The commands about the sensor of an axis: encoder, signal."""

from dataclasses import asdict

from moire.cli.commands.axis import WITHOUT_SINE, table
from moire.cli.parser import moire
from moire.cli.session import Call


@moire.command(
    "encoder",
    help="Show what the sensor measures now.",
    example="moire --port /dev/ttyUSB0 encoder",
)
def encoder(call: Call) -> None:
    """One read-back of the feedback channel."""
    axis = call.axis
    state, sine = axis.encoder(), axis.has_sine()
    rows = [("sensor", WITHOUT_SINE)]
    if sine:
        rows = [
            ("sine, cosine", f"{state.sin} {state.cos} ADC counts"),
            ("phase", f"{360 * state.phase:.3f} degrees"),
            ("amplitude", f"{state.amplitude} ADC counts"),
        ]
    rows += [
        ("quadrature", f"{state.quadrature_count} quarter periods"),
        ("rejected", f"{state.rejected_pulses} pulses, {state.rejected_samples} samples"),
        (
            "home phase",
            f"{state.home_phase_nm:.1f} nm from the phase zero taken, "
            f"margin {100 * state.home_margin:.0f} %",
        ),
        ("first fault", f"at {state.fault_position_nm / 1e6:.6f} mm"),
    ]
    call.say_of_axis({**asdict(state), "sine": sine}, table(f"{call.where}:", rows, 12))


@moire.command(
    "signal",
    help="Show what is wrong with the sine and cosine signals.",
    example="moire --port /dev/ttyUSB0 signal",
)
def signal(call: Call) -> None:
    """The faults of the signal now, and the first ones since reset."""
    state = call.axis.signal()
    values = {
        **asdict(state),
        "fault_words": state.fault_words,
        "first_words": state.first_words,
    }
    call.say_of_axis(
        values,
        f"{call.where}: {state.fault_words or 'nothing is wrong with the signal'}\n"
        f"  first since reset: {state.first_words or 'none'}",
    )
