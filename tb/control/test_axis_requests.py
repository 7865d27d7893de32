# SPDX-License-Identifier: Apache-2.0
"""axis_requests: all inputs against the model."""

import itertools

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.control.axis_requests import REQUESTS, joined

INPUTS = [name for names in REQUESTS.values() for name in names]


async def outputs(dut, **inputs):
    """All outputs, without a clock; inputs that are not named are 0."""
    inputs = dict.fromkeys(INPUTS, 0) | inputs
    for name, level in inputs.items():
        getattr(dut, name).value = level
    await Timer(1, "ns")
    want = joined(**inputs)
    assert {name: int(getattr(dut, name).value) for name in want} == want
    return want


@cocotb.test()
async def latency_is_0_and_each_request_reaches_one_output(dut):
    for output, names in REQUESTS.items():
        for name in names:
            assert await outputs(dut, **{name: 1}) == dict.fromkeys(REQUESTS, 0) | {output: 1}


@cocotb.test()
async def all_inputs_match_the_model(dut):
    for levels in itertools.product((0, 1), repeat=len(INPUTS)):
        await outputs(dut, **dict(zip(INPUTS, levels, strict=True)))


def test_axis_requests():
    run("axis_requests", __file__)
