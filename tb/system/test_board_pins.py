# SPDX-License-Identifier: Apache-2.0
"""The pins of boards and packages are those of others: Amaranth, what is printed, data sheets."""

import pytest
from amaranth_boards.arty_a7 import ArtyA7_35Platform
from amaranth_boards.ice40_hx8k_b_evn import ICE40HX8KBEVNPlatform
from amaranth_boards.icebreaker import ICEBreakerPlatform
from amaranth_boards.orangecrab_r0_2 import OrangeCrabR0_2_25FPlatform
from amaranth_boards.tang_nano_9k import TangNano9kPlatform
from amaranth_boards.ulx3s import ULX3S_25F_Platform, ULX3S_85F_Platform

from boards import board


def pins_of(platform, number):
    """{pin: ball} of a connector of Amaranth's."""
    found = next(each for each in platform.connectors if each.number == number)
    return dict(found.mapping)


def resource(platform, name, number=0):
    """The balls of a resource of Amaranth's that has one set of pins."""
    found = next(r for r in platform.resources if (r.name, r.number) == (name, number))
    return found.ios[0].names


def signal(platform, name, part):
    """The ball of one signal of a resource of Amaranth's."""
    found = next(r for r in platform.resources if (r.name, r.number) == (name, 0))
    return next(io.ios[0].names[0] for io in found.ios if io.name == part)


@pytest.mark.parametrize(
    "name, platform", [("ulx3s_25f", ULX3S_25F_Platform), ("ulx3s_85f", ULX3S_85F_Platform)]
)
def test_the_pins_of_the_ulx3s_are_those_of_amaranth(name, platform):
    ours, theirs = board.named(name), pins_of(platform, 0)
    found = {}
    for pins in ours.connectors.values():
        for pin, pad in pins.items():
            found[pin[2:] + {"gp": "+", "gn": "-"}[pin[:2]]] = pad.ball
    assert found == theirs
    assert [ours.clock.ball] == resource(platform, "clk25")
    assert ours.on_board["usb_rx"].ball == signal(platform, "uart", "rx")
    assert ours.on_board["usb_tx"].ball == signal(platform, "uart", "tx")
    switches = [resource(platform, "switch", n)[0] for n in range(4)]
    assert [pad.ball for pad in ours.address] == switches
    leds = {resource(platform, "led", n)[0] for n in range(8)}
    assert {pad.ball for pad in ours.leds.values()} == leds
    assert platform.device in ours.part.name and platform.package in ours.part.name


FLASH_OF_AMARANTH = {
    **{"flash_cs_n": "cs", "flash_sclk": "clk"},
    **{"flash_mosi": "copi", "flash_miso": "cipo"},
}


def test_the_pins_of_the_icebreaker_are_those_of_amaranth():
    ours, platform = board.named("icebreaker"), ICEBreakerPlatform
    for number, name in enumerate(("PMOD1A", "PMOD1B", "PMOD2")):
        theirs = pins_of(platform, number)
        assert {pin: pad.ball for pin, pad in ours.connectors[name].items()} == theirs
    assert [ours.clock.ball] == resource(platform, "clk12")
    assert ours.on_board["usb_rx"].ball == signal(platform, "uart", "rx")
    assert ours.on_board["usb_tx"].ball == signal(platform, "uart", "tx")
    for mine, part in FLASH_OF_AMARANTH.items():
        assert ours.on_board[mine].ball == signal(platform, "spi_flash_1x", part)
    leds = {ours.leds["sending"].ball: "led_r", ours.leds["running"].ball: "led_g"}
    for ball, name in leds.items():
        assert [ball] == resource(platform, name)


def test_the_pins_of_the_hx8k_board_are_those_of_amaranth():
    ours, platform = board.named("ice40_hx8k_evn"), ICE40HX8KBEVNPlatform
    for name, pins in ours.connectors.items():
        theirs = pins_of(platform, int(name[1:]))
        assert {pin: pad.ball for pin, pad in pins.items()}.items() <= theirs.items()
    assert [ours.clock.ball] == resource(platform, "clk12")
    for mine, part in {"usb_rx": "rx", "usb_tx": "tx"}.items():
        assert ours.on_board[mine].ball == signal(platform, "uart", part)
    for mine, part in FLASH_OF_AMARANTH.items():
        assert ours.on_board[mine].ball == signal(platform, "spi_flash_1x", part)
    leds = [pad.ball for pad in ours.leds.values()]
    assert leds == [resource(platform, "led", n)[0] for n in range(len(leds))]
    assert (platform.device, platform.package) == ("iCE40HX8K", "CT256")


def test_the_pins_of_the_arty_are_those_of_amaranth():
    ours, platform = board.named("arty_a7_35t"), ArtyA7_35Platform
    connectors = {(each.name, each.number): dict(each.mapping) for each in platform.connectors}
    for number, name in enumerate(("JA", "JB", "JC", "JD")):
        found = {pin: pad.ball for pin, pad in ours.connectors[name].items()}
        assert found == connectors["pmod", number]
    theirs = connectors["ck_io", 0]
    for pin, pad in ours.connectors["IO"].items():
        assert theirs[f"io{pin}"] == pad.ball
    assert [ours.clock.ball] == resource(platform, "clk100")
    for mine, part in {"usb_rx": "rx", "usb_tx": "tx"}.items():
        assert ours.on_board[mine].ball == signal(platform, "uart", part)
    for n, pad in enumerate(ours.address):
        assert [pad.ball] == resource(platform, "switch", n)
    for n, pad in enumerate(ours.leds.values()):
        assert [pad.ball] == resource(platform, "led", n)
    assert ours.ethernet
    phy = {port: pad.ball for port, pad in ours.ethernet.pads.items()}
    assert [phy.pop("eth_reference")] == resource(platform, "eth_clk25")
    mii = next(each for each in platform.resources if each.name == "eth_mii")
    theirs = {part.name: part.ios[0].names for part in mii.ios}
    assert [phy.pop("eth_reset_n")] == theirs["rst"]
    for name in ("rx_clk", "rx_dv", "rx_data", "tx_clk", "tx_en", "tx_data"):
        balls = [ball for port, ball in phy.items() if port.startswith(f"eth_{name}")]
        assert balls == theirs[name]
    device = f"{platform.device}{platform.package}-{platform.speed}"
    assert ours.part.device.lower() == device.lower()


def test_the_pins_of_the_orangecrab_are_those_of_amaranth():
    ours, platform = board.named("orangecrab"), OrangeCrabR0_2_25FPlatform
    theirs, names = pins_of(platform, 0), {"miso": "cipo", "mosi": "copi"}
    found = {names.get(pin, pin): pad.ball for pin, pad in ours.connectors["IO"].items()}
    assert found == theirs
    assert [ours.clock.ball] == resource(platform, "clk")
    leds = {"drive_fault": "r", "running": "g", "sending": "b"}
    for mine, colour in leds.items():
        assert ours.leds[mine].ball == signal(platform, "rgb_led", colour)
    assert ours.part.name == f"{platform.device}-{platform.speed}{platform.package}C"


def test_the_pins_of_the_tang_nano_9k_are_those_of_amaranth():
    """Amaranth has no connectors of this board, but what is beside them."""
    ours, platform = board.named("tang_nano_9k"), TangNano9kPlatform
    assert [ours.clock.ball] == resource(platform, "clk27")
    for mine, part in {"usb_rx": "rx", "usb_tx": "tx"}.items():
        assert ours.on_board[mine].ball == signal(platform, "uart", part)
    for mine, part in FLASH_OF_AMARANTH.items():
        assert ours.on_board[mine].ball == signal(platform, "spi_flash_1x", part)
    assert ours.part.device == platform.part


def test_pins_that_are_printed_on_a_board_are_their_own_names():
    for name in ("tang_nano_9k", "tang_nano_20k"):
        for pins in board.named(name).connectors.values():
            assert all(pin == pad.ball for pin, pad in pins.items())


@pytest.mark.parametrize(
    "family, device, package, count",
    [  # I/O pins by the data sheets; of a Gowin part without the four of JTAG
        ("ice40", "up5k", "sg48", 39),
        ("ice40", "hx8k", "ct256", 206),
        ("xc7", "xc7a35ticsg324-1L", "csg324", 210),
        ("gowin", "GW2AR-LV18QN88C8/I7", "QN88", 66 - 4),
        ("gowin", "GW1NR-LV9QN88PC6/I5", "QN88P", 71 - 4),
    ],
)
def test_packages_have_the_pins_of_their_data_sheets(family, device, package, count):
    assert len(board.package_pins(family, device, package)) == count
