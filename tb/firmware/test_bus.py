# SPDX-License-Identifier: Apache-2.0
"""bus.c and parameters.c: which requests are answered, refused (and why) or ignored."""

import math
import random
import zlib

import pytest

from tables.bus import register_fields
from tb.bench import seed
from twin.build import ROOT
from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import CLK_HZ, DEFINES, PARAMETER, PERIOD, TABLE

COMMAND = DEFINES["BUS_RECEIVE_COMMAND_MASK"]
GOOD = DEFINES["BUS_RECEIVE_GOOD_MASK"]
OPERATION = {name: operation["code"] for name, operation in TABLE["operation"].items()}
CODE = {name: code for name, (code, _) in TABLE["cause"].items()}
WITH_AXIS = [
    name for name, operation in TABLE["operation"].items() if "axis u8" in operation["request"]
]


def example(operation, **values):
    """A body of the right length for axis 0, in which all fields are 1 unless given."""
    body = bytes([9, OPERATION[operation]])
    for declaration in TABLE["operation"][operation]["request"]:
        name, kind = declaration.split()
        body += values.get(name, 0 if name == "axis" else 1).to_bytes(
            int(kind[1:]) // 8, "little", signed=kind[0] == "i"
        )
    return body


def cause_of(machine, body):
    machine.send(body)
    answer = machine.reply()
    assert answer[0] == body[0]
    return answer[2]


def test_before_any_request_the_reply_is_ok_of_sequence_0():
    assert CompiledNode().reply() == bytes([0, 0, 0])


def test_a_known_exchange_byte_by_byte():
    machine = CompiledNode(address=2)
    sent = machine.receive([0x22 | COMMAND])
    assert sent == b"\x62"
    frame = bytes([2, 7, OPERATION["counters"]])
    crc = zlib.crc32(b"\x22" + frame).to_bytes(4, "little")
    assert machine.receive([*frame, *crc[:3], crc[3] | GOOD]) == b""
    answer = machine.receive([0x12 | COMMAND])
    body = bytes([7, OPERATION["counters"], 0]) + bytes(40)
    assert answer == b"\x52" + bytes([43]) + body + zlib.crc32(
        b"\x52" + bytes([43]) + body
    ).to_bytes(4, "little")


def test_identify_reports_the_build():
    answer = CompiledNode(Axis(), Axis(), address=13).ask("identify")
    assert (
        answer["map_crc"] == DEFINES["MAP_CRC"] and answer["address"] == 13 and answer["axes"] == 2
    )
    assert (answer["clk_hz"], answer["tick_hz"], answer["sample_hz"]) == (CLK_HZ, 4000, 100_000)
    assert answer["protocol_crc"] == zlib.crc32((ROOT / "tables" / "bus.toml").read_bytes())


def test_every_operation_of_another_length_is_refused():
    machine = CompiledNode()
    for name in OPERATION:
        for body in (example(name) + b"\0", example(name)[:-1]):
            if len(body) > 1:
                assert cause_of(machine, body) == CODE["wrong_length"], name
    assert cause_of(machine, b"\x33") == CODE["wrong_length"]


def test_an_operation_that_does_not_exist_is_refused():
    machine = CompiledNode()
    for code in set(range(256)) - set(OPERATION.values()):
        assert cause_of(machine, bytes([code, code])) == CODE["unknown_operation"]


def test_an_axis_that_does_not_exist_is_refused():
    machine = CompiledNode(Axis(), Axis())
    for name in WITH_AXIS:
        for axis in (2, 7, 255):
            assert cause_of(machine, example(name, axis=axis)) == CODE["no_such_axis"], name
    assert machine.status(axis=1)["state"] == "off"


def test_with_another_map_only_identify_is_answered_and_no_axis_is_touched():
    axis = Axis()
    machine = CompiledNode(axis, map_crc=DEFINES["MAP_CRC"] ^ 1)
    for name in OPERATION:
        assert cause_of(machine, example(name)) == (0 if name == "identify" else CODE["wrong_map"])
    machine.run(20)
    assert machine.ask("identify")["map_crc"] == DEFINES["MAP_CRC"] ^ 1
    assert not axis.word and not axis.strobes


def test_a_repeated_frame_is_not_acted_on_again():
    machine = CompiledNode()
    body = example("set_parameter", parameter=PARAMETER["kp"]["id"], value=5)
    machine.send(body)
    machine.set(kp=6)
    machine.send(body)  # other frames came between: this is a new one
    assert machine.axes[0].word[DEFINES["AXIS_KP"]] == 5
    machine.axes[0].word[DEFINES["AXIS_KP"]] = 99
    for _ in range(3):
        machine.send(body)
        assert machine.reply()[:3] == bytes([9, OPERATION["set_parameter"], 0])
    assert (
        machine.axes[0].word[DEFINES["AXIS_KP"]] == 99 and machine.ask("counters")["repeated"] == 3
    )


def test_the_same_sequence_number_with_other_content_is_acted_on():
    machine = CompiledNode()
    for value in (5, 6):
        machine.send(example("set_parameter", parameter=PARAMETER["kp"]["id"], value=value))
        assert machine.axes[0].word[DEFINES["AXIS_KP"]] == value
    assert machine.ask("counters")["repeated"] == 0


def test_frames_that_the_hardware_did_not_mark_good_change_nothing():
    machine = CompiledNode()
    machine.ask("identify")
    before = machine.reply()
    words = machine.frame(example("set_parameter", parameter=PARAMETER["kp"]["id"], value=5))
    machine.receive([word & ~GOOD for word in words])
    assert machine.reply() == before
    machine.receive(words[:5])  # incomplete
    machine.receive(
        [word | GOOD for word in words[5:7]]
    )  # marked good, but shorter than its length: not a frame
    machine.receive([words[0], *[200] * 200])  # much longer than any frame
    assert (
        machine.reply() == before
        and machine.axes[0].word[DEFINES["AXIS_KP"]] == PARAMETER["kp"]["default"]
    )


def test_nonsense_on_the_bus_never_stops_the_node():
    draw = random.Random(seed())
    machine = CompiledNode()
    for _ in range(300):
        machine.receive(
            [
                draw.getrandbits(10) if draw.random() < 0.5 else draw.getrandbits(8)
                for _ in range(draw.randrange(100))
            ]
        )
    assert machine.ask("identify")["version"] == TABLE["version"]


def test_refusals_are_counted():
    machine = CompiledNode()
    for n in range(5):
        cause_of(machine, bytes([n, 77]))
    assert machine.ask("counters")["refused"] == 5


def test_counters_come_from_the_bus_registers():
    machine = CompiledNode()
    names = (
        "frames_good",
        "frames_bad",
        "framing_errors",
        "start_glitches",
        "overruns",
        "breaks",
        "transmit_timeouts",
        "syncs",
    )
    for n, name in enumerate(names):
        machine.word[DEFINES["BUS_BASE"] + DEFINES["BUS_" + name.upper()]] = 1000 + n
    answer = machine.ask("counters")
    assert [answer[name] for name in names] == [*range(1000, 1008)]


# own steps are counted as pulse and direction only; the DAC serves the motor or the fine stage
PARTNER = {"step_output": "position_source", "fine_reach": "drive"}


def test_every_parameter_accepts_both_ends_of_its_range_and_nothing_beyond():
    machine = CompiledNode()
    for name, parameter in PARAMETER.items():
        assert (
            machine.ask("get_parameter", axis=0, parameter=parameter["id"])["value"]
            == parameter["default"]
        )
        if name in PARTNER:
            machine.set(**{PARTNER[name]: 0})
        for value in (parameter["min"], parameter["max"]):
            machine.set(**{name: value})
            assert machine.ask("get_parameter", axis=0, parameter=parameter["id"])["value"] == value
        for value in (parameter["min"] - 1, parameter["max"] + 1):
            assert (
                machine.request("set_parameter", axis=0, parameter=parameter["id"], value=value)[0]
                == "out_of_range"
            )
        assert (
            machine.ask("get_parameter", axis=0, parameter=parameter["id"])["value"]
            == parameter["max"]
        )


@pytest.mark.parametrize("number", [0, len(PARAMETER) + 1, 255])
def test_a_parameter_that_does_not_exist_is_refused(number):
    machine = CompiledNode()
    assert machine.request("get_parameter", axis=0, parameter=number)[0] == "unknown_parameter"
    assert (
        machine.request("set_parameter", axis=0, parameter=number, value=1)[0]
        == "unknown_parameter"
    )


def test_start_writes_the_defaults_into_the_registers():
    machine = CompiledNode()
    word, actuator, d = machine.axes[0].word, machine.actuators[0], DEFINES
    default = {name: parameter["default"] for name, parameter in PARAMETER.items()}
    for name in (
        "kp",
        "ki",
        "kd",
        "kv",
        "ka",
        "output_limit",
        "integral_limit",
        "dead_band",
        "following_limit",
        "disagreement_limit",
        "encoder_fault_mask",
    ):
        assert word[d["AXIS_" + name.upper()]] == default[name]
    assert (
        word[d["AXIS_AMPLITUDE_WINDOW"]]
        == default["amplitude_low"] | default["amplitude_high"] << 16
    )
    assert (
        word[d["AXIS_SENSING"]]
        == CLK_HZ // 100_000 | default["outlier_step"] << 16 | default["outlier_hold"] << 24
    )  # 10 us, a sample in each cycle
    assert actuator[d["ACTUATOR_PWM_PERIOD"]] == CLK_HZ // 20_000 and word[d["AXIS_CONTROL"]] == 0
    assert word[d["AXIS_STOP_DECELERATION"]] == 125_000 * 2**40 // 4000**2 >> 8
    assert machine.word[d["BUS_BASE"] + d["BUS_BIT_TIME"]] == round(16 * CLK_HZ / 115_200)
    assert machine.word[d["BUS_BASE"] + d["BUS_WATCHDOG_TIME"]] == default["watchdog_time"]
    assert (
        machine.word[d["NODE_TICK_PERIOD"]] == CLK_HZ // 4000
        and machine.word[d["NODE_SAMPLE_PERIOD"]] == CLK_HZ // 100_000
    )


@pytest.mark.parametrize("axis", [0, 1])
def test_a_parameter_with_a_register_goes_into_its_field_and_leaves_the_others(axis):
    machine = CompiledNode(Axis(), Axis())
    field = register_fields()
    checked = 0
    for name, parameter in PARAMETER.items():
        if "register" not in parameter:
            continue
        path = parameter["register"]
        block, register, part = field[path if path.count(".") == 2 else path + ".value"]
        address = block.base + axis * block.stride + register.offset
        mask = (1 << part.width) - 1 << part.low
        before = machine.ask("read_register", address=address)["value"]
        value = parameter["min"] if before == parameter["max"] << part.low else parameter["max"]
        machine.set(axis=axis, **{name: value})
        after = machine.ask("read_register", address=address)["value"]
        assert after == before & ~mask | value << part.low & mask, name
        checked += 1
    assert checked == 32


def test_values_too_large_for_a_register_saturate():
    machine = CompiledNode()
    machine.set(acceleration=100_000_000)
    assert machine.axes[0].word[DEFINES["AXIS_STOP_DECELERATION"]] == 2**32 - 1


def test_a_clock_of_the_dac_that_is_too_slow_for_its_register_is_refused():
    clk_hz = random.Random(seed()).randint(20_000_000, 100_000_000)

    class FastNode(CompiledNode):
        def read(self, offset):
            return clk_hz if offset == DEFINES["NODE_CLK_HZ"] else super().read(offset)

    machine, dac = FastNode(), DEFINES["ACTUATOR_DAC"]
    most = DEFINES["ACTUATOR_DAC_HALF_PERIOD_MASK"]
    slowest = math.ceil(clk_hz / (2 * most))
    machine.set(dac_clock=slowest)
    assert machine.actuators[0][dac] & most == most
    fields = {"axis": 0, "parameter": PARAMETER["dac_clock"]["id"]}
    assert machine.request("set_parameter", **fields, value=slowest - 1)[0] == "out_of_range"
    assert machine.ask("get_parameter", **fields)["value"] == slowest


def test_the_watchdog_time_is_one_for_all_axes():
    machine = CompiledNode(Axis(), Axis())
    machine.set(axis=1, watchdog_time=77)
    assert (
        machine.ask("get_parameter", axis=0, parameter=PARAMETER["watchdog_time"]["id"])["value"]
        == 77
    )


def test_registers_are_read_by_address_but_never_a_queue():
    machine = CompiledNode()
    assert (
        machine.ask("read_register", address=DEFINES["NODE_MAP_CRC"])["value"] == DEFINES["MAP_CRC"]
    )
    machine.axes[0].word[DEFINES["AXIS_KI"]] = 0xDEADBEEF
    assert (
        machine.ask("read_register", address=DEFINES["AXIS_BASE"] + DEFINES["AXIS_KI"])["value"]
        == 0xDEADBEEF
    )
    assert (
        machine.ask(
            "read_register", address=DEFINES["PERIPHERALS_BASE"] + DEFINES["PERIPHERALS_BUILT"]
        )["value"]
        == 0
    )
    for address in (
        1,
        2,
        3,
        0x301,
        0x1C00,
        DEFINES["AXIS_BASE"] + DEFINES["AXIS_STRIDE"],
        0xFFFC,
        0xFFFF,
        DEFINES["BUS_BASE"] + DEFINES["BUS_RECEIVE"],
        DEFINES["NODE_BASE"] + DEFINES["NODE_SCOPE_WORD"],
        DEFINES["PERIPHERALS_BASE"] + DEFINES["PERIPHERALS_I2C_ANSWER"],
        DEFINES["PERIPHERALS_BASE"] + DEFINES["PERIPHERALS_PEER_RECEIVE"],
    ):
        assert machine.request("read_register", address=address)[0] == "no_such_register", hex(
            address
        )


def test_both_words_of_a_wide_register_are_of_the_same_moment():
    """The firmware reads the time itself between two requests, and the hardware holds the high word
    of the latest reading.
    """
    machine = CompiledNode()
    address = DEFINES["NODE_BASE"] + DEFINES["NODE_TIME_STAMP_LOW"]

    def read(at):
        return machine.ask("read_register", address=at)["value"]

    machine.clk = (5 << 32) - 10
    low = read(address)
    machine.clk += 1 << 32
    assert low > 1 << 31 and read(address + 4) == 4
    assert read(address + 4) >= 5, "a word is kept for one request"
    read(address)
    assert read(DEFINES["NODE_MAP_CRC"]) == DEFINES["MAP_CRC"]
    machine.clk += 1 << 32
    assert read(address + 4) >= 6, "another request lies between"


def test_the_registers_of_the_link_are_written_only_where_it_is_built():
    machine = CompiledNode()
    entry = {"address": DEFINES["LINK_BASE"] + DEFINES["LINK_ENTRY"], "value": 0x0410_0400}
    assert machine.request("write_register", **entry)[0] == "not_built"
    machine.link[DEFINES["LINK_STATE"]] = DEFINES["LINK_STATE_BUILT_MASK"]
    assert machine.request("write_register", **entry)[0] == "ok"
    assert machine.link[DEFINES["LINK_ENTRY"]] == 0x0410_0400
    wrong = entry | {"address": entry["address"] + 2}
    assert machine.request("write_register", **wrong)[0] == "no_such_register"


@pytest.mark.parametrize(
    "position", [0, 1, -1, PERIOD, -PERIOD - 1, 123_456_789, -(2**47), 2**47 - 1]
)
@pytest.mark.parametrize("divisions", [1, 160, 65536])
def test_counts_are_the_floor_of_position_times_n(position, divisions):
    machine = CompiledNode(Axis(position))
    machine.set(counts_per_period=divisions)
    status = machine.status()
    assert status["position"] == position and status["counts"] == position * divisions // 65536


def test_no_part_of_a_millisecond_is_lost():
    machine = CompiledNode()
    start = machine.firmware.clock_ms()
    for _ in range(1000):
        machine.clk += 7 * CLK_HZ // 10_000
        machine.poll()
    machine.clk += 5 * CLK_HZ  # a long wait
    machine.poll()
    assert machine.firmware.clock_ms() - start == 5700


def test_a_followed_position_is_new_at_each_read_until_the_next_request():
    machine = CompiledNode(Axis(), Axis(1000))
    assert machine.ask("follow", axis=1)["position"] == 1000
    for position in (7, -1, 2**47 - 1):
        machine.axes[1].machine = position
        body = machine.reply()
        assert (
            body[:3] == bytes([machine.sequence, OPERATION["follow"], 0])
            and int.from_bytes(body[3:], "little", signed=True) == position
        )
    machine.ask("position", axis=1)
    before = machine.reply()
    machine.axes[1].machine = 55
    assert machine.reply() == before


def bit_time(machine):
    return machine.word[DEFINES["BUS_BASE"] + DEFINES["BUS_BIT_TIME"]]


def bit_time_of(baud):
    return (16 * CLK_HZ + baud // 2) // baud


def test_the_baud_rate_changes_only_when_the_reply_has_been_sent():
    machine = CompiledNode()
    body = example("set_baud", baud=500_000)
    machine.send(body)
    machine.run(10)
    assert bit_time(machine) == bit_time_of(115_200)
    assert machine.reply()[2] == 0
    machine.poll()
    assert bit_time(machine) == bit_time_of(500_000)


@pytest.mark.parametrize("baud", [0, 9599, CLK_HZ // 8 + 1, 3_000_001, 2**32 - 1])
def test_a_baud_rate_out_of_range_is_refused(baud):
    machine = CompiledNode()
    assert machine.request("set_baud", baud=baud)[0] == "out_of_range"
    machine.run(10)
    assert bit_time(machine) == bit_time_of(115_200)


def test_a_break_or_a_silence_of_five_seconds_restores_the_first_baud_rate():
    machine, breaks = CompiledNode(), DEFINES["BUS_BASE"] + DEFINES["BUS_BREAKS"]
    for _ in range(2):
        machine.ask("set_baud", baud=9600)
        machine.run(4999)
        assert bit_time(machine) == bit_time_of(9600)
        machine.reply()  # a read alone shows that the master is present too
        machine.run(4999)
        assert bit_time(machine) == bit_time_of(9600)
        machine.run(3)
        assert bit_time(machine) == bit_time_of(115_200)
    machine.ask("set_baud", baud=9600)
    machine.run(5)
    machine.word[breaks] = machine.word.get(breaks, 0) + 1
    machine.poll()
    assert bit_time(machine) == bit_time_of(115_200)


def test_another_request_before_the_reply_was_read_cancels_the_baud_rate():
    machine = CompiledNode()
    machine.send(example("set_baud", baud=9600))
    machine.send(bytes([10, OPERATION["identify"]]))
    machine.reply()
    machine.poll(3)
    assert bit_time(machine) == bit_time_of(115_200)


def test_the_encoder_is_reported_as_in_the_registers():
    machine = CompiledNode()
    word, d = machine.axes[0].word, DEFINES
    word[d["AXIS_SAMPLE"]] = (-100 & 0xFFFF) | (-32768 & 0xFFFF) << 16
    word[d["AXIS_PHASE"]] = 0xFEDC | 101 << 16
    word[d["AXIS_QUADRATURE_COUNT"]] = -5 & 0xFFFFFFFF
    word[d["AXIS_REJECTED_PULSES"]], word[d["AXIS_REJECTED_SAMPLES"]] = 6, 7
    assert machine.ask("encoder", axis=0) == {
        "sin": -100,
        "cos": -32768,
        "phase": 0xFEDC,
        "amplitude": 101,
        "quadrature_count": -5,
        "rejected_pulses": 6,
        "rejected_samples": 7,
        "home_phase": 0,
        "fault_position": 0,
    }
