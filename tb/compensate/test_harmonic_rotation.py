# SPDX-License-Identifier: Apache-2.0
"""harmonic_rotation_rom: its angles against math.atan and against its generator, and that the file
is not stale.
"""

import math

import cocotb
from cocotb.triggers import Timer

from tables import harmonic_rotation
from tb.bench import run


@cocotb.test()
async def latency_is_0_and_every_angle_is_that_of_the_generator(dut):
    for number, angle in enumerate(harmonic_rotation.angles()):
        dut.rotation.value = number
        await Timer(1, "ns")
        assert int(dut.angle.value) == angle


def test_harmonic_rotation_rom():
    run("harmonic_rotation_rom", __file__)


def test_the_angles_are_arctangents_of_powers_of_two():
    angles = harmonic_rotation.angles()
    assert len(angles) == 24
    assert angles == [round(math.atan(2.0**-n) / math.tau * 2**32) for n in range(24)]


def test_the_made_file_is_fresh():
    assert harmonic_rotation.main(["--check"]) == 0
