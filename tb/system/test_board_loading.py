# SPDX-License-Identifier: Apache-2.0
"""`make load`, `make flash` and `make firmware BOARD=…`: the loader's command line, with a program
that records it in place of the loader; new firmware in a placed design equals a new placement with
that firmware; and what is refused.
"""

import json
import random
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import pytest

from boards import block_ram, board, build, clocks, load, machine, packing
from boards.family import FAMILIES
from boards.fit import fit
from boards.toml_file import Misfit
from figures import synthesis
from figures.synthesis import SynthesisError
from tb.bench import ROOT, seed
from tb.system.board_files import MILL, ULX3S, edited, refusal

FAKE = """#!{python}
import sys
with open({record!r}, "w") as record:
    record.write("\\n".join(sys.argv[1:]))
print({said!r}, file=sys.stderr)
sys.exit({code})
"""


@pytest.fixture
def loader(tmp_path, monkeypatch):
    """loader(words, code) makes a program that says these words and ends with this code the loader,
    and returns the file in which it records its options.
    """

    def make(said="", code=0):
        program, record = tmp_path / "loader", tmp_path / "options"
        program.write_text(
            FAKE.format(python=sys.executable, record=str(record), said=said, code=code)
        )
        program.chmod(0o755)
        monkeypatch.setenv("LOADER", str(program))
        return record

    monkeypatch.setattr(build, "OUT", tmp_path)
    monkeypatch.setattr(load, "OUT", tmp_path)
    monkeypatch.setattr(build, "state", lambda one: f"{hash(repr(one)):x}")
    return make


def design(board_name="ulx3s_85f", machine_name="mill"):
    return fit(board.named(board_name), machine.named(machine_name))


def made(one, folder):
    """The bitstream of a design, as far as the loader sees."""
    file = folder / one.name / one.board.part.family.bitstream
    file.parent.mkdir()
    file.write_bytes(b"bitstream")
    (file.parent / packing.PLACED).write_text("placed")
    build.Note(build.state(one), "1", "program").write(file.parent)
    return file


@pytest.mark.parametrize(
    "board_name, machine_name, flash, options",
    [
        ("ulx3s_85f", "mill", False, ["-b", "ulx3s", "-m"]),
        ("ulx3s_85f", "mill", True, ["-b", "ulx3s", "-f", "-o", "0"]),
        ("icebreaker", "counter_box", True, ["-b", "ice40_generic", "-f", "-o", "0"]),
        ("tang_nano_9k", "relay", True, ["-b", "tangnano9k", "-f", "-o", "0"]),
        ("colorlight_i5", "mill", False, ["-b", "colorlight-i5", "-c", "cmsisdap", "-m"]),
    ],
)
def test_the_loader_gets_board_cable_and_file(
    board_name, machine_name, flash, options, loader, tmp_path
):
    record, one = loader("Load SRAM: DONE"), design(board_name, machine_name)
    file = made(one, tmp_path)
    load.load(one, flash)
    assert record.read_text().split("\n") == [*options, str(file)]


def test_further_options_of_the_loader_come_after_ours(loader, tmp_path):
    record, one = loader(), design()
    file = made(one, tmp_path)
    load.load(one, False, ["--ftdi-serial", "D00123"])
    words = ["-b", "ulx3s", "-m", "--ftdi-serial", "D00123", str(file)]
    assert record.read_text().split("\n") == words


@pytest.mark.parametrize("flash", [False, True])
def test_what_is_executed_from_the_flash_is_written_there_before_the_bitstream(
    flash, loader, tmp_path, monkeypatch
):
    loader()
    one, written = design("tang_nano_20k", "s0_flash"), []
    file = made(one, tmp_path)
    monkeypatch.setattr(load, "run", lambda *words: written.append(words))
    load.load(one, flash, ["-v"])
    board_words = ["-b", "tangnano20k"]
    where = ["-f", "-o", "0"] if flash else ["-m"]
    assert written == [
        (
            [*board_words, "--external-flash", "-o", str(0x70_0000)],
            ["-v"],
            file.parent / "firmware_flash.flash",
        ),
        ([*board_words, *where], ["-v"], file),
    ]
    assert one.parameters["FLASH_START"] == 0x70_0000


def test_the_offset_of_the_flash_is_that_of_the_board_file(loader, tmp_path):
    change = ('board = "ulx3s"\n', 'board = "ulx3s"\nflash_offset = 0x20_0000\n')
    path = edited(tmp_path, ULX3S, change)
    one = fit(board.load(path), machine.named("mill"))
    assert load.options(one, True) == ["-b", "ulx3s", "-f", "-o", "2097152"]


def test_without_a_bitstream_the_command_that_makes_it_is_named(loader, tmp_path):
    record = loader()
    found = refusal(lambda: load.load(design(), False))
    file = tmp_path / "ulx3s_85f-mill" / "moire.bit"
    assert found == f"{file} is missing: make board BOARD=ulx3s_85f MACHINE=mill makes it"
    assert not record.exists()


def test_a_missing_loader_is_named_with_what_gets_it(loader, tmp_path, monkeypatch):
    one = design()
    made(one, tmp_path)
    monkeypatch.delenv("LOADER", raising=False)
    monkeypatch.setattr(load, "PROGRAM", tmp_path / "none")
    found = refusal(lambda: load.load(one, False))
    assert found == "openFPGALoader is missing: make loader gets it, or set LOADER=program"
    monkeypatch.setenv("LOADER", "no-such-loader")
    found = refusal(lambda: load.load(one, False))
    assert found == "LOADER=no-such-loader: there is no such program"


def test_a_board_that_is_configured_from_its_flash_only_is_not_loaded(loader, tmp_path):
    record, one = loader(), design("icebreaker", "relay")
    made(one, tmp_path)
    assert refusal(lambda: load.load(one, False)) == (
        "constraints/icebreaker/board.toml: the board is configured from its flash only: make "
        "flash BOARD=icebreaker MACHINE=relay"
    )
    assert not record.exists()


@pytest.mark.parametrize(
    "said, code, words",
    [
        (  # no cable
            "unable to open ftdi device: -3 (device not found)\n"
            "\x1b[31mJTAG init failed with: unable to open ftdi device\x1b[0m",
            1,
            "JTAG init failed with: unable to open ftdi device; connect the board by its USB cable",
        ),
        (  # another board at the cable
            "mismatch between target's idcode and bitstream idcode\nFail",
            1,
            "mismatch between target's idcode and bitstream idcode; the part at the cable is not "
            "that of the board file: choose another BOARD",
        ),
        (
            "Jtag: support for cmsisdap was not enabled at compile time\nJTAG init failed",
            1,
            "Jtag: support for cmsisdap was not enabled at compile time; this build of the loader ",
        ),
        (
            "loader: error while loading shared libraries: libftdi1.so.2: cannot open shared",
            127,
            "libftdi1.so.2: cannot open shared; install the library",
        ),
        ("Error: cannot find board 'x'", 1, "Error: cannot find board 'x'"),
        ("", 1, "it printed no reason"),
        ("FAIL", 0, "FAIL"),  # the part does not start, and the loader ends well
    ],
)
def test_what_the_loader_says_when_it_fails_is_passed_on(said, code, words, loader, tmp_path):
    loader(said, code)
    one = design()
    made(one, tmp_path)
    found = refusal(lambda: load.load(one, False))
    assert found.startswith("loader failed: ") and words in found


def test_a_bitstream_of_earlier_files_is_not_loaded(loader, tmp_path):
    """As after a `make board` that missed its clock, or of another machine of the same name."""
    options, one = loader(), design()
    made(one, tmp_path)
    other = fit(one.board, machine.load(edited(tmp_path, MILL, ("address = 1", "address = 2"))))
    assert other.name == one.name
    found = refusal(lambda: load.load(other, False))
    assert "ulx3s_85f-mill has no placement of this board, machine and RTL: make board" in found
    assert not options.exists()


def test_a_bitstream_of_the_tool_of_the_vendor_is_loaded_as_it_is(loader, tmp_path):
    options, one = loader(), design("arty_a7_35t")
    file = tmp_path / one.name / "moire.bit"
    file.parent.mkdir()
    file.write_bytes(b"bitstream")
    load.load(one, False)
    assert options.read_text().splitlines()[-1] == str(file)


@pytest.mark.parametrize("command, words", [("--flash", "flash"), ("--", "SRAM")])
def test_the_command_says_where_the_bitstream_is(
    command, words, loader, tmp_path, monkeypatch, capsys
):
    loader()
    file = made(design(), tmp_path)
    names = ["load", "--board", "ulx3s_85f", "--machine", "mill", command]
    monkeypatch.setattr(sys, "argv", names)
    load.main()
    assert capsys.readouterr().out.startswith(f"{file} is in the {words} of ULX3S")


def test_the_command_needs_a_board_and_a_machine(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["load", "--board", "", "--machine", "mill"])
    with pytest.raises(SystemExit, match="load: say which board and which machine"):
        load.main()


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('board = "ulx3s"', 'cable = "ft231X"', "[loader] board is missing"),
        ('board = "ulx3s"', 'board = "ulx3s"\ncabel = "x"', "[loader] there is no key cabel"),
        ("[loader]", "[loaders]", "loader is missing"),
    ],
)
def test_a_wrong_loader_in_a_board_file_is_refused(old, new, words, tmp_path):
    path = edited(tmp_path, ULX3S, (old, new))
    assert refusal(lambda: board.load(path)) == f"{path}: {words}"


# Firmware in the block RAMs of a placed design

BYTES = 24576  # of the memory
TOP = """module top (
    input  wire  clock,
    input  wire [3:0] write,
    output logic read
);
    logic [31:0] address, found;
    always_ff @(posedge clock) address <= address + 1;
    node_memory #(.BYTES({bytes}), .FIRMWARE("{file}")) u_memory (
        .clk(clock), .write, .write_address(address[12:0]), .wdata(address),
        .read_address(address[12:0]), .rdata(found)
    );
    assign read = ^found;
endmodule
"""


def firmware():
    """Words as a firmware has them: random ones, then zeros."""
    source = random.Random(seed())
    return [source.getrandbits(32) for _ in range(BYTES // 6)] + [0] * (BYTES // 12)


OLD, NEW = block_ram.placeholder(BYTES // 4), firmware()


@pytest.fixture(scope="module")
def netlist():
    """netlist(words, family): of a memory with these words, in a folder of its own."""
    print(f"SEED={seed()}")
    with tempfile.TemporaryDirectory(dir=synthesis.BUILD.parent) as name:

        def make(words, family):
            folder = Path(tempfile.mkdtemp(dir=name))
            source, image = folder / "top.sv", folder / "words.hex"
            image.write_text("".join(f"{word:08x}\n" for word in words))
            source.write_text(TOP.format(bytes=BYTES, file=image.relative_to(ROOT)))
            last = f"synth_{family} -top {{top}} -json {{netlist}}"
            tag = f"block_ram-{folder.parent.name}-{folder.name}"
            return synthesis.yosys(source, {}, last, tag)

        yield make


def test_new_firmware_in_a_placed_ecp5_equals_a_new_placement_with_it(netlist):
    """Bit for bit, in the whole configuration."""

    def config(words):
        found = netlist(words, "ecp5")
        written = found.with_name("placed")
        part = ["--25k", "--package", "CABGA381", "--lpf-allow-unconstrained"]
        synthesis.placed(found, synthesis.NEXTPNR_ECP5, part, 25, 1, "--textcfg", written)
        return written.read_text()

    assert block_ram.ECP5.filled(config(OLD), OLD, NEW) == config(NEW)


PLL = """module top (input wire clock, output logic led);
    wire clk;
    (* {attributes} *)
    EHXPLLL #(.CLKI_DIV(1), .CLKFB_DIV(2), .CLKOP_DIV(12), .FEEDBK_PATH("CLKOP")) u_clock (
        .CLKI(clock), .CLKFB(clk), .CLKOP(clk), .RST(1'b0), .STDBY(1'b0)
    );
    always_ff @(posedge clk) led <= !led;
endmodule
"""


def test_the_analog_part_of_a_placed_pll_equals_that_of_attributes_of_the_instance():
    """Bit for bit, in the whole configuration."""

    def config(attributes):
        with tempfile.TemporaryDirectory(dir=synthesis.BUILD.parent) as name:
            source = Path(name) / "top.sv"
            source.write_text(PLL.format(attributes=attributes))
            last = "synth_ecp5 -top {top} -json {netlist}"
            cells = FAMILIES["ecp5"].read_cells
            found = synthesis.yosys(source, {}, last, f"pll-{source.parent.name}", cells)
            part = ["--25k", "--package", "CABGA381", "--lpf-allow-unconstrained"]
            written = found.with_name("placed")
            synthesis.placed(found, synthesis.NEXTPNR_ECP5, part, 25, 1, "--textcfg", written)
            return written.read_text()

    told = ", ".join(f'{name} = "{value}"' for name, value in clocks.ECP5_ANALOG.items())
    with_zeros = config('FREQUENCY_PIN_CLKI = "25.0"')
    made = packing.with_settings(with_zeros, clocks.ECP5_ANALOG)
    assert made == config(f'FREQUENCY_PIN_CLKI = "25.0", {told}') != with_zeros


def test_settings_that_a_placed_design_lacks_are_refused():
    with pytest.raises(SynthesisError, match="the placed design has 0 settings ICP_CURRENT, not 1"):
        packing.with_settings("word: ICP_CURRENTS 00000\n", {"ICP_CURRENT": 12})


def test_new_firmware_in_a_gowin_netlist_equals_that_of_a_new_synthesis(netlist):
    """nextpnr leaves the contents of block RAMs as they are in the netlist of Yosys, and so does
    this: the netlist with other contents is all that the placement and the packer see.
    """

    def memories(text):
        return block_ram.gowin_rams(json.loads(text))

    old, new = (netlist(words, "gowin").read_text() for words in (OLD, NEW))
    filled = block_ram.GOWIN.filled(old, OLD, NEW)
    assert memories(filled) == memories(new) != memories(old)


def test_contents_that_are_not_found_whole_are_refused():
    pieces = [bits for bits, _ in block_ram.pieces(OLD)]
    rams = {str(n): bits for n, bits in enumerate(pieces[:31])}  # one bit of each word is missing
    with pytest.raises(block_ram.ContentsError) as why:
        block_ram.replaced(rams, OLD, NEW)
    words = len(OLD)
    assert str(why.value) == f"{31 * words} of {32 * words} bits of the memory are in block RAMs"


def test_only_a_soft_core_of_a_part_that_is_placed_has_a_placeholder():
    names = [("colorlight_i5", "mill"), ("tang_nano_20k", "mill"), ("icebreaker", "counter_box")]
    names += [("icebreaker", "relay"), ("tang_nano_20k", "s0_flash"), ("arty_a7_35t", "mill")]
    designs = [design(*each) for each in names]
    assert [one.in_block_ram for one in designs] == [True, True, False, False, True, False]
    assert designs[0].parameters["FIRMWARE"].endswith("colorlight_i5-mill/placeholder.hex")
    assert designs[-1].parameters["FIRMWARE"].endswith("arty_a7_35t-mill/steps_3_axes.hex")


@pytest.fixture
def calls(monkeypatch):
    """The calls of the tools of builds in a folder of their own, which do nothing; the firmware is
    what firmware(word) sets.
    """
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        made, words = [], {"firmware": "0"}
        made.append(words.__setitem__)

        def program(one, folder):
            packing.program_of(one, folder).write_text(words["firmware"])
            return "firmware"

        def place(one, folder, _netlist, number):
            made.append(f"place {number}")
            (folder / packing.PLACED).write_text("placed")
            return one.board.node_hz / 1e6, {}

        def pack(command, _step, _log):
            made.append("pack")
            (ROOT / command[-1]).write_text((ROOT / command[-2]).read_text())

        for attribute, value in {
            "OUT": Path(name),
            "make_firmware": program,
            "synthesise": lambda *_: made.append("synthesis"),
            "place": place,
            "used": lambda *_: "",
        }.items():
            monkeypatch.setattr(build, attribute, value)
        monkeypatch.setattr(packing, "run", pack)
        monkeypatch.setattr(packing, "with_settings", lambda text, _: text)
        filled = lambda _, text, old, new: f"{text} with {new}"
        monkeypatch.setattr(block_ram.Format, "filled", filled)
        yield made


def quiet(_words):
    """Reports nothing."""


def test_new_firmware_alone_is_packed_and_not_placed(calls):
    set_word, one = calls.pop(), design("colorlight_i5")
    assert build.bitstream(one, 2, quiet).read_text() == "placed with [0]"
    assert calls == ["synthesis", "place 2", "pack"]
    set_word("firmware", "a")
    assert build.new_firmware(one, quiet).read_text() == "placed with [10]"
    assert calls[3:] == ["pack"]
    set_word("firmware", "b")
    assert build.bitstream(one, 2, quiet).read_text() == "placed with [11]"
    assert calls[4:] == ["pack"]
    build.bitstream(one, 2, quiet)
    build.new_firmware(one, quiet)
    assert not calls[5:], "nothing has changed"
    build.bitstream(one, 3, quiet)
    assert calls[5:] == ["synthesis", "place 3", "pack"]


def test_another_option_of_the_packer_makes_another_bitstream_of_the_same_placement(calls):
    calls.pop()
    one = design("colorlight_i5")
    build.bitstream(one, 2, quiet)
    part = replace(one.board.part, pack=["--compress"])
    other = replace(one, board=replace(one.board, part=part))
    build.bitstream(other, 2, quiet)
    assert calls == ["synthesis", "place 2", "pack", "pack"]


def test_the_firmware_of_a_serial_core_is_appended_without_a_placement(calls):
    set_word, one = calls.pop(), design("icebreaker", "counter_box")
    set_word("firmware", "one")
    build.bitstream(one, 1, quiet)
    set_word("firmware", "two")
    made = build.new_firmware(one, quiet).read_bytes()
    assert calls == ["synthesis", "place 1", "pack", "pack"]
    assert made == b"placed".ljust(one.firmware_address, b"\xff") + b"two"


def test_a_placement_that_did_not_end_is_made_again(calls, monkeypatch):
    calls.pop()
    one = design("colorlight_i5")
    monkeypatch.setattr(build, "place", lambda *_: (1.0, {}))
    with pytest.raises(SynthesisError, match="reaches 1.0 MHz with seed 1 and needs 50"):
        build.bitstream(one, 1, quiet)
    with pytest.raises(Misfit, match="has no placement"):
        build.new_firmware(one, quiet)


def test_a_placement_for_a_figure_is_not_taken_for_that_of_make_board(monkeypatch):
    """It replaces what `make board` has placed, with whatever seed and clock."""
    one = design("colorlight_i5")
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        folder = Path(name)
        (folder / packing.PLACED).write_text("placed")
        (folder / "moire.bit").write_text("of another seed")
        build.Note("state", "1", "program").write(folder)
        assert build.Note.read(folder) == build.Note("state", "1", "program")
        monkeypatch.setattr(build, "placed", lambda *_: (1.0, {}))
        build.place(one, folder, folder / "netlist.json", 3)
        assert build.Note.read(folder) == build.Note() and not (folder / "moire.bit").exists()


@pytest.mark.parametrize(
    "names, words",
    [
        (
            ("colorlight_i5", "mill"),
            "colorlight_i5-mill has no placement of this board, machine and RTL: make board "
            "BOARD=colorlight_i5 MACHINE=mill makes it",
        ),
        (("icebreaker", "relay"), "constraints/machines/relay.toml: a relay has no firmware"),
        (
            ("arty_a7_35t", "mill"),
            "constraints/arty_a7_35t/board.toml: the firmware is part of the netlist of a "
            "XC7A35T-1L: make board BOARD=arty_a7_35t MACHINE=mill makes both",
        ),
    ],
)
def test_firmware_that_has_no_bitstream_to_go_into_is_refused(names, words, calls):
    calls.pop()
    found = refusal(lambda: build.new_firmware(design(*names), quiet))
    assert found.endswith(words) and not calls


def test_a_placed_design_without_the_placeholder_is_refused():
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        one, folder = design("colorlight_i5"), Path(name)
        (folder / packing.PLACED).write_text(".device LFE5U-25F\n")
        words = 256 * one.machine.memory_kib
        packing.program_of(one, folder).write_text("0\n" * words)
        with pytest.raises(SynthesisError) as why:
            packing.pack(one, folder)
        assert str(why.value) == (
            "the firmware of colorlight_i5-mill cannot be replaced: 0 of "
            f"{32 * words} bits of the memory are in block RAMs"
        )


def test_a_machine_of_another_folder_is_named_by_its_file(tmp_path):
    path = tmp_path / "mill.toml"
    path.write_text((ROOT / "constraints" / "machines" / "mill.toml").read_text())
    one = fit(board.named("ulx3s_85f"), machine.load(path))
    assert one.arguments == f"BOARD=ulx3s_85f MACHINE={path}"
