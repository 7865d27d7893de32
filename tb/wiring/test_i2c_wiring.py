# SPDX-License-Identifier: Apache-2.0
"""The wires of the I2C port: filters, queues and master, with an EEPROM at its pins."""

import pytest

from tb.peripheral.i2c_master import NOT_ACKNOWLEDGED, OK, READ, START, STOP, WRITE
from tb.wiring.i2c_port import BIT, SPIKE

IDLE = dict(free=128, busy=0, owned=0, scl=1, sda=1, result_present=0)
HEAD = [(START, 0), (WRITE, 0xA0), (WRITE, 0x12), (WRITE, 0x40)]
READ_BACK = [*HEAD, (START, 0), (WRITE, 0xA1), (READ, 1), (READ, 0), (STOP, 0)]


def queue(port, commands):
    for command, value in commands:
        port.push(command, **{"acknowledge" if command == READ else "data": value})


def results(port, commands):
    """What these commands give."""
    queue(port, commands)
    port.end()
    return port.results()


def test_bytes_go_through_both_queues_into_the_eeprom_and_back(i2c_port):
    port = i2c_port
    port.reset()
    assert port.state() == IDLE
    answers = results(port, [*HEAD, (WRITE, 0x96), (WRITE, 0x3A), (STOP, 0)])
    assert [result for result, _ in answers] == [OK] * 7
    assert port.eeprom.memory[0x1240:0x1242] == bytes([0x96, 0x3A])
    answers = results(port, [(START, 0), (WRITE, 0xA0), (STOP, 0)])
    assert [result for result, _ in answers] == [OK, NOT_ACKNOWLEDGED, OK], "it writes"
    port.clk(30 * BIT)
    port.eeprom.memory[0x1242] = 0  # a third byte would pull the line low at the stop
    answers = results(port, READ_BACK)
    assert [result for result, _ in answers] == [OK] * len(READ_BACK)
    assert [byte for _, byte in answers[6:8]] == [0x96, 0x3A]
    assert port.state() == IDLE


def test_the_state_follows_the_commands(i2c_port):
    port = i2c_port
    port.reset()
    port.set(push=1, command=START)
    assert port.get("busy") == 1, "with the command itself"
    port.run(1)
    port.set(push=0)
    assert port.get("busy") == 1 and port.get("owned") == 0
    port.end()
    assert port.state() == IDLE | dict(owned=1, scl=0, sda=0, result_present=1)
    for _ in range(4):
        port.push(WRITE, 0xA0)
    assert port.get("free") == 128 - 3, "the first one is in work"
    port.push(STOP)
    port.end()
    assert port.state() == IDLE | dict(result_present=1)
    assert len(port.results()) == 6


def test_a_reset_drops_commands_and_results(i2c_port):
    port = i2c_port
    port.reset()
    queue(port, HEAD)
    port.end()
    queue(port, HEAD)
    assert (port.get("owned"), port.get("result_present"), port.get("scl_low")) == (1, 1, 1)
    port.set(scl_pin=1, sda_pin=1)
    port.reset()
    assert port.state() == IDLE and not port.get("scl_low") and not port.get("sda_low")


@pytest.mark.parametrize("line", ["scl", "sda"])
def test_a_pulse_counts_only_if_it_lasts_50_ns(i2c_port, line):
    port, other = i2c_port, {"scl": "sda", "sda": "scl"}[line]
    port.reset()
    for cycles in range(1, SPIKE + 2):
        port.watch("scl", "sda")
        port.changes()
        port.set(**{f"{line}_pin": 0})
        port.run(cycles)
        port.set(**{f"{line}_pin": 1})
        port.run(10)
        changed = [(change.pin, change.value) for change in port.changes()]
        assert changed == ([(line, 0), (line, 1)] if cycles >= SPIKE else []), cycles
        assert port.get(other) == 1


@pytest.mark.parametrize("line", ["scl", "sda"])
def test_the_filters_follow_the_lines_at_once_after_a_reset(i2c_port, line):
    port = i2c_port
    port.reset()
    port.set(**{f"{line}_pin": 0})
    port.run(10)
    assert port.get(line) == 0
    port.set(rst=1)
    port.run(4)
    assert port.get(line) == 1, "in the reset the lines are high"
    port.set(rst=0)
    port.run(2)  # of the synchroniser
    assert port.get(line) == 1
    port.run(1)
    assert port.get(line) == 0
