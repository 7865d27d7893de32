# SPDX-License-Identifier: Apache-2.0
"""moire.bus.protocol: known bytes, every kind of failure of an exchange, and random noise against
the compiled firmware.
"""

import random

import pytest

from moire.bus.protocol import (
    FROM_NODE,
    MOST_AXES,
    ODD_ADDRESSES,
    TO_NODE,
    Exchange,
    State,
    Timing,
    command_byte,
    frame,
    layout,
    parse_reply,
    request_body,
    sync_words,
)
from moire.client.bus import Bus
from moire.errors import BusError, BusGarbled, NoAnswer, OutOfRange
from moire.made.bus_tables import LONGEST_BODY, OPERATIONS
from tb.bench import seed
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus, spoil

SEED = seed()
ENABLE = request_body("enable", 7, axis=0, on=1)


def reply_words(first=0x51, sequence=7, operation=3, cause=0):
    return [first] + list(frame(first, bytes([sequence, operation, cause])))


def test_the_bytes_of_a_known_exchange():
    # the worked example of docs/protocol.md, its CRC-32 by a bitwise program
    exchange = Exchange(1, ENABLE)
    assert exchange.words_to_send() == [0x121] and exchange.words_to_send() == []
    exchange.feed([0x61])
    assert exchange.words_to_send() == [0x04, 0x07, 0x03, 0x00, 0x01, 0x86, 0x67, 0x24, 0x60, 0x111]
    exchange.feed([0x51, 0x03, 0x07, 0x03, 0x00, 0xCE, 0xFB, 0x86, 0xFF])
    assert exchange.finished and exchange.result() == (7, 3, 0, {}) and exchange.events == []


def test_the_crc_is_the_one_of_ethernet():
    def by_definition(several):
        register = 0xFFFFFFFF
        for byte in several:
            register ^= byte
            for _ in range(8):
                register = register >> 1 ^ (0xEDB88320 if register & 1 else 0)
        return register ^ 0xFFFFFFFF

    assert by_definition(b"123456789") == 0xCBF43926
    assert frame(0x21, bytes([7, 1]))[-4:] == by_definition([0x21, 2, 7, 1]).to_bytes(4, "little")


def test_command_bytes_match_the_8031_stage():
    assert command_byte(1, 1) == 0b0001_0001 and command_byte(2, 2) == 0b0010_0010
    for address in (0, 16, -1):
        with pytest.raises(OutOfRange, match="1 to 15"):
            command_byte(address, 1)


def test_addresses_of_odd_parity_are_those_with_an_even_command_byte():
    """A sender with a parity bit for the ninth one: odd parity sets it if the ones are even."""
    assert list(ODD_ADDRESSES) == [
        address
        for address in range(1, 16)
        if all(command_byte(address, way).bit_count() % 2 == 0 for way in (TO_NODE, FROM_NODE))
    ]


@pytest.mark.parametrize("number", [0, 77, 255, 256, 511])
def test_the_words_of_a_sync_are_a_frame_for_address_0(number):
    assert sync_words(number) == [0x120, *frame(0x20, bytes([number & 0xFF]))]


def test_negative_positions_are_two_complement_little_endian():
    assert request_body("move", 1, axis=0, target=-2) == bytes([1, 5, 0, 0xFE]) + b"\xff" * 7


def test_values_that_do_not_fit_are_refused_before_sending():
    with pytest.raises(OutOfRange, match="axis u8, target i64"):
        request_body("move", 1, axis=0, target=1 << 63)
    with pytest.raises(TypeError):
        request_body("move", 1, axis=0, target=0, speed=1)


def test_a_mask_of_axes_has_a_bit_for_each_axis():
    masks = [dict(OPERATIONS[name].request)["axes"] for name in ("start", "start_at_sync")]
    assert masks == ["u8", "u8"] and MOST_AXES == 8


def test_every_body_fits_the_longest():
    for operation in OPERATIONS.values():
        assert (
            2 + layout(operation.request).size <= LONGEST_BODY
            and 3 + layout(operation.reply).size <= LONGEST_BODY
        )
    for length in (0, LONGEST_BODY + 1):
        with pytest.raises(OutOfRange):
            frame(0x21, bytes(length))
    assert len(frame(0x21, bytes(LONGEST_BODY))) == LONGEST_BODY + 5


def test_a_reply_of_the_wrong_length_is_none():
    assert parse_reply(b"\x01\x03") is None
    assert parse_reply(b"\x01\x03\x00\x00") is None
    assert parse_reply(b"\x01\x03\x05\x00") is None
    assert parse_reply(b"\x01\x63\x05").cause == 5


def test_a_refusal_has_a_cause_and_nothing_else():
    refusal = bytes([7, 3, 5])
    assert parse_reply(refusal) == (7, 3, 5, {})
    for wrong in (b"", refusal[:2], refusal + b"\0", refusal + b"\0\0"):
        assert parse_reply(wrong) is None


def test_the_usual_times_and_tries():
    exchange = Exchange(1, ENABLE)
    assert exchange.tries == 5 and exchange.timing.quiet == 0.02
    assert exchange.timing.character == 11 / 115200  # 11 bits at the usual speed
    assert exchange.timeout_s == pytest.approx(0.1 + 11 / 115200)


def test_a_finished_exchange_expects_nothing_and_takes_nothing():
    exchange = Exchange(1, ENABLE)
    exchange.feed([0x61, *reply_words()])
    assert exchange.finished and exchange.expected == 0
    exchange.feed([0x51, 0x1FF])
    assert exchange.events == [] and exchange.result().operation == 3


def test_silence_is_no_answer_after_all_tries():
    exchange = Exchange(9, ENABLE, tries=3)
    for _ in range(20):
        if exchange.finished:
            break
        exchange.words_to_send()
        exchange.silence()
    assert exchange.attempts == 3 and exchange.events == ["no answer"] * 3
    with pytest.raises(NoAnswer, match="nobody answers at address 9, asked 3 times") as caught:
        exchange.result()
    assert caught.value.address == 9


@pytest.mark.parametrize(
    "words, reason",
    [
        ([0x62], "62 came instead of 61"),  # another node
        ([0x161], "9th bit"),
        ([0x61, 0x61], "61 came instead of 51"),
        ([0x61, 0x51, 0], "length of 0"),
        ([0x61, 0x51, LONGEST_BODY + 1], "length of 65"),
        ([0x61] + reply_words()[:-1] + [reply_words()[-1] ^ 1], "wrong CRC-32"),
        ([0x61, 0x51] + list(frame(0x51, b"\x07\x03")), "wrong length"),
        ([0x61, 0x51] + list(frame(0x52, b"\x07\x03\x00")), "wrong CRC-32"),
    ],
)
def test_each_garbled_answer_is_named(words, reason):
    exchange = Exchange(1, ENABLE, tries=1)
    exchange.feed(words)
    assert exchange.state == State.FAILED
    with pytest.raises(BusGarbled, match=reason):
        exchange.result()


def test_an_answer_that_breaks_off_is_garbled_and_not_missing():
    exchange = Exchange(1, ENABLE, tries=1)
    exchange.feed([0x61, 0x51, 3, 7])
    exchange.silence()
    with pytest.raises(BusGarbled, match="broke off"):
        exchange.result()


def test_an_old_reply_repeats_the_same_words_at_once():
    exchange = Exchange(1, ENABLE, tries=2)
    exchange.words_to_send()
    exchange.feed([0x61])
    first = exchange.words_to_send()
    exchange.feed(reply_words(sequence=6))
    assert exchange.events == ["old reply"] and exchange.words_to_send() == [0x121]
    exchange.feed([0x61])
    assert exchange.words_to_send() == first
    exchange.feed(
        reply_words(sequence=7, operation=2, cause=3)
    )  # the right number with another operation is old too
    with pytest.raises(BusGarbled, match="never received the whole request"):
        exchange.result()


def test_after_a_garbled_answer_the_bus_is_silent_before_the_repetition():
    exchange = Exchange(1, ENABLE)
    exchange.words_to_send()
    exchange.feed([0x55])
    assert (
        exchange.words_to_send() == []
        and exchange.state == State.QUIET
        and exchange.timeout_s == Timing().quiet
    )
    exchange.feed([0x61, 0x51, 0x100])  # the remainder of the garbled answer
    assert exchange.words_to_send() == []
    exchange.silence()
    assert exchange.words_to_send() == [0x121]


def test_an_exchange_on_a_bus_that_is_never_silent_is_given_up():
    exchange = Exchange(1, ENABLE, tries=3)
    for _ in range(3 * Exchange.LONGEST_NOISE):
        exchange.words_to_send()
        exchange.feed([0xAA])
    with pytest.raises(BusGarbled):
        exchange.result()


def test_a_repetition_begins_after_1000_words_of_noise_each_time():
    exchange = Exchange(1, ENABLE)
    for attempt in (1, 2):
        exchange.feed([0x55, *[0xAA] * 999])
        assert exchange.state == State.QUIET and exchange.attempts == attempt
        exchange.feed([0xAA])
        assert exchange.state == State.AWAIT_READY and exchange.attempts == attempt + 1


def test_the_timeout_grows_with_the_number_of_expected_words():
    exchange = Exchange(1, ENABLE, timing=Timing(character=0.001, answer=0.1, quiet=0.01))
    assert exchange.timeout_s == pytest.approx(0.101) and exchange.expected == 1
    exchange.feed([0x61, 0x51, 3])
    assert exchange.expected == 7 and exchange.timeout_s == pytest.approx(0.107)
    exchange.feed([7, 3, 0])
    assert exchange.expected == 4


def test_a_request_without_an_operation_is_answered_as_operation_0():
    exchange = Exchange(1, bytes([7]), tries=1)
    exchange.feed([0x61, *reply_words(operation=0, cause=1)])
    assert exchange.finished and exchange.result() == (7, 0, 1, {})


def test_the_shortest_reply_that_is_waited_for_has_one_byte():
    exchange = Exchange(1, ENABLE)
    exchange.feed([0x61, 0x51, 1])
    assert exchange.state == State.AWAIT_BODY and exchange.expected == 5 and not exchange.events


# ------------------------------------------------------------------ with a node at the other end


def test_a_request_with_any_word_lost_is_repeated_and_executed_once():
    for to_nodes in (True, False):
        for position in range(60):
            node = BusNode()
            wire, seen = Rs485Bus(node), []

            def lose(word, position=position, seen=seen):
                seen.append(word)
                return [] if len(seen) == position + 1 else [word]

            setattr(wire, "to_nodes" if to_nodes else "from_nodes", lose)
            bus = Bus(wire, random_source=random.Random(1))
            bus.request(1, "enable", axis=0, on=1)
            bus.request(1, "set_parameter", axis=0, parameter=15, value=4)
            assert node.executed == ["enable", "set_parameter"], position
            assert node.written("set_parameter") == [dict(axis=0, parameter=15, value=4)]
            if position >= len(seen):
                break
        assert position > 5


def test_a_repeated_request_is_counted_by_node_and_host():
    node = BusNode()
    wire = Rs485Bus(node)
    dropped = iter([True])
    wire.from_nodes = lambda word: [] if word == 0x51 and next(dropped, False) else [word]
    bus = Bus(wire)
    bus.request(1, "enable", axis=0, on=1)
    assert node.counters["repeated"] == 1 and node.executed == ["enable"]
    assert bus.statistics.repeats == 1 and bus.statistics.garbled == 1


def test_any_noise_ends_in_the_correct_reply_or_in_a_bus_error():
    print("SEED", SEED)
    source = random.Random(SEED)
    done = failed = 0
    for _ in range(150):
        node = BusNode()
        wire = Rs485Bus(node)
        share = source.choice([0.001, 0.01, 0.05, 0.3])
        wire.to_nodes, wire.from_nodes = spoil(source, share), spoil(source, share)
        bus = Bus(wire, random_source=source)
        for _ in range(8):
            value = source.randrange(0, 16777216)
            before = len(node.executed)
            try:
                bus.request(1, "set_parameter", axis=0, parameter=15, value=value)
                assert node.parameter("kp") == value and len(node.executed) == before + 1
                done += 1
            except BusError:
                assert len(node.executed) <= before + 1
                failed += 1
        # after the noise the bus works again
        wire.to_nodes = wire.from_nodes = lambda word: [word]
        assert bus.request(1, "get_parameter", axis=0, parameter=15)["value"] == node.parameter(
            "kp"
        )
    assert done > 300 and failed > 50


def test_sequence_numbers_begin_at_random_and_wrap():
    node = BusNode()
    bus = Bus(Rs485Bus(node), random_source=random.Random(SEED))
    numbers = []
    for _ in range(300):
        bus.request(1, "enable", axis=0, on=0)
        numbers.append(node.reply()[0])
    assert all((b - a) % 256 == 1 for a, b in zip(numbers, numbers[1:])) and 0 in numbers
    assert node.counters["repeated"] == 0
    firsts = set()
    for number in range(20):
        other = Bus(Rs485Bus(node), random_source=random.Random(number))
        other.request(1, "enable", axis=0, on=0)
        firsts.add(node.reply()[0])
    assert len(firsts) > 10


def test_a_new_host_with_the_number_of_the_last_one_still_gets_fresh_answers():
    node = BusNode()
    wire = Rs485Bus(node)

    class Always5(random.Random):
        def randrange(self, *_):
            return 5

    axis = Bus(wire, random_source=Always5()).axis()
    before = axis.status().position_nm
    node.axes[0].machine += 65536
    axis = Bus(
        wire, random_source=Always5()
    ).axis()  # identify may be taken for a repetition, since its answer is the same
    assert axis.status().position_nm == pytest.approx(before + 800)
