# SPDX-License-Identifier: Apache-2.0
"""machine.toml, and what uses its names: the command line, moire.connect and moire.aio."""

import asyncio
import inspect
import json
import re

import pytest

import moire
from boards import machine as build_machine
from boards.toml_file import Misfit
from experiments import machines, s0_stage
from moire import aio, description
from moire import machine as machine_module
from moire.bus.twin_port import AXES, MACHINES
from moire.client import axis as blocking_axis
from moire.client import node as blocking_node
from moire.client import remedies
from moire.errors import BadFile, BusError, MotionFailed, PortError, Refused, UnknownName
from moire.made import bus_tables
from tables import faults
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence
from twin.compiled.tables import FAULT, PERIOD

TEXT = """\
text = "a test machine"
port = "/dev/ttyTest"

[axes.x]
node = 1
unit = "um"
wiring = "grating on J3"

[axes.x.parameters]
velocity = "3mm/s"

[axes.z]
node = 2
axis = 1
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """No file of the user's is found."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    for name in (description.VARIABLE, description.PORT_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.fixture
def file(folder):
    made = folder / "machine.toml"
    made.write_text(TEXT)
    return made


# ------------------------------------------------------------------ the file


def test_the_file_that_is_named_holds_before_the_variable_the_folder_and_the_settings(
    folder, monkeypatch
):
    assert description.describe() == description.Description()
    texts = {}
    for name in ("settings/moire/machine.toml", "machine.toml", "variable.toml", "named.toml"):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'text = "{name}"')
        if name.startswith("variable"):
            monkeypatch.setenv(description.VARIABLE, str(path))
        texts[name] = description.describe("named.toml" if name.startswith("named") else None).text
    assert all(name == text for name, text in texts.items())


def test_the_file_of_a_board_names_the_axes_for_the_host():
    found = description.describe(str(build_machine.FOLDER / "mill.toml"))
    assert [one.place for one in found.axes.values()] == [(1, 0), (1, 1), (1, 2)]
    assert list(found.axes) == ["X", "Y", "Z"] and found.text.startswith("S2 and three-axis mill")


def test_every_node_of_the_project_is_a_machine_of_the_host():
    for name in build_machine.names():
        built, path = build_machine.named(name), str(build_machine.FOLDER / f"{name}.toml")
        if built.orders:
            with pytest.raises(BadFile, match="this is a relay"):
                description.describe(path)
            continue
        found = description.describe(path).axes.values()
        assert [one.name for one in found] == [axis.name for axis in built.axes]
        assert {one.node for one in found} == {built.address}


def both(folder, more, axis=""):
    """The file of a mill with more at its begin and in its first axis, read by host and build."""
    text = (build_machine.FOLDER / "mill.toml").read_text()
    path = folder / "own_mill.toml"
    path.write_text(more + text.replace('name = "X"', f'name = "X"\n{axis}', 1))
    return description.describe(str(path)), build_machine.load(path)


def test_one_file_serves_the_board_and_the_host(folder):
    found, built = both(
        folder,
        'port = "/dev/ttyTest"\n',
        'unit = "um"\nparameters = { velocity = "3mm/s", travel_high = "40 mm" }',
    )
    assert found.port == "/dev/ttyTest" and found.axes["X"].unit == "um"
    assert found.axes["X"].parameters == {"velocity": "3mm/s", "travel_high": "40 mm"}
    assert [axis.name for axis in built.axes] == list(found.axes)


@pytest.mark.parametrize(
    "more, axis, why",
    [
        ("port = 3\n", "", "port is no text"),
        ("", 'unit = "inch"', "axes.X.unit = 'inch': allowed are mm, um, nm"),
        ("", "parameters = { speed = 3 }", "there is no 'axes.X.parameters.speed'"),
        ("", 'parameters = "fast"', "axes.X.parameters is no table"),
    ],
)
def test_host_and_build_refuse_the_same_mistake(folder, more, axis, why):
    with pytest.raises(BadFile, match=re.escape(why)):
        both(folder, more, axis)
    with pytest.raises(Misfit, match=re.escape(why)):
        build_machine.load(folder / "own_mill.toml")


@pytest.mark.parametrize(
    "text, why",
    [
        ("[node]\n", "a node has the tables [node] and [[axis]]"),
        ("[node]\n[[axis]]\n", "axis 0 has no name"),
        ('[node]\n[[axis]]\nname = "X"\n[[axis]]\nname = "X"\n', "two axes have the name X"),
        ('[node]\naddress = 99\n[[axis]]\nname = "X"\n', "node = 99 is no number"),
        ('[node]\n[[axis]]\nname = "X"\n[axes.x]\n', "use [axes.NAME] or [[axis]], not both"),
    ],
)
def test_a_file_of_a_board_that_the_host_cannot_use_is_refused(folder, text, why):
    (folder / "machine.toml").write_text(text)
    with pytest.raises(BadFile, match=re.escape(why)):
        description.describe()


def test_a_description_has_the_port_and_the_axes(file):
    found = description.describe()
    assert (found.port, found.text, found.file) == (
        "/dev/ttyTest",
        "a test machine",
        str(file.name),
    )
    assert found.axis("x").place == (1, 0) and found.axis("z").place == (2, 1)
    assert found.axis("1.0") is found.axis("x") and found.axis("7.3").name == "7.3"
    assert found.axis("x").length(1500.4) == "1.500 um" and found.axis("z").unit == "mm"
    with pytest.raises(UnknownName, match="no axis 'y': named axes are x, z"):
        found.axis("y")


@pytest.mark.parametrize(
    "text, message",
    [
        ("[axes.x", "is no TOML"),
        ('[axes.x]\nnode = "1"', "node = '1' is no number from 1 to 15"),
        ("[axes.x]\nnode = 16", "node = 16 is no number from 1 to 15"),
        ("[axes.x]\naxis = true", "axis = True is no number from 0 to 255"),
        ("[axes.x]\nposition = 1", "no 'axes.x.position': allowed are node, axis, unit"),
        ('[axes.x]\nunit = "inch"', "unit = 'inch': allowed are mm, um, nm"),
        ("[axes.x]\nwiring = 3", "axes.x.wiring is no text"),
        ("[axes.x.parameters]\nspeed = 3", "no 'axes.x.parameters.speed': allowed are period"),
        ("[axes.x.parameters]\nkp = 3", "axes.x.parameters.kp is no text"),
        ("[axes.x]\nparameters = 3", "axes.x.parameters is no table"),
        ('[axes."1.0"]', "'1.0' is no name for an axis"),
        ("[axes.kp]", "'kp' is no name for an axis"),
        ("[axes]\nx = 3", "axes.x is no table"),
        ("axes = 3", "axes is no table"),
        ("[axes.x]\n[axes.y]", "two names mean the same axis"),
        ("speed = 3", "no 'speed': allowed are text, port, axes"),
    ],
)
def test_a_wrong_description_is_one_sentence_that_names_the_place(folder, text, message):
    (folder / "machine.toml").write_text(text)
    with pytest.raises(BadFile) as error:
        description.describe()
    assert message in str(error.value) and "machine.toml" in str(error.value)
    assert message in sentence(Call("status"), 2)


def test_a_description_that_is_missing_or_no_text_is_refused(folder):
    assert "No such file" in sentence(Call("--machine-file none.toml status"), 2)
    (folder / "machine.toml").write_bytes(b"\xff")
    assert "is no TOML" in sentence(Call("status"), 2)


def test_the_axes_of_the_simulated_machines_have_names():
    assert AXES.keys() == MACHINES.keys() == machines.MACHINES.keys()
    named = {name.lower(): (address, 0) for name, address in s0_stage.ADDRESSES.items()}
    assert AXES["s0"] == named
    assert description.Description().of("twin:s2").axis("z").place == (1, 2)
    with pytest.raises(UnknownName, match="no simulated machine 's9'"):
        description.Description().of("twin:s9")


# ------------------------------------------------------------------ the command line


def test_an_axis_is_named_after_the_command_and_its_lengths_have_its_unit(file):
    nodes = BusNode(1), BusNode(2, axes=2)
    call = Call("home x -- move x 20um -- move -5um --by --axis x -- status --axis z", *nodes)
    assert call.code == 0, call.err
    assert "x, node 1 axis 0: at 20.000 um, error 0.0 nm" in call.out
    assert "x, node 1 axis 0: at 15.000 um" in call.out and call.options.port == "/dev/ttyTest"
    call = Call(["status", "z", "--", "params", "get", "z", "kp", "--json"], *nodes)
    assert [(one["address"], one["axis"]) for one in call.results] == [(2, 1), (2, 1)]


def test_several_axes_are_started_by_their_names(file):
    nodes = BusNode(1), BusNode(2, axes=2)
    call = Call("home x -- home z -- prepare x 9um -- prepare z 1mm -- start x z", *nodes)
    assert call.code == 0, call.err
    assert "node 1 axis 0: at 9.000 um" in call.out and "node 2 axis 1: at 1.000000 mm" in call.out


def test_a_name_is_no_axis_without_a_description():
    assert "'x'" in sentence(Call("move x 1mm", BusNode()), 2)
    call = Call("--port twin:s2 status z --json", BusNode(1, axes=3))
    assert call.results[0]["axis"] == 2


def test_a_name_holds_in_a_file_of_commands_too(file, folder):
    (folder / "commands").write_text("home x\nmove x 3um\n")
    node = BusNode()
    assert "at 3.000 um" in Call("run commands", node).out


def test_an_option_wins_over_the_variable_and_that_over_the_file(file, monkeypatch):
    assert Call("status").options.port == "/dev/ttyTest"
    monkeypatch.setenv(description.PORT_VARIABLE, "/dev/other")
    assert Call("status").options.port == "/dev/other"
    assert Call("status --port=/dev/third").options.port == "/dev/third"


def test_the_machine_is_shown_checked_applied_and_saved(file, folder):
    nodes = BusNode(1), BusNode(2, axes=2)
    shown = Call("machine show").out
    assert shown.startswith("machine.toml, port /dev/ttyTest: a test machine\n")
    assert "node 1 axis 0, in um, 1 parameters: grating on J3" in shown
    differs = Call("machine check", *nodes)
    assert differs.code == 1 and "1 parameters differ" in differs.err
    assert differs.out.split() == "x velocity 4.8mm/s described: 3mm/s".split()
    assert Call("machine apply", *nodes).code == 0
    assert Call("machine check", *nodes).out == "all parameters are as described\n"
    assert Call("machine save other.toml", *nodes).out == "3 axes described in other.toml\n"
    saved = description.describe("other.toml")
    assert list(saved.axes) == ["x", "axis_2_0", "z"] and saved.axes["x"].unit == "um"
    assert saved.axes["x"].parameters == {"velocity": "3mm/s"}
    assert saved.axes["x"].wiring == "grating on J3" and saved.port == "/dev/ttyTest"


def test_a_machine_without_names_or_nodes_is_refused():
    assert "no axis has a name" in sentence(Call("machine check", BusNode()), 2)
    assert "no axis has a name" in Call("machine show").out
    assert "nobody answers" in sentence(Call("machine save other.toml", bus=Rs485Bus()), 3)


def test_a_wrong_value_in_the_description_sets_nothing(folder):
    (folder / "machine.toml").write_text('[axes.x.parameters]\nkp = "1"\nvelocity = "5 kg"\n')
    node = BusNode()
    assert "is no speed" in sentence(Call("machine apply", node), 2)
    assert "set_parameter" not in node.executed


def test_ports_lists_what_there_is(capsys, monkeypatch):
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [])
    shown = Call("ports").out
    assert "no serial port is there" in shown and "twin:s2" in shown and "none, see" in shown
    assert json.loads(Call("ports --json --port COM9").out)["port"] == "COM9"


# ------------------------------------------------------------------ files of parameters


def test_parameters_are_saved_as_toml_with_units_and_purpose(folder):
    node = BusNode()
    node.set(settle_window=1639)
    assert Call("params save stage.toml", node).code == 0
    text = (folder / "stage.toml").read_text()
    assert 'velocity = "4.8mm/s"' in text and "# top speed of a move; 800nm/s to" in text
    assert "; default 19.9951171875nm" in text and "\n# servo\n" in text
    other = BusNode()
    assert Call("params load stage.toml", other).code == 0
    assert other.parameters() == node.parameters()


@pytest.mark.parametrize(
    "text", ["[", 'kp = "1"', "[parameters]\nkp = 1", "parameters = 3", "segment_points = 3"]
)
def test_a_toml_file_without_parameters_is_refused(folder, text):
    (folder / "wrong.toml").write_text(text)
    node = BusNode()
    sentence(Call("params load wrong.toml", node), 2)
    (folder / "wrong.toml").write_text("segment_points = [1.5]\n[parameters]\n")
    assert "no list of whole numbers" in sentence(Call("params load wrong.toml", node), 2)
    assert "set_parameter" not in node.executed


def test_what_differs_from_the_defaults_and_from_a_file_is_shown(folder):
    node = BusNode()
    assert Call("params diff", node).out == "node 1 axis 0: all parameters have their defaults\n"
    assert Call("params save stage.toml", node).code == 0
    node.set(velocity=5000, settle_window=1639)
    rows = [row.split() for row in Call("params diff", node).out.splitlines()]
    assert rows == [
        ["velocity", "4mm/s", "default:", "4.8mm/s"],
        ["settle_window", "20.00732421875nm", "default:", "19.9951171875nm"],
    ]
    found = Call("params diff stage.toml --json", node).results[0]["differences"]
    assert found[0] == {"name": "velocity", "value": "4mm/s", "file": "4.8mm/s"}
    assert "set_parameter" not in node.executed
    assert "all parameters agree" in Call("params diff stage.toml", BusNode()).out


# ------------------------------------------------------------------ faults and causes explained


def test_a_fault_is_explained_without_a_port():
    call = Call("fault not_settled --json")
    assert call.results[0]["parameters"] == ["settle_window", "settle_time", "settle_timeout"]
    assert call.results[0]["found"][0]["kind"] == "cause" and call.options is None
    shown = Call("fault amplitude_low").out
    assert "an event of the encoder" in shown and "signal too small" in shown
    assert "did you mean following_error?" in sentence(Call("fault folowing_error"), 2)


LATCHED = ("estop", "drive", "cpu")  # also while the drive is off


@pytest.mark.parametrize("fault", LATCHED)
def test_a_latched_fault_comes_with_what_to_do_about_that_fault(fault):
    node = BusNode()
    node.axes[0].causes = FAULT[fault]
    node.run(1)
    shown = Call("fault", node).out
    assert remedies.of_faults((fault,)) in shown and "then 'moire reset'" in shown
    assert sum(remedies.of_faults((other,)) in shown for other in LATCHED) == 1


def test_every_fault_cause_and_reason_says_what_to_do():
    for what, (found, words) in remedies.TABLES.items():
        names = {name for name, _ in words.values()} - set(remedies.HARMLESS)
        assert found.keys() == names, what


def test_a_name_of_a_parameter_in_a_remedy_is_one_that_exists():
    fields = {name for one in bus_tables.OPERATIONS.values() for name, _ in one.request}
    for found, _ in remedies.TABLES.values():
        for text in found.values():
            words = {word for word in text.replace("-", " ").split() if "_" in word}
            words = {word.strip(".,;:()'") for word in words}
            known = remedies.NAMED | fields | {"encoder_events"}
            assert words <= known, words - known


def test_the_page_of_faults_is_fresh_and_has_every_name():
    assert faults.main(["--check"]) == 0
    text = faults.PAGE.read_text()
    for found, _ in remedies.TABLES.values():
        assert all(f"| `{name}` | " in text for name in found)


# ------------------------------------------------------------------ moire.connect


@pytest.fixture
def bus(monkeypatch):
    made = Rs485Bus(BusNode(1), BusNode(2, axes=2))
    monkeypatch.setattr(machine_module, "open_bus", lambda *port: made)
    return made


def test_connect_gives_axes_by_their_names_and_switches_off_at_the_end(file, bus):
    x_node = bus.nodes[0]
    with moire.connect() as machine:
        assert list(machine.axes()) == ["x", "z"] and len(machine.find()) == 2
        assert machine.node(2).identity.axes == 2 and machine.axis("2.1") is machine.axis("z")
        with machine.axis("x").enabled() as x:
            x.home()
            assert x.move("1.5 mm").position_nm == 1_500_000
        assert not x_node.axes[0].enabled
        x.enable()
        x.begin_move(mm=50)
    assert x_node.ended() == "stopped" and not x_node.axes[0].enabled and bus.closed


def test_a_block_leaves_a_drive_on_that_was_on(file, bus):
    with moire.connect() as machine:
        x = machine.axis("x")
        x.enable()
        with x.enabled():
            pass
        assert bus.nodes[0].axes[0].enabled


def test_a_faulted_axis_is_not_enabled(bus):
    bus.nodes[0].axes[0].causes = 1 << 2
    bus.nodes[0].run(1)
    with moire.connect("any") as machine, pytest.raises(Refused, match="emergency stop"):
        with machine.axis("1.0").enabled():
            raise AssertionError("the block is not entered")


def test_connect_without_a_port_is_refused():
    with pytest.raises(PortError, match="no port"):
        moire.connect()


def test_the_error_in_the_block_is_raised_and_not_that_of_its_end(bus):
    with pytest.raises(ZeroDivisionError):
        with moire.connect("any", tries=1) as machine:
            machine.axis("1.0").enable()
            bus.nodes = ()
            raise ZeroDivisionError
    assert bus.closed
    with pytest.raises(BusError):
        with moire.connect("any", tries=1) as machine:
            bus.nodes = (BusNode(1),)
            machine.axis("1.0").enable()
            bus.nodes = ()


def test_tries_and_patience_reach_the_bus(bus):
    with moire.connect("any", tries=2, patience="0.25s") as machine:
        assert (machine.bus.tries, machine.bus.answer_s) == (2, 0.25)


def test_samples_come_as_often_as_asked_and_keep_the_drive_on(bus):
    with moire.connect("any") as machine, machine.axis("1.0").enabled() as axis:
        found = list(axis.samples(every="0.3s", duration="3s"))
        times = [one.time_s for one in found]
        assert len(found) == 11 and all(one.status.enabled for one in found)
        assert all(0.29 < later - before < 0.36 for before, later in zip(times, times[1:]))


# ------------------------------------------------------------------ moire.aio


def asynchronous(work, monkeypatch, *nodes):
    """Runs work(machine, bus)."""
    bus = Rs485Bus(*nodes)
    monkeypatch.setattr(machine_module, "open_bus", lambda *port: bus)

    async def run():
        async with await aio.connect("any") as machine:
            await work(machine, bus)
        assert bus.closed and not any(axis.enabled for node in nodes for axis in node.axes)

    asyncio.run(run())


def test_two_axes_move_together_in_one_task(monkeypatch):
    async def work(machine, bus):
        x, y = [await machine.axis(name) for name in ("1.0", "2.0")]
        async with x.enabled(), y.enabled():
            await asyncio.gather(x.home(method="37"), y.home(method="37"))
            began = bus.now()
            one, other = await asyncio.gather(x.move("1 mm"), y.move(mm=1))
            assert one.position_nm == other.position_nm == 1_000_000
            both_s = bus.now() - began
            moves = [name for node in bus.nodes for name in node.executed if name == "move"]
            assert len(moves) == 2
            found = [sample.status async for sample in x.samples(every="10ms", duration="50ms")]
            assert len(found) == 6 and all(status.enabled for status in found)
        assert not (await x.status()).enabled and both_s < 10

    asynchronous(work, monkeypatch, BusNode(1), BusNode(2))


def test_the_axes_of_a_node_that_many_tasks_ask_for_at_once_have_one_node(monkeypatch):
    async def work(machine, bus):
        found = await asyncio.gather(*[machine.axis(f"1.{n % 2}") for n in range(20)])
        assert {axis.blocking.node for axis in found} == {machine.blocking.node(1)}
        assert {axis.blocking for axis in found} == set(machine.blocking.node(1).axes.values())

    asynchronous(work, monkeypatch, BusNode(1, axes=2))


def test_an_axis_that_is_asked_for_while_it_is_made_is_one_object(bus, monkeypatch):
    read_period, found = blocking_axis.Axis.read_period, []

    def meanwhile(axis):
        if not found:
            found.append(None)
            found[0] = axis.node.axis(0)  # as another thread does it
        return read_period(axis)

    monkeypatch.setattr(blocking_axis.Axis, "read_period", meanwhile)
    with moire.connect("any") as machine:
        assert machine.node(1).axis(0) is found[0] is machine.axis("1.0")


def test_a_drive_is_switched_off_at_the_end_of_a_block_though_the_stop_fails(monkeypatch):
    async def work(machine, bus):
        x = await machine.axis("1.0")
        with pytest.raises(BusError):
            async with x.enabled():
                bus.nodes[0].port.on_request = fail
        bus.nodes[0].port.on_request = lambda *request: None
        assert not bus.nodes[0].axes[0].enabled

    def fail(name, fields):
        if name == "status":
            raise BusError(1, "the status is not read")

    asynchronous(work, monkeypatch, BusNode(1))


def test_a_cancelled_task_stops_its_axis_under_control_and_the_other_one_goes_on(monkeypatch):
    async def work(machine, bus):
        x, y = [await machine.axis(name) for name in ("1.0", "2.0")]
        for axis in (x, y):
            await axis.enable()
            await axis.home(method="37")
        moving, other = (asyncio.create_task(axis.move("40 mm")) for axis in (x, y))
        while not ((await x.status()).in_motion and (await y.status()).in_motion):
            pass
        moving.cancel()
        with pytest.raises(asyncio.CancelledError):
            await moving
        status = await x.status()
        assert (status.ended, status.in_motion, status.enabled) == ("stopped", False, True)
        assert (await y.status()).in_motion
        await y.stop_and_wait()
        with pytest.raises(MotionFailed, match="stopped"):
            await other

    asynchronous(work, monkeypatch, BusNode(1), BusNode(2))


def test_the_named_axes_are_there_and_an_error_at_the_end_does_not_hide_another(file, monkeypatch):
    async def work(machine, bus):
        assert list(await machine.axes()) == ["x", "z"] and len(await machine.find()) == 2

    asynchronous(work, monkeypatch, BusNode(1), BusNode(2, axes=2))

    async def breaking(machine, bus):
        await (await machine.axis("1.0")).enable()
        bus.nodes = ()
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asynchronous(breaking, monkeypatch, BusNode(1))


def test_the_asynchronous_axis_has_the_methods_of_the_blocking_one():
    own = {"enabled", "samples"}
    inner = {  # what the methods are made of
        *("enable_for", "require_streams", "stream_limits", "feed", "fill", "send", "duration_s"),
        *("room_of_stream", "to_target", "motion", "stopping_on_error", "wait", "reached"),
        *("stop_if_enabled", "has_sine", "request", "feedback", "write_feedback", "to_nm"),
        *("to_counts", "read_period", "parameter_value", "parameter_counts", "write_parameter"),
        *("check_inside", "check_together", "check_parameters"),
    }
    public = {
        name
        for name, _ in inspect.getmembers(blocking_axis.Axis, inspect.isfunction)
        if not name.startswith("_")
    }
    mine = {
        name
        for name, _ in inspect.getmembers(aio.Axis, inspect.isfunction)
        if not name.startswith("_")
    }
    assert mine - own <= public and public - mine == inner & public
    assert aio.Axis.move.__doc__ == blocking_axis.Axis.move.__doc__


def public(kind):
    """The names of the methods of a class that users call."""
    members = inspect.getmembers(kind, inspect.isfunction)
    return {name for name, _ in members if not name.startswith("_")}


def test_the_asynchronous_machine_and_node_have_the_methods_of_the_blocking_ones():
    assert public(aio.Machine) == public(machine_module.Machine)
    assert public(aio.Node) == public(blocking_node.Node)
    assert aio.Node.start.__doc__ == blocking_node.Node.start.__doc__


def test_prepared_axes_of_a_node_begin_together_in_a_task(monkeypatch):
    async def work(machine, bus):
        node = await machine.node(2)
        axes = [await node.axis(number) for number in range(node.identity.axes)]
        for axis in axes:
            await axis.enable()
            await axis.home(method="37")
            await axis.prepare("1 mm")
        ended = await node.start(0, 1)
        assert [status.position_nm for status in ended] == [1_000_000] * 2
        assert (await node.counters())["frames_good"] > 0 and node.address == 2
        assert (await node.request("status", axis=1))["position"] == 1250 * PERIOD

    asynchronous(work, monkeypatch, BusNode(2, axes=2))
