# SPDX-License-Identifier: Apache-2.0
"""The wires of the peripherals, from the registers of each to the device at its pins."""

from tb.peripheral.angle_frame import frame
from tb.peripheral.i2c_master import NO_BUS, NOT_ACKNOWLEDGED, OK, READ, START, STOP, WRITE
from tb.wiring.node import CLK_HZ
from tb.wiring.peripherals import BIT, MS, REGISTERS

CUT = [0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14]  # S4: left Ctrl + W


def inject(peripherals, sequence=CUT):
    for n, byte in enumerate(sequence):
        peripherals.write("ps2_inject", data=byte, last=int(n == len(sequence) - 1))


def test_the_build_register_names_them_all(peripherals):
    assert peripherals.read("built") == dict(i2c=1, ps2=1, peer=1, sensor=1, display=1, edm=1)


def test_the_pins_are_idle_after_the_reset(peripherals):
    idle = dict(display_cs_n=1, display_sclk=0, peer_tx=1, i2c_scl_low=0, i2c_sda_low=0)
    lines = ("keyboard_clock_low", "keyboard_data_low", "edm_clock_low", "edm_data_low")
    for pin, level in (idle | dict.fromkeys(lines, 0)).items():
        assert peripherals.get(pin) == level, pin


def test_bytes_go_into_the_eeprom_and_come_back(peripherals):
    peripherals.active = {"eeprom"}
    state = dict(free=128, busy=0, owned=0, scl=1, sda=1)
    assert peripherals.read("i2c_state") == state
    head = [(START, 0), (WRITE, 0xA0), (WRITE, 0x12), (WRITE, 0x40)]
    peripherals.write("i2c", command=START)
    assert peripherals.read("i2c_state")["busy"] == 1
    peripherals.clk(400)
    assert peripherals.read("i2c_state") == state | dict(owned=1, scl=0, sda=0)
    answers = peripherals.i2c(*head[1:], (WRITE, 0x96), (WRITE, 0x3A), (STOP, 0))
    assert [result for result, _ in answers] == [OK] * 7
    assert peripherals.eeprom.memory[0x1240:0x1242] == bytes([0x96, 0x3A])
    answers = peripherals.i2c((START, 0), (WRITE, 0xA0), (STOP, 0))
    assert answers[1][0] == NOT_ACKNOWLEDGED, "it writes"
    peripherals.clk(6 * MS)
    peripherals.eeprom.memory[0x1242] = 0  # a third byte would pull the line low at the stop
    commands = [*head, (START, 0), (WRITE, 0xA1), (READ, 1), (READ, 0), (STOP, 0)]
    answers = peripherals.i2c(*commands)
    assert {result for result, _ in answers} == {OK}
    assert [byte for _, byte in answers[6:8]] == [0x96, 0x3A]
    assert peripherals.read("i2c_state") == state
    for command in commands:
        peripherals.write("i2c", command=command[0])
    assert peripherals.read("i2c_state")["free"] < 128


def test_a_stuck_i2c_bus_is_reported(peripherals):
    peripherals.active = {"eeprom"}
    for stuck, level in (((0, 1), "sda"), ((1, 0), "scl")):
        peripherals.stuck = stuck
        peripherals.clk(10)
        assert peripherals.read("i2c_state")[level] == 0
        if level == "sda":
            assert [result for result, _ in peripherals.i2c((START, 0))] == [NO_BUS]
        peripherals.stuck = (0, 0)
        peripherals.clk(10)
    assert [result for result, _ in peripherals.i2c((START, 0), (STOP, 0))] == [OK, OK]


def test_a_person_types_and_a_sequence_is_injected_after_it(peripherals):
    peripherals.active = {"keyboard", "edm"}
    peripherals.write("ps2_idle", value=25)
    peripherals.keyboard.outbox = [0x1C, 0xF0, 0x1C]
    peripherals.clk(MS)
    assert peripherals.read("ps2_state")["busy"] == 1
    inject(peripherals)
    peripherals.clk(2)
    assert peripherals.read("ps2_state") == dict(free=32 - len(CUT), injecting=0, busy=1)
    peripherals.until(lambda: len(peripherals.machine.received) == 4)
    assert peripherals.read("ps2_state")["injecting"] == 1
    peripherals.until(lambda: len(peripherals.machine.received) == 9)
    peripherals.clk(MS)
    assert peripherals.machine.received == [0x1C, 0xF0, 0x1C, *CUT]
    assert peripherals.read("ps2_state") == dict(free=32, injecting=0, busy=0)
    assert peripherals.read("ps2_typed") == 3
    assert not any(peripherals.read("ps2_errors").values())
    assert peripherals.read("ps2_glitches") == 0


def test_the_silence_before_an_injection_is_its_setting(peripherals):
    peripherals.active = {"edm"}
    peripherals.write("ps2_idle", value=40)
    peripherals.clk(30 * MS)
    inject(peripherals)
    peripherals.clk(8 * MS)
    assert peripherals.read("ps2_state")["injecting"] == 0
    peripherals.clk(4 * MS)
    assert peripherals.read("ps2_state")["injecting"] == 1


def test_a_queue_of_keys_is_dropped_but_for_the_sequence_under_way(peripherals):
    peripherals.active = {"keyboard", "edm"}
    peripherals.write("ps2_idle", value=20)
    for _ in range(2):
        inject(peripherals, CUT[:3])
    peripherals.until(lambda: len(peripherals.machine.received) == 1)
    peripherals.write("ps2_state", drop=1)
    peripherals.clk(45 * MS)
    assert peripherals.machine.received == CUT[:3]
    assert peripherals.read("ps2_state") == dict(free=32, injecting=0, busy=0)


def test_a_command_of_the_machine_reaches_the_keyboard(peripherals):
    peripherals.active = {"keyboard", "edm"}
    peripherals.machine.orders = [0xED]
    peripherals.until(lambda: peripherals.keyboard.commands == [0xED])
    peripherals.until(lambda: peripherals.machine.received)
    assert peripherals.machine.received == [0xFA]
    assert peripherals.read("ps2_typed") == 0, "it is an answer"
    assert not any(peripherals.read("ps2_errors").values())


def test_the_keyboard_is_held_for_100_us_before_an_injection(peripherals):
    peripherals.active = {"edm"}
    peripherals.write("ps2_idle", value=20)
    inject(peripherals)
    peripherals.until(lambda: peripherals.get("keyboard_clock_low"))
    held = 0  # cycles, up to 40 less than they were
    while held < MS and not peripherals.get("edm_clock_low"):
        peripherals.clk()
        held += 1
    assert MS // 10 - 40 <= held < MS


def test_a_sequence_is_injected_after_a_command_without_a_keyboard(peripherals):
    peripherals.active = {"edm"}
    peripherals.write("ps2_idle", value=20)
    peripherals.machine.orders = [0xED]
    peripherals.until(lambda: peripherals.read("ps2_errors")["unsent"])
    inject(peripherals)
    peripherals.until(lambda: len(peripherals.machine.received) == len(CUT))
    assert peripherals.machine.received == CUT


def test_an_answer_that_begins_within_a_second_answers_its_command(peripherals):
    """The second ends in the middle of the byte."""
    peripherals.active = {"keyboard", "edm"}
    commands = []
    peripherals.keyboard.answer = commands.append
    peripherals.machine.orders = [0xED]
    peripherals.until(lambda: commands)
    peripherals.active = set()
    peripherals.clk(999 * MS + MS // 2)
    peripherals.active = {"keyboard", "edm"}
    peripherals.keyboard.outbox = [0xFA]
    peripherals.until(lambda: peripherals.machine.received)
    assert peripherals.read("ps2_typed") == 0


def test_a_damaged_command_of_the_machine_reaches_the_keyboard_damaged(peripherals):
    peripherals.active = {"keyboard", "edm"}
    machine = peripherals.machine
    whole = machine.order

    def damaged(byte):
        machine.order = whole
        return whole(byte, damaged=1)

    machine.order, machine.orders = damaged, [0xED]
    peripherals.until(lambda: machine.received)
    assert machine.received == [0xFE], "the keyboard asks for it again"
    assert not peripherals.keyboard.commands


def test_ps2_is_busy_from_the_first_bit_of_the_keyboard_on(peripherals):
    peripherals.active = {"keyboard"}
    assert peripherals.read("ps2_state")["busy"] == 0
    peripherals.keyboard.outbox = [0x1C]
    for _ in range(MS):
        peripherals.clk()
        if peripherals.keyboard.clock_low:
            break
    peripherals.clk(40)
    assert peripherals.read("ps2_state")["busy"] == 1


def test_each_error_of_ps2_is_counted(peripherals):
    zero = dict(keyboard_damaged=0, command_damaged=0, unsent=0, aborted=0)
    peripherals.active = {"keyboard", "edm"}
    peripherals.keyboard.damage = 1.0
    peripherals.keyboard.outbox = [0x1C]
    peripherals.until(lambda: peripherals.machine.damaged)
    peripherals.keyboard.damage = 0.0
    peripherals.until(lambda: peripherals.machine.received == [0x1C])
    errors = peripherals.read("ps2_errors")
    assert errors["keyboard_damaged"] >= 1
    assert errors == zero | dict(keyboard_damaged=errors["keyboard_damaged"])
    peripherals.write("ps2_errors")
    peripherals.machine.orders = [0xED]
    peripherals.active = {"edm"}  # the keyboard is pulled out
    peripherals.clk(60 * MS)
    errors = peripherals.read("ps2_errors")
    assert errors["unsent"] >= 1 and errors == zero | dict(unsent=errors["unsent"])


def test_frames_that_the_machine_cuts_and_damaged_commands_are_counted(peripherals):
    peripherals.active = {"keyboard", "edm"}
    peripherals.write("ps2_idle", value=20)
    inject(peripherals, CUT[:1])
    peripherals.until(lambda: peripherals.read("ps2_state")["injecting"])
    peripherals.until(lambda: peripherals.get("edm_clock_low"))
    peripherals.clk(300)
    peripherals.active = {"keyboard"}
    peripherals.set(edm_clock=0)
    peripherals.clk(300)
    assert peripherals.read("ps2_errors")["aborted"] >= 1
    peripherals.write("ps2_errors")
    # a command whose parity is wrong: the machine holds its data line low throughout
    peripherals.set(edm_data=0)
    peripherals.clk(20)
    peripherals.set(edm_clock=1)
    peripherals.clk(3 * MS)
    assert peripherals.read("ps2_errors")["command_damaged"] >= 1


def test_glitches_on_the_lines_of_ps2_are_counted(peripherals):
    peripherals.clk(100)
    for line in ("keyboard_clock", "keyboard_data", "edm_clock", "edm_data"):
        peripherals.write("ps2_glitches")
        peripherals.set(**{line: 0})
        peripherals.clk(1)
        peripherals.set(**{line: 1})
        peripherals.clk(20)
        assert peripherals.read("ps2_glitches") == 1, line


def test_bytes_pass_to_and_from_the_peer(peripherals):
    assert peripherals.read("peer_state") == dict(transmit_free=64, sending=0)
    peripherals.watch("peer_tx")
    there = [0x5A, 0x01, 0x80]
    for byte in there:
        peripherals.write("peer_transmit", value=byte)
    state = peripherals.read("peer_state")
    assert state["sending"] == 1 and state["transmit_free"] < 64
    peripherals.clk(40 * BIT)
    edges = peripherals.changes()
    starts, found = 0, []
    for change in edges:
        if change.cycle >= starts and not change.value:
            level = [
                [c.value for c in edges if c.cycle <= change.cycle + n * BIT + BIT // 2][-1]
                for n in range(1, 9)
            ]
            found.append(sum(bit << n for n, bit in enumerate(level)))
            starts = change.cycle + 9 * BIT + BIT // 2
    assert found == there
    assert peripherals.read("peer_state") == dict(transmit_free=64, sending=0)
    back = [0xA5, 0x7E]
    peripherals.send("peer_rx", back)
    for byte in back:
        assert peripherals.read("peer_receive") == dict(data=byte, present=1)
        peripherals.clk(2)
    assert peripherals.read("peer_receive")["present"] == 0
    assert peripherals.read("peer_errors") == dict(framing=0, overruns=0)


def test_the_peer_port_counts_what_it_lost(peripherals):
    peripherals.send("peer_rx", range(66))
    peripherals.clk(2 * BIT)
    assert peripherals.read("peer_errors") == dict(framing=0, overruns=2)
    peripherals.send("peer_rx", [0], stop=0)
    peripherals.clk(2 * BIT)
    assert peripherals.read("peer_errors") == dict(framing=1, overruns=2)
    for n in range(64):
        assert peripherals.read("peer_receive") == dict(data=n, present=1)
        peripherals.clk(2)
    assert peripherals.read("peer_receive")["present"] == 0


def test_the_bit_times_of_the_two_serial_ports_are_their_own(peripherals):
    peripherals.write("peer_bit_time", value=16 * 2 * BIT)
    peripherals.send("sensor_rx", frame(3, 99))
    assert peripherals.read("sensor_state") == dict(sequence_number=3, stale=0)
    peripherals.send("peer_rx", [0x69], bit=2 * BIT)
    assert peripherals.read("peer_receive") == dict(data=0x69, present=1)


def test_a_reset_in_the_middle_of_a_character_ends_it(peripherals):
    for pin, data in (("peer_rx", [0xA5]), ("sensor_rx", frame(5, 77))):
        peripherals.set(**{pin: 0})
        peripherals.clk(3 * BIT)
        peripherals.reset()
        for port in ("peer", "sensor"):
            peripherals.write(f"{port}_bit_time", value=16 * BIT)
        peripherals.send(pin, data)
        if pin == "peer_rx":
            assert peripherals.read("peer_receive") == dict(data=0xA5, present=1)
    assert peripherals.read("sensor_state") == dict(sequence_number=5, stale=0)


def test_a_serial_line_counts_as_idle_during_a_reset(peripherals):
    """A level that is low then and afterwards is a start bit."""
    bit = 35  # cycles, the setting after a reset
    peripherals.reset(level=0)
    peripherals.set(sensor_rx=1)
    peripherals.send("peer_rx", [0xFF], bit=bit)
    assert peripherals.read("peer_receive") == dict(data=0xFF, present=1)
    peripherals.reset(level=0)
    peripherals.set(peer_rx=1)
    peripherals.send("sensor_rx", frame(5, 77), bit=bit)
    assert peripherals.read("sensor_state") == dict(sequence_number=5, stale=0)


def test_a_reset_ends_all_that_is_under_way(peripherals):
    names = [name for name in REGISTERS if name.endswith(("_state", "_errors", "_typed"))]
    before = {name: peripherals.read(name) for name in [*names, "ps2_glitches", "edm_status"]}
    peripherals.write("ps2_idle", value=1)
    inject(peripherals)
    peripherals.until(lambda: peripherals.get("edm_clock_low"))
    peripherals.write("i2c", command=START)
    peripherals.write("i2c", command=WRITE, data=0x55)
    peripherals.clk(400)
    for value in range(3):
        peripherals.write("peer_transmit", value=value)
        peripherals.write("display", value=value)
    peripherals.clk(40)
    assert peripherals.get("i2c_scl_low") and not peripherals.get("display_cs_n")
    assert not peripherals.get("peer_tx")
    peripherals.reset()
    test_the_pins_are_idle_after_the_reset(peripherals)
    lines = ("keyboard_clock_low", "keyboard_data_low", "edm_clock_low", "edm_data_low")
    peripherals.watch("peer_tx", "display_cs_n", "i2c_scl_low", "i2c_sda_low", *lines)
    peripherals.clk(20 * MS)
    assert not peripherals.changes()
    assert {name: peripherals.read(name) for name in before} == before


def test_a_byte_of_a_frame_without_a_stop_bit_breaks_it(peripherals):
    peripherals.write("sensor_gap", value=50 * BIT)
    good = frame(5, 77)
    peripherals.send("sensor_rx", good[:3])
    peripherals.send("sensor_rx", good[3:4], stop=0)
    peripherals.clk(2 * BIT)
    assert peripherals.read("sensor_errors") == dict(crc=0, broken=1, missed=0)
    peripherals.send("sensor_rx", good)
    assert peripherals.read("sensor_state") == dict(sequence_number=5, stale=0)


def test_an_angle_its_age_and_its_number_are_read(peripherals):
    peripherals.write("sensor_stale_after", value=20 * MS)
    peripherals.write("sensor_gap", value=50 * BIT)
    assert peripherals.read("sensor_state")["stale"] == 1
    peripherals.send("sensor_rx", frame(7, 0x89ABCDEF))
    peripherals.clk(5)
    assert peripherals.read("sensor_state") == dict(sequence_number=7, stale=0)
    reading = peripherals.read("sensor_reading")
    assert reading & 0xFFFFFFFF == 0x89ABCDEF
    assert 70 * BIT <= reading >> 32 <= 74 * BIT
    peripherals.send("sensor_rx", frame(11, 2))
    peripherals.send("sensor_rx", frame(12, 3)[:7] + b"\x00")
    peripherals.clk(5)
    assert peripherals.read("sensor_errors") == dict(crc=1, broken=0, missed=3)
    assert peripherals.read("sensor_frames") == 2
    peripherals.send("sensor_rx", frame(13, 4)[:3])
    peripherals.clk(60 * BIT)
    peripherals.send("sensor_rx", frame(13, 4)[3:])
    assert peripherals.read("sensor_errors")["broken"] == 1
    peripherals.write("sensor_errors", clear=1)
    peripherals.clk(2)
    assert not any(peripherals.read("sensor_errors").values())
    peripherals.clk(21 * MS)
    assert peripherals.read("sensor_state")["stale"] == 1
    assert REGISTERS["sensor_reading"]["value"].width == 64


def shown(changes):
    """The words that a display takes, in the changes of its pins."""
    level, words, bits = dict(display_cs_n=1, display_sclk=0, display_data=0), [], []
    for change in changes:
        level[change.pin] = change.value
        if change.pin == "display_sclk" and change.value:
            assert not level["display_cs_n"]
            bits.append(level["display_data"])
        if change.pin == "display_cs_n" and change.value:
            words.append(int("".join(map(str, bits)), 2))
            bits = []
    return words


def test_words_reach_the_display(peripherals):
    words = [0x0C01, 0x9630]
    assert peripherals.read("display_state") == dict(free=16, sending=0)
    peripherals.watch("display_cs_n", "display_sclk", "display_data")
    for word in words:
        peripherals.write("display", value=word)
    state = peripherals.read("display_state")
    assert state["sending"] == 1 and state["free"] < 16
    peripherals.clk(400)
    assert shown(peripherals.changes()) == words
    assert peripherals.read("display_state") == dict(free=16, sending=0)


def test_status_inputs_are_filtered_and_their_changes_kept(peripherals):
    none = dict(inputs=0, rose_0=0, rose_1=0, fell_0=0, fell_1=0)
    peripherals.write("edm_filter", value=2)
    peripherals.clk(4 * MS)
    peripherals.write("edm_status", rose_0=1, rose_1=1, fell_0=1, fell_1=1)
    for bit in (0, 1):
        peripherals.set(edm_status=1 << bit)
        peripherals.clk(MS)
        assert peripherals.read("edm_status") == none, "not yet stable"
        peripherals.clk(3 * MS)
        assert peripherals.read("edm_status") == none | {"inputs": 1 << bit, f"rose_{bit}": 1}
        peripherals.set(edm_status=0)
        peripherals.clk(4 * MS)
        assert peripherals.read("edm_status") == none | {f"rose_{bit}": 1, f"fell_{bit}": 1}
        peripherals.write("edm_status", rose_0=1, rose_1=1, fell_0=1, fell_1=1)
        assert peripherals.read("edm_status") == none


# ------------------------------------------------------------------ the peripherals of a node


def test_bytes_go_from_a_node_into_the_eeprom_and_come_back(node):
    """The clock line is low until all commands are in the queue: an access takes some bits."""
    node.active = {"eeprom"}
    head = [(START, 0), (WRITE, 0xA0), (WRITE, 0x12), (WRITE, 0x40)]
    back = [(START, 0), (WRITE, 0xA1), (READ, 1), (READ, 0), (STOP, 0)]
    node.eeprom.memory[0x1241:0x1243] = bytes([0x3A, 0])
    for commands in ([*head, (WRITE, 0x96), (STOP, 0)], [*head, *back]):
        node.set(i2c_scl=0)
        for command, value in commands:
            named = {"acknowledge": value} if command == READ else {"data": value}
            node.write("peripherals.i2c", command=command, **named)
        node.clk(12_000)
        assert not node.read("peripherals.i2c_state", "busy")
        answers = [node.fields("peripherals.i2c_answer") for _ in commands]
        assert {answer["result"] for answer in answers} == {OK}
        node.clk(node.eeprom.write_clk + 100)
    assert node.eeprom.memory[0x1240] == 0x96
    assert [answer["data"] for answer in answers[6:8]] == [0x96, 0x3A]


def test_keys_and_commands_pass_through_a_node(node):
    node.active = {"keyboard", "edm"}
    node.keyboard.outbox = [0x1C, 0xF0, 0x1C]
    node.clk(50_000)
    assert node.machine.received == [0x1C, 0xF0, 0x1C]
    node.machine.orders = [0xED]
    node.clk(50_000)
    assert node.keyboard.commands == [0xED] and node.machine.received[3:] == [0xFA]
    assert not node.bits("peripherals.ps2_errors")
    node.active = {"keyboard"}
    node.set(edm_clock=0)
    node.keyboard.outbox = [0x2B]
    node.clk(20_000)
    node.active = {"keyboard", "edm"}
    node.clk(20_000)
    assert node.machine.received[4:] == [0x2B], "it waits while the machine holds the clock"


def test_a_node_talks_to_its_peer_and_hears_its_sensor(node):
    for port in ("peer", "sensor"):
        node.write(f"peripherals.{port}_bit_time", 16 * BIT)
    node.watch("peer_tx")
    node.write("peripherals.peer_transmit", 0x5A)
    node.run(20 * BIT)
    assert node.characters("peer_tx", node.changes()) == [0x5A]
    node.character("peer_rx", 0xA5)
    node.run(10)
    assert node.fields("peripherals.peer_receive") == {"data": 0xA5, "present": 1}
    for byte in frame(7, 0x89ABCDEF):
        node.character("sensor_rx", byte)
    node.run(10)
    assert node.read("peripherals.sensor_reading") & 0xFFFFFFFF == 0x89ABCDEF
    assert not node.bits("peripherals.sensor_errors")


def test_a_node_shows_words_and_hears_status_inputs(node):
    node.write("peripherals.edm_filter", 1)
    node.watch("display_cs_n", "display_sclk", "display_data")
    node.write("peripherals.display", 0x9630)
    node.run(2000)
    assert shown(node.changes()) == [0x9630]
    assert not node.get("display_sclk"), "it rests low"
    for inputs in (1, 2, 0):
        node.set(edm_status=inputs)
        node.run(5 * CLK_HZ // 1000)
        assert node.read("peripherals.edm_status", "inputs") == inputs


def test_a_reset_of_a_node_ends_what_its_peripherals_send(node):
    node.write("peripherals.peer_bit_time", 16 * 100)
    for byte in (0, 1):
        node.write("peripherals.peer_transmit", byte)
    node.run(300)
    assert node.get("peer_tx") == 0
    node.set(rst=1)
    node.run(4)
    assert node.get("peer_tx") == 1
    node.set(rst=0)
    assert node.fields("peripherals.peer_state") == {"transmit_free": 64, "sending": 0}
