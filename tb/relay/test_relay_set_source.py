# SPDX-License-Identifier: Apache-2.0
"""relay_set_source: both sources with random bytes against the model."""

import random

import cocotb
from cocotb.triggers import Timer

from tb.bench import run
from tb.relay.relay_set_source import source


async def outputs(dut, reading, stored, sent):
    """(start, valid, data), without a clock."""
    dut.reading.value = reading
    dut.stored_start.value, dut.stored_valid.value, dut.stored_data.value = stored
    dut.sent_start.value, dut.sent_valid.value, dut.sent_data.value = sent
    await Timer(1, "ns")
    return int(dut.start.value), int(dut.valid.value), int(dut.data.value)


@cocotb.test()
async def latency_is_0_and_the_host_is_the_source_unless_the_flash_is_read(dut):
    assert await outputs(dut, 0, (1, 0, 0xA5), (0, 1, 0x5A)) == (0, 1, 0x5A)
    assert await outputs(dut, 1, (1, 0, 0xA5), (0, 1, 0x5A)) == (1, 0, 0xA5)


@cocotb.test()
async def random_bytes_match_the_model(dut):
    def some():
        return random.getrandbits(1), random.getrandbits(1), random.getrandbits(8)

    for n in range(500):
        stored, sent = some(), some()
        assert await outputs(dut, n % 2, stored, sent) == source(n % 2, stored, sent)


def test_relay_set_source():
    run("relay_set_source", __file__)
