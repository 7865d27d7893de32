# SPDX-License-Identifier: Apache-2.0
"""Links of a machine over Ethernet and SPI on its board, and its recorder of ticks."""

import re
from pathlib import Path

import pytest

from boards import board, generate, machine
from boards.fit import fit
from tb.system.board_files import MILL, edited, over_ethernet, refusal

S0 = "constraints/machines/s0.toml"


@pytest.mark.parametrize(
    "name, balls",
    [
        ("colorlight_i5", {"rx_clk": "H2", "tx_ctl": "K1", "tx_data_3": "J3"}),
        ("colorlight_i9", {"rx_clk": "H2", "tx_ctl": "K1", "tx_data_3": "J3"}),
        ("colorlight_5a_75b_v8_0", {"rx_clk": "J1", "tx_ctl": "L2", "tx_data_3": "R1"}),
    ],
)
def test_a_link_over_ethernet_has_the_pins_of_the_phy_and_its_clock(name, balls, tmp_path):
    design = fit(board.named(name), machine.load(over_ethernet(tmp_path)))
    assert (design.parameters["HAS_LINK"], design.parameters["LINK_CARRIER"]) == (1, 1)
    made = generate.files(design)
    assert f".mac_address(48'd{0x024D_C0A8_0132})," in made["top.sv"]
    assert f".ip_address(32'd{0xC0A8_0132}),  // 192.168.1.50" in made["top.sv"]
    assert ".udp_rx_sender(ethernet_udp_rx_sender)" in made["top.sv"]
    assert (
        ".pads_rx_data({eth_rx_data_3, eth_rx_data_2, eth_rx_data_1, eth_rx_data_0})"
        in (made["top.sv"])
    )
    assert 'FREQUENCY PORT "eth_rx_clk" 125.0 MHZ;' in made["pins.lpf"]
    assert (
        'IOBUF PORT "eth_tx_clk" PULLMODE=NONE IO_TYPE=LVCMOS33 DRIVE=8 SLEWRATE=FAST;'
        in (made["pins.lpf"])
    )
    for port, ball in balls.items():
        assert f'LOCATE COMP "eth_{port}" SITE "{ball}";' in made["pins.lpf"]
    plain = generate.files(fit(board.named(name), machine.named("mill")))
    assert "eth_" not in plain["pins.lpf"] and "ethernet_core" not in plain["top.sv"]


def test_a_phy_with_mii_has_its_clocks_and_takes_its_own_from_the_node(tmp_path):
    arty = board.named("arty_a7_35t")
    made = generate.files(fit(arty, machine.load(over_ethernet(tmp_path))))
    top, xdc = made["top.sv"], made["pins.xdc"]
    assert ".clocks_rx(eth_rx_clk)," in top and ".clocks_tx(eth_tx_clk)," in top
    data = ", ".join(f"eth_tx_data_{n}" for n in (3, 2, 1, 0))
    assert f".pads_tx_data({{{data}}})," in top
    assert "always_ff @(posedge clk) reference <= !reference;" in top and arty.node_hz == 50_000_000
    assert "assign eth_reference = reference;" in top and "assign eth_reset_n = !rst;" in top
    assert "reference(" not in top, "the core has no such pad"
    for clock in ("eth_rx_clk", "eth_tx_clk"):
        assert f"create_clock -name {clock} -period 40.0 [get_ports {clock}]" in xdc
    assert "clock] -group eth_rx_clk -group eth_tx_clk\n" in xdc
    assert "PULLTYPE PULLDOWN} [get_ports eth_rx_dv]" in xdc
    assert "DRIVE 8 SLEW FAST} [get_ports eth_tx_en]" in xdc
    plain = generate.files(fit(arty, machine.named("mill")))
    assert "eth_" not in plain["pins.xdc"] + plain["top.sv"]


def test_a_node_that_cannot_make_the_clock_of_the_phy_is_refused(tmp_path):
    change = ("node_hz = 50_000_000", "node_hz = 40_000_000")
    path = edited(tmp_path, "constraints/arty_a7_35t/board.toml", change)
    assert refusal(lambda: board.load(path)) == (
        f"{path}: [clock] node_hz must be 50000000: the reference of the PHY is half of it"
    )


def test_an_interface_that_the_family_has_no_core_for_is_refused(tmp_path):
    i5 = "constraints/colorlight_i5/board.toml"
    phy = Path(i5).read_text().partition("[ethernet]")[2].partition("\n\n")[0]
    arty = Path("constraints/arty_a7_35t/board.toml").read_text()
    mine = arty.partition("[ethernet]")[2].partition("\n\n")[0]
    path = edited(tmp_path, "constraints/arty_a7_35t/board.toml", (mine, phy))
    path.write_text(re.sub(r'"(H2|P2|K2|L1|N1|P1|G1|K1|H1|J1|J3)"', '"G16"', path.read_text()))
    found = refusal(lambda: board.load(path))
    assert found == f"{path}: [ethernet] rgmii is not built for the family xc7"


def test_the_delays_of_the_phy_are_in_the_range_of_the_part(tmp_path):
    path = edited(
        tmp_path, "constraints/colorlight_i5/board.toml", ("rx_delay_ns = 2.0", "rx_delay_ns = 4")
    )
    found = refusal(lambda: board.load(path))
    assert found == f"{path}: [ethernet] tx_delay_ns and rx_delay_ns must be 0 to 3.1"


@pytest.mark.parametrize(
    "address, more, words",
    [
        ("192.168.1", "", "[node.ethernet] address '192.168.1' is no IP address such as"),
        ("224.0.0.1", "", "[node.ethernet] address '224.0.0.1' is none that a node may have"),
        ("192.168.1.50", "dhcp = true", "[node.ethernet] there is no key dhcp"),
    ],
)
def test_a_wrong_address_is_refused(address, more, words, tmp_path):
    path = over_ethernet(tmp_path, address, more)
    assert refusal(lambda: machine.load(path)).startswith(f"{path}: {words}")


SPI_PINS = """
link_cs_n = "J2 gp23"
link_sclk = "J2 gn23"
link_mosi = "J2 gp24"
link_miso = "J2 gn24"
"""


def over_spi(folder, volts=3.3, pins=SPI_PINS):
    """The mill with its link over SPI on an ULX3S."""
    node = "memory_kib = 64\naddress = 1\n"
    last = 'rs485_driver_enable = "J2 gp22"\n'
    between = f'[between.link_spi]\npart = "none"\nvolts = {volts}\n\n[between.encoder]'
    return edited(
        folder,
        "constraints/machines/mill.toml",
        (node, f'{node}peripherals = ["link_spi"]\n'),
        (last, last + pins),
        ("[between.encoder]", between),
    )


def test_a_link_over_spi_has_four_pins(tmp_path):
    design = fit(board.named("ulx3s_25f"), machine.load(over_spi(tmp_path)))
    assert (design.parameters["HAS_LINK"], design.parameters["LINK_CARRIER"]) == (1, 2)
    made = generate.files(design)
    for name in ("cs_n", "sclk", "mosi"):
        assert f".link_{name}(link_{name})" in made["top.sv"]
    assert "assign link_miso = node_link_miso;" in made["top.sv"]
    assert 'LOCATE COMP "link_miso" SITE "D16";' in made["pins.lpf"]
    for words in ("chip select of the host", "data to the host"):
        assert words in made["wiring.html"]
    plain = generate.files(fit(board.named("ulx3s_25f"), machine.named("mill")))
    assert ".link_cs_n(1'b1)" in plain["top.sv"] and "LINK_CARRIER" not in plain["top.sv"]


def test_the_pll_of_a_link_is_built_where_the_machine_asks_for_it(tmp_path):
    path = over_spi(tmp_path)
    without = fit(board.named("ulx3s_25f"), machine.load(path))
    assert "LINK_PLL" not in without.parameters
    path.write_text(path.read_text().replace('["link_spi"]', '["link_spi"]\nlink_pll = true'))
    with_it = fit(board.named("ulx3s_25f"), machine.load(path))
    assert with_it.parameters == without.parameters | {"LINK_PLL": 1}
    path.write_text(path.read_text().replace('["link_spi"]', "[]"))
    assert "link_pll needs a real-time link" in refusal(lambda: machine.load(path))


def test_a_link_over_spi_with_a_wrong_level_or_beside_another_link_is_refused(tmp_path):
    path = over_spi(tmp_path, volts=5.0)
    found = refusal(lambda: fit(board.named("ulx3s_25f"), machine.load(path)))
    assert "link_cs_n comes with 5 V" in found
    path = over_spi(tmp_path, pins=SPI_PINS.replace("link_miso", "# link_miso"))
    found = refusal(lambda: fit(board.named("ulx3s_25f"), machine.load(path)))
    assert "link_miso has no pin" in found
    path.write_text(path.read_text().replace('["link_spi"]', '["link", "link_spi"]'))
    assert "a node has one of them" in refusal(lambda: machine.load(path))


def test_a_link_over_ethernet_needs_a_phy_and_no_serial_line(tmp_path):
    path = over_ethernet(tmp_path)
    found = refusal(lambda: fit(board.named("ulx3s_85f"), machine.load(path)))
    assert found.startswith(f"{path}: [node.ethernet] needs a board with an Ethernet PHY")
    both = tmp_path / "both.toml"
    both.write_text(path.read_text().replace("[node]", '[node]\nperipherals = ["link"]'))
    assert "a node has one of them" in refusal(lambda: machine.load(both))


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('interface = "rgmii"', 'interface = "sgmii"', "interface 'sgmii' is none of mii, rgmii"),
        ('"K2", "L1", "N1", "P1"', '"K2", "L1", "N1"', "rx_data must name 4 pins"),
        ('tx_clk = ["G1"]', 'tx_clk = ["ZZ"]', "has no pin ZZ"),
    ],
)
def test_a_wrong_phy_is_refused(old, new, words, tmp_path):
    path = edited(tmp_path, "constraints/colorlight_i5/board.toml", (old, new))
    assert words in refusal(lambda: board.load(path))


def test_a_recorder_of_ticks_is_built_where_its_memory_has_room(tmp_path):
    path = edited(tmp_path, S0, ("filters = 2\n", "filters = 2\nscope_words = 16384\n"))
    found = fit(board.named("ulx3s_85f"), machine.load(path))
    assert found.parameters["SCOPE_WORDS"] == 16384
    small = refusal(lambda: fit(board.named("ulx3s_25f"), machine.load(path)))
    assert "need about 93 block RAM" in small, "57, and 36 for the recorder"
    assert fit(board.named("ulx3s_85f"), machine.named("s0")).parameters["SCOPE_WORDS"] == 0


@pytest.mark.parametrize(
    "file, words, message",
    [
        (S0, 1000, "scope_words = 1000 must be 0 or a power of two from 256 to 65536"),
        (S0, 128, "scope_words = 128 must be 0 or a power of two"),
        (MILL, 256, "scope_words needs image axis or stream"),
    ],
)
def test_a_recorder_of_ticks_that_cannot_be_is_refused(file, words, message, tmp_path):
    path = edited(tmp_path, file, ("memory_kib", f"scope_words = {words}\nmemory_kib"))
    assert message in refusal(lambda: machine.load(path))
