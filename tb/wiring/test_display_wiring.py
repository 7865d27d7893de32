# SPDX-License-Identifier: Apache-2.0
"""The wires of the display port: words reach the pins in order, at 1 MHz."""

WORDS = (0x0C01, 0x9630, 0x4BA5)


def test_words_are_queued_and_sent_at_1_mhz(display_port):
    port = display_port
    assert (port.get("free"), port.get("sending")) == (16, 0)
    assert (port.get("cs_n"), port.get("sclk")) == (1, 0)
    port.watch("cs_n", "sclk", "sdi")
    for word in WORDS:
        port.push(word)
    port.run(4)
    assert port.get("sending") == 1 and 13 <= port.get("free") < 16
    port.run(600)
    level, shown, bits, rises = dict(cs_n=1, sclk=0, sdi=0), [], [], []
    for change in port.changes():
        level[change.pin] = change.value
        if change.pin == "sclk" and change.value:
            assert not level["cs_n"]
            bits.append(level["sdi"])
            rises.append(change.cycle)
        if change.pin == "cs_n" and change.value:
            shown.append((len(bits), int("".join(map(str, bits)), 2)))
            bits = []
    assert shown == [(16, word) for word in WORDS]
    assert min(b - a for a, b in zip(rises, rises[1:])) == 8
    assert (port.get("free"), port.get("sending")) == (16, 0)


def test_a_full_queue_is_seen(display_port):
    for n in range(17):
        display_port.push(n)
    display_port.run(2)
    assert display_port.get("free") == 0
    display_port.run(17 * 150)
    assert display_port.get("free") == 16
