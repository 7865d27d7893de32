# SPDX-License-Identifier: Apache-2.0
"""The measured frequency response of S0's stage, against that of its parameters."""

import numpy
from numpy.typing import NDArray

from figures.common import Figure, Quick, console
from moire.analysis import measured_plant, response_measurement
from moire.client.access import COUNTS
from moire.client.bus import Bus
from twin import WITH_SCOPE, Twin, TwinTransport
from twin.parameters import tables

Complex = NDArray[numpy.complex128]

SEED = 1
LOWEST_HZ, HIGHEST_HZ = 1.0, 600.0
FULL_SCALE = 1 << 15
IMAGES = 3  # of the plant, above and below, which the sampling folds back
HERE = 37  # home_method: the zero is where the axis stands


def from_voltage(s: Complex) -> Complex:
    """Position of the table in m over the mean voltage of the bridge in V, of the stage in motion.

    The linearised model of sw/twin/machines: winding and shaft of the motor, screw as spring and
    damper, table. Sliding friction is constant, so only its viscous part counts; the preload keeps
    the nut on one flank.
    """
    p = tables.values({}, "stage")
    lead = p["screw_lead"] / (2 * numpy.pi)  # m per rad
    screw = p["screw_stiffness"] + p["screw_damping"] * s
    table = p["table_mass"] * s**2 + p["table_viscous"] * s
    follows = screw / (table + screw)  # of the table, over the nut
    winding = p["motor_resistance"] + p["motor_inductance"] * s
    shaft = p["motor_inertia"] * s**2 + p["motor_viscous"] * s
    torque = p["motor_constant"] / winding  # Nm/V
    turning = shaft + lead**2 * table * follows + p["motor_constant"] ** 2 * s / winding
    return numpy.asarray(torque / turning * lead * follows, complex)


def true_plant(hz: NDArray[numpy.float64], tick_s: float) -> Complex:
    """Position in LSB of 2^-16 period over the command, which holds for a tick; no other delay."""
    p = tables.values({}, "stage")
    total = numpy.zeros(len(hz), complex)
    for image in range(-IMAGES, IMAGES + 1):
        s = numpy.asarray(2j * numpy.pi * (hz + image / tick_s), complex)
        total += from_voltage(s) * (1 - numpy.exp(-s * tick_s)) / (s * tick_s)
    scale = p["supply_voltage"] / FULL_SCALE / p["grating_period"] * COUNTS
    return numpy.asarray(total * scale, complex)


def frf_error_db(low_hz: float = LOWEST_HZ, records: int = 1, seed: int = SEED) -> float:
    """The largest error of the size of the plant, in dB."""
    twin = Twin(nodes=(1,), seed=seed, node_parameters=WITH_SCOPE)
    twin.run_until_ready()
    axis = Bus(TwinTransport(twin)).axis(1)
    axis.set_parameter("home_method", HERE)
    axis.enable()
    axis.home()
    response = response_measurement.measure(
        axis, records=records, low_hz=low_hz, high_hz=HIGHEST_HZ * 1.05
    )
    axis.disable()
    inside = (response.hz >= low_hz * 0.95) & (response.hz <= HIGHEST_HZ)
    ratio = (response.plant / true_plant(response.hz, response.tick_s))[inside]
    hz, size_db = response.hz[inside], 20 * numpy.log10(numpy.abs(ratio))
    delay_s = -numpy.polyfit(hz, numpy.unwrap(numpy.angle(ratio)), 1)[0] / (2 * numpy.pi)
    left = numpy.degrees(numpy.angle(ratio * numpy.exp(2j * numpy.pi * hz * delay_s)))
    plant = measured_plant.fit(response)
    worst = int(numpy.abs(size_db).argmax())
    console.print(
        f"{len(hz)} frequencies from {hz[0]:.2f} to {hz[-1]:.1f} Hz: size within "
        f"{abs(size_db[worst]):.3f} dB (at {hz[worst]:.1f} Hz), median "
        f"{numpy.median(numpy.abs(size_db)):.3f} dB; phase within {numpy.abs(left).max():.1f} "
        f"degrees of a delay of {1e6 * delay_s:.0f} us; coherence at least "
        f"{response.coherence.min():.3f}; resonance fitted at {plant.resonance_hz or 0:.1f} Hz"
    )
    return float(abs(size_db[worst]))


FIGURES = {
    "frf_error_db": Figure(
        frf_error_db,
        "dB",
        "size of the plant of S0's stage by `moire tune`, in closed loop at 2 mm/s, against the "
        "linear response of the parameters of its model, 1 to 600 Hz, worst frequency; the motor "
        "alone, a perfect scale, no vibration",
        "<= 1",
        Quick({"low_hz": 25.0}, "from 25 Hz"),
        2,
    ),
}
