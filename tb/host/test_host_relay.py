# SPDX-License-Identifier: Apache-2.0
"""moire.client.relay with a relay made of models: sets by hand, a noisy bus, power failures, and
every refusal.
"""

import math
import random
from types import SimpleNamespace

import numpy as np
import pytest

from moire.analysis.harmonic_fit import fit, read_readings
from moire.bus.protocol import NINTH
from moire.bus.transport import Transport
from moire.cli import command_line
from moire.cli.session import Call, Session
from moire.client.relay import (
    COUNTS,
    FIRST,
    SECOND,
    Exchange,
    Relay,
    RelayRefused,
    Settings,
    identity_of,
    make_segment_set,
    make_set,
    terms_of,
)
from moire.errors import BadFile, BusGarbled, NoAnswer, OutOfRange
from tb.bench import seed
from tb.compensate.harmonic_map import exact, term_of
from tb.relay import relay_set
from tb.relay.flash import Flash
from tb.relay.relay_requests import RelayRequests
from tb.serial.frame_check import FrameCheck

K = 4
SOME = [(3.0, 1.0), (0.5, -2.0)]
LIMITS = [
    (dict(counts_per_turn=1608), "counts per turn"),
    (dict(counts_per_turn=2**25 + 1), "counts per turn"),
    (dict(minimum_edge_separation=65536), "minimum_edge_separation"),
    (dict(hysteresis=1.0), "hysteresis"),
    (dict(filter_samples=256), "filter"),
    (dict(index_gate_mask=4), "mask"),
    (dict(index_gate=-1), "gate"),
]


class FakeRelay(Transport):
    """The relay behind its UART, byte by byte. spoil(words) may damage the words in both
    directions.
    """

    def __init__(self, k=K, chip=None, spoil=lambda words: words):
        self.requests, self.check, self.set, self.chip = (
            RelayRequests(),
            FrameCheck(),
            relay_set.RelaySet(k),
            chip or Flash(1 << 21),
        )
        self.k, self.spoil, self.received, self.passed, self.sent = k, spoil, [], 0.0, 0
        self.booting, self.sclk = 3, 0

    def clk(self, **strobes):
        requests, levels = self.requests, 2 * self.set.loaded + 8 * (self.booting > 0)
        words = dict(
            levels=levels,
            source=1,
            orders=self.k,
            identity=self.set.identity,
            position=7,
            correction=-65536 & 0xFFFFFFFF,
        )
        requests.clk(
            answer_ready=1,
            events=32 * self.set.bad,
            pass_ready=int(requests.pass_select),
            **words,
            **strobes,
        )
        self.set.clk(
            start=requests.set_start, valid=requests.set_valid, data=requests.set_data or 0
        )
        if requests.pass_valid:
            requests.clk(pass_done=1, pass_data=self.byte_of_flash(requests.set_data), **words)
        if not requests.pass_select:
            self.chip.pins(1, 0, 0)

    def byte_of_flash(self, sent):
        back = 0
        for n in range(8):
            back = back << 1 | self.chip.pins(0, 0, sent >> 7 - n & 1)
            self.chip.pins(0, 1, sent >> 7 - n & 1)
        self.chip.pins(0, 0, 0)
        return back

    def send(self, words):
        self.sent += 1
        self.booting -= self.booting > 0
        for word in self.spoil(list(words)):
            data, command = word & 0xFF, word >> 8
            valid, good, _, _ = self.check.word(1, data, command)
            self.clk(valid=valid, data=data, command=command, good=good)
        answer = []
        for _ in range(2000):
            if self.requests.answer_valid:
                answer.append(self.requests.answer)
            self.clk()
            if self.requests.state == "receive":
                break
        for _ in range(4):
            self.clk()
        self.received = self.spoil(answer)

    def receive(self, count, timeout_s):
        words, self.received = self.received[:count], self.received[count:]
        self.passed += timeout_s if len(words) < count else 0
        return words

    def now(self):
        return self.passed

    def wait(self, seconds):
        self.passed += seconds


def awake_chip():
    chip = Flash(1 << 21)
    chip.asleep = False
    return chip


def a_set(terms=SOME, counts=32768, **more):
    return make_set(terms, Settings(counts, **more), K)


def noise(source, share):
    def spoil(words):
        if words and source.random() < share:
            how = source.randrange(3)
            if how == 0:
                return words[: source.randrange(len(words))]
            index = source.randrange(len(words))
            words[index] = (
                words[index] ^ 1 << source.randrange(8) if how == 1 else source.randrange(512)
            )
        return words

    return spoil


def test_a_set_equals_the_one_of_the_model_of_the_hardware():
    settings = Settings(
        40_000,
        minimum_edge_separation=7,
        hysteresis=0.125,
        filter_samples=3,
        index_low=True,
        index_gate_mask=2,
        index_gate=1,
    )
    words = [term_of(*term) for term in SOME] + [(0, 0)] * (K - len(SOME))
    assert make_set(SOME, settings, K) == relay_set.image(words, 40_000, 7, 0x2000, 3, 1, 2, 1)


def test_the_terms_of_a_correction_remove_the_error():
    source = np.random.default_rng(seed())
    found = SimpleNamespace(cosine=source.uniform(-50, 50, 3), sine=source.uniform(-50, 50, 3))
    counts = 32768
    for index_at in (0.0, 77.0):
        terms = [term_of(*term) for term in terms_of(found, counts, index_at)]
        for degrees in (0, 10, 123.4, 359):
            expected = sum(
                c * math.cos(k * math.radians(degrees + index_at))
                + s * math.sin(k * math.radians(degrees + index_at))
                for k, (c, s) in enumerate(zip(found.cosine, found.sine, strict=True), 1)
            )
            assert exact(terms, degrees / 360) * 1_296_000 / counts == pytest.approx(
                expected, abs=0.01
            )


@pytest.mark.parametrize(("change", "name"), LIMITS)
def test_settings_outside_their_range_are_refused_by_name(change, name):
    with pytest.raises(OutOfRange, match=name):
        make_set(SOME, Settings(**{"counts_per_turn": 32768, **change}), K)


def test_both_ends_of_the_ranges_are_accepted_by_the_hardware():
    for counts in (COUNTS[0], COUNTS[-1]):
        relay = Relay(FakeRelay())
        assert relay.write(a_set(counts=counts)).levels & 2
    largest = (2**29 - 1) / 65536 * 1.6467602
    for sign in (1, -1):
        assert Relay(FakeRelay()).write(a_set([(sign * largest * 0.999999, 0.0)])).levels & 2
        with pytest.raises(OutOfRange, match="counts together"):
            a_set([(sign * largest * 1.00001, 0.0)])


def test_too_many_orders_and_no_numbers_are_refused():
    with pytest.raises(OutOfRange, match="4 orders, the correction 5"):
        a_set([(0.1, 0.0)] * 5)
    with pytest.raises(OutOfRange, match="no number"):
        a_set([(math.nan, 0.0)])
    with pytest.raises(OutOfRange, match="number of orders"):
        make_set([], Settings(4096), 33)


def test_a_set_of_segments_is_that_of_the_model_and_refuses_what_the_relay_would():
    points = [0.0, 3.5, -2.0, 6.25, 1.0]
    words = [round(point * 65536) for point in (*points, 0)]
    model = relay_set.image(list(zip(words[::2], words[1::2])), 4000, segments=5)
    assert make_segment_set(points, Settings(4000)) == model
    for wrong, sentence in (
        ([0.0], "a number of segments of 1 is outside 2 to 64"),
        ([0.0] * 65, "a number of segments of 65 is outside 2 to 64"),
        ([0.0, 128.0], "128 counts is not below 128"),
        ([0.0, math.inf], "no number"),
    ):
        with pytest.raises(OutOfRange, match=sentence):
            make_segment_set(wrong, Settings(4000))


def test_status_in_words():
    relay = Relay(FakeRelay(chip=awake_chip()))
    relay.write(a_set())
    status = relay.status()
    assert status.orders == K and status.correction == -1.0 and status.position == 7
    identity = f"{identity_of(a_set()):08X}"
    assert f"a set is in force; 4 orders, set {identity}, at power-up from the first copy" in (
        status.words()
    )
    assert "flag" not in status.words()


def test_a_set_for_other_hardware_is_refused_and_the_one_in_force_stays():
    relay = Relay(FakeRelay())
    relay.write(a_set())
    with pytest.raises(
        RelayRefused,
        match=f"refused the set .*{identity_of(a_set()):08X} stays in force: is it one for 4",
    ):
        relay.write(make_set(SOME, Settings(32768), K + 1))
    assert relay.status().flags == 32 and "flag: a set was refused" in relay.status().words()
    assert relay.clear(~32 & 0xFF).flags == 32 and relay.clear(32).flags == 0
    assert relay.status().identity == identity_of(a_set())


def test_a_saved_set_is_in_both_copies_and_is_not_written_twice():
    transport = FakeRelay(chip=awake_chip())
    relay, relay_set = Relay(transport), a_set()
    relay.save(relay_set)
    for address in (FIRST, SECOND):
        assert transport.chip.memory[address : address + len(relay_set)] == relay_set
    transport.chip.power = 0  # nothing more can be written
    relay.save(relay_set)


def test_power_may_fail_anywhere_while_a_set_is_saved():
    source, old, new = random.Random(seed()), a_set(), a_set([(9.0, 0.5)])
    for power in [0, 4095, 4096, 4096 + 20, 2 * 4096 + len(new)] + [
        source.randrange(2 * 4096 + 2 * len(new)) for _ in range(4)
    ]:
        transport = FakeRelay(chip=awake_chip())
        Relay(transport).save(old)
        transport.chip.power = power
        try:
            Relay(transport).save(new)
        except RelayRefused as why:
            assert "does not hold what was written" in str(why)
        copies = [
            bytes(transport.chip.memory[address : address + len(old)])
            for address in (FIRST, SECOND)
        ]
        assert copies[0] in (old, new) or copies[1] in (old, new)


def test_a_noisy_bus_leads_to_the_same_set_or_to_an_error():
    source, done = random.Random(seed()), 0
    for _ in range(10):
        transport = FakeRelay(chip=awake_chip(), spoil=noise(source, 0.2))
        try:
            relay = Relay(transport, tries=12, random_source=source)
            relay.write(a_set())
            relay.save(a_set())
            done += 1
        except (BusGarbled, NoAnswer):
            continue
        assert (
            transport.set.identity == identity_of(a_set())
            and transport.chip.memory[FIRST : FIRST + len(a_set())] == a_set()
        )
    assert done > 5


def test_a_repeated_request_is_not_executed_again():
    lost = []

    def lose_answers(words):
        if words and not words[0] & NINTH and len(lost) < 6:  # an answer
            lost.append(words)
            return []
        return words

    transport = FakeRelay(spoil=lose_answers)
    Relay(transport, tries=8).write(a_set())
    assert (
        len(lost) == 6
        and transport.set.identity == identity_of(a_set())
        and not transport.requests.flags
    )


def test_no_answer_and_noise_are_different_errors():
    with pytest.raises(NoAnswer):
        Relay(FakeRelay(spoil=lambda words: []))
    with pytest.raises(BusGarbled, match="wrong CRC-32"):
        Relay(
            FakeRelay(
                spoil=lambda words: (
                    words if words[0] & NINTH else [*words[:5], words[5] ^ 1, *words[6:]]
                )
            )
        )
    with pytest.raises(OutOfRange, match="2 to 64 bytes"):
        Exchange(bytes(65))


# the commands


def call(transport, *words):
    """Runs a command as the command line does; returns what it prints."""
    printed = []

    class Printing(Call):
        def say(self, values, text):
            printed.append((values, text))

    (planned,) = command_line.parse_call(["relay", *words])
    session = Session(planned.options, lambda options: transport)
    planned.handler(Printing(session, planned), **planned.arguments)
    return printed[0]


def readings_file(tmp_path, amplitude=80.0):
    lines = [
        f"{angle},{amplitude * math.cos(math.radians(angle)):.4f}" for angle in range(0, 361, 10)
    ]
    path = tmp_path / "ring.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_relay_calibrate_writes_saves_and_draws(tmp_path):
    transport, table = FakeRelay(chip=awake_chip()), readings_file(tmp_path)
    reported, text = call(
        transport,
        "calibrate",
        str(table),
        "--counts",
        "32768",
        "--picture",
        str(tmp_path / "ring.png"),
    )
    relay_set = make_set(terms_of(fit(read_readings(table), orders=K), 32768), Settings(32768), K)
    assert (
        reported["orders"] == K
        and reported["before"] == pytest.approx(80)
        and reported["left"] < 0.01
        and "saved in flash" in text
    )
    assert (
        transport.set.identity == identity_of(relay_set)
        and transport.chip.memory[SECOND : SECOND + len(relay_set)] == relay_set
    )
    assert (tmp_path / "ring.png").read_bytes()[1:4] == b"PNG"


def test_relay_calibrate_dry_and_with_a_bad_table_writes_nothing(tmp_path):
    transport, table = FakeRelay(chip=awake_chip()), readings_file(tmp_path)
    assert (
        "nothing written"
        in call(transport, "calibrate", str(table), "--counts", "32768", "--dry", "--orders", "3")[
            1
        ]
    )
    table.write_text(table.read_text().replace("20,", "200,", 1))
    with pytest.raises(BadFile, match="line 3"):
        call(transport, "calibrate", str(table), "--counts", "32768")
    assert transport.sent == 0


def test_relay_calibrate_takes_all_settings(tmp_path):
    transport, table = FakeRelay(chip=awake_chip()), readings_file(tmp_path)
    words = "--hysteresis 0.5 --filter 3 --edge-separation 24 --index-gate b_high --index-low"
    call(transport, "calibrate", str(table), "--counts", "32768", *words.split())
    found = fit(read_readings(table), orders=K)
    settings = Settings(32768, 24, 0.5, 3, True, 3, 2)
    expected = make_set(terms_of(found, 32768), settings, K)
    assert transport.set.identity == identity_of(expected)


def test_relay_calibrate_refuses_a_relay_with_segments(tmp_path):
    transport, table = FakeRelay(chip=awake_chip()), readings_file(tmp_path)
    transport.k = 0
    assert "a table of segments" in call(transport, "status")[1]
    with pytest.raises(OutOfRange, match="by a table of segments, not by harmonics"):
        call(transport, "calibrate", str(table), "--counts", "32768")
    assert transport.set.identity == 0


def test_status_and_clear_report_flags():
    transport = FakeRelay(chip=awake_chip())
    transport.requests.flags = 6
    assert "flag: a whole turn without its index" in call(transport, "status")[1]
    assert call(transport, "clear")[0]["flags"] == 0
