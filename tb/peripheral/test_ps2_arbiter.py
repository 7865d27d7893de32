# SPDX-License-Identifier: Apache-2.0
"""ps2_arbiter: when an injection may begin and what it waits for, commands in its middle, resends,
and random bytes against the model.
"""

import random

import cocotb
from cocotb.triggers import FallingEdge, Timer

from tb import bench
from tb.peripheral.ps2_arbiter import Inputs, Ps2Arbiter

CLK_HZ = 2000
MS = CLK_HZ // 1000
START = [0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14]  # S4: left Ctrl + W, the start of a cut


class Side:
    def __init__(self, dut):
        self.dut, self.model = dut, Ps2Arbiter(CLK_HZ)

    async def begin(self):
        names = (
            "idle_ms",
            "inject_valid",
            "inject",
            "inject_last",
            "keyboard_valid",
            "keyboard",
            "keyboard_damaged",
            "keyboard_busy",
            "keyboard_held",
            "command_ready",
            "command_sent",
            "command_unsent",
            "send_ready",
            "host_valid",
            "host",
            "host_damaged",
        )
        await bench.start(self.dut, **dict.fromkeys(names, 0))
        self.dut.rst.value = 1
        await FallingEdge(self.dut.clk)
        await FallingEdge(self.dut.clk)
        self.dut.rst.value = 0
        return self

    async def clk(self, rst=0, n=1, **inputs):
        """Run n cycles with these inputs; returns the wires of the last one."""
        d, i = self.dut, Inputs(**inputs)
        for name in (
            "idle_ms",
            "keyboard_busy",
            "keyboard_held",
            "command_ready",
            "command_sent",
            "command_unsent",
            "send_ready",
        ):
            getattr(d, name).value = getattr(i, name)
        d.rst.value = rst
        d.inject_valid.value, d.inject.value, d.inject_last.value = (
            i.inject is not None,
            *(i.inject or (0, 0)),
        )
        d.keyboard_valid.value, d.keyboard.value, d.keyboard_damaged.value = (
            i.keyboard is not None,
            *(i.keyboard or (0, 0)),
        )
        d.host_valid.value, d.host.value, d.host_damaged.value = (
            i.host is not None,
            *(i.host or (0, 0)),
        )
        for _ in range(n):
            await Timer(1, "ns")
            got = (
                int(d.keyboard_hold.value),
                (int(d.command.value), int(d.command_damaged.value))
                if d.command_valid.value
                else None,
                int(d.host_ready.value),
                (int(d.send.value), int(d.send_damaged.value)) if d.send_valid.value else None,
                int(d.keyboard_ready.value),
                int(d.inject_ready.value),
                int(d.injecting.value),
                int(d.typed.value),
            )
            want = self.model.wires(i)
            assert got == want, f"{i}: {got} where the model has {want}"
            self.model.step(i, rst)
            await FallingEdge(d.clk)
        return got

    async def typed(self, *keys, **more):
        """Send bytes of the keyboard, each passed on at once."""
        for key in keys:
            assert (await self.clk(keyboard=(key, 0), send_ready=1, **more))[3:5] == ((key, 0), 1)
            await self.clk(**more)

    async def order(self, command, **more):
        """Send a command of the host, which the keyboard takes."""
        assert (await self.clk(host=(command, 0), command_ready=1, **more))[1:3] == (
            (command, 0),
            1,
        )
        await self.clk(command_sent=1, **more)

    async def wait_for_injection(self, limit, **more):
        for ms in range(limit):
            if (await self.clk(inject=(START[0], 0), keyboard_held=1, n=MS, **more))[6]:
                return ms
        return None


@cocotb.test()
async def latency_is_0_and_a_byte_is_taken_in_the_cycle_in_which_it_is_offered(dut):
    side = await Side(dut).begin()
    await side.typed(0x1C, 0xF0, 0x1C)
    await side.order(0xED)


@cocotb.test()
async def the_shortcut_of_s4_goes_out_byte_by_byte(dut):
    side = await Side(dut).begin()
    assert await side.wait_for_injection(30) in (20, 21)
    for n, byte in enumerate(START):
        got = await side.clk(inject=(byte, int(n == 5)), keyboard_held=1, send_ready=1)
        assert got[3] == (byte, 0) and got[5] and got[0]
    assert (await side.clk())[6] == 0


@cocotb.test()
async def an_injection_waits_for_the_silence_that_is_set(dut):
    side = await Side(dut).begin()
    for idle in (0, 19, 20, 21, 300):
        await side.clk(rst=1)
        await side.typed(0x1C)
        assert await side.wait_for_injection(400, idle_ms=idle) in (
            max(idle, 20),
            max(idle, 20) + 1,
        )


@cocotb.test()
async def the_longest_silence_can_be_waited_for(dut):
    bench.rtl_only("it sets the silence inside, since it is too long to be waited for")
    side = await Side(dut).begin()
    side.model.quiet = 0xFFF0
    dut.quiet.value = 0xFFF0
    assert await side.wait_for_injection(40, idle_ms=0xFFFF) in (14, 15, 16)


@cocotb.test()
async def no_injection_inside_a_sequence_of_the_keyboard(dut):
    side = await Side(dut).begin()
    pause = [0xE1, 0x14, 0x77, 0xE1, 0xF0, 0x14, 0xF0, 0x77]
    for keys, inside in (
        ([0xE0], 1),
        ([0xE0, 0xF0], 1),
        ([0xF0], 1),
        (pause[:1], 1),
        (pause[:2], 1),
        (pause[:5], 1),
        (pause[:6], 1),
        (pause[:7], 1),
        (pause, 0),
        ([0xE0, 0xF0, 0x75], 0),
        ([0xF0, 0x1C], 0),
        ([0xE0, 0xAA], 0),
    ):
        await side.clk(rst=1)
        await side.typed(*keys)
        waited = await side.wait_for_injection(1040)
        assert waited in ((1000, 1001, 1002) if inside else (20, 21)), (keys, waited)


@cocotb.test()
async def no_injection_while_a_command_waits_for_its_answer(dut):
    side = await Side(dut).begin()
    for orders, answers in (
        ([0xED], [0xFA]),
        ([0xFF], [0xFA, 0xAA]),
        ([0xF2], [0xFA, 0xAB, 0x83]),
        ([0xF0, 0x00], [0xFA, 0x02]),
        ([0xFF], [0xFE]),
    ):
        for missing in range(len(answers), -1, -1):
            await side.clk(rst=1)
            for order in orders:
                await side.order(order)
            await side.typed(*answers[: len(answers) - missing])
            waited = await side.wait_for_injection(1040)
            assert waited in ((1000, 1001, 1002) if missing else (20, 21)), (
                orders,
                missing,
                waited,
            )
    await side.clk(rst=1)
    await side.clk(host=(0xED, 0), command_ready=1)  # under way to the keyboard
    assert await side.wait_for_injection(1100) is None
    await side.clk(command_unsent=1)
    assert await side.wait_for_injection(40) in (20, 21)


@cocotb.test()
async def a_command_in_the_middle_is_answered_first(dut):
    side = await Side(dut).begin()
    await side.wait_for_injection(30)
    await side.clk(inject=(0x14, 0), keyboard_held=1, send_ready=1)
    await side.order(0xED, inject=(0x1D, 0))
    got = await side.clk(inject=(0x1D, 0), n=50 * MS)
    assert got[0] == 0 and got[3] is None  # the keyboard is free to answer, nothing is sent
    await side.typed(0xFA, inject=(0x1D, 0))
    assert (await side.clk(inject=(0x1D, 0)))[0] == 1  # and held again
    assert (await side.clk(inject=(0x1D, 0), n=19 * MS))[3] is None
    assert (await side.clk(inject=(0x1D, 0), n=2 * MS))[3] == (0x1D, 0)


@cocotb.test()
async def a_resend_after_an_injected_byte_is_answered_here(dut):
    side = await Side(dut).begin()
    await side.wait_for_injection(30)
    await side.clk(inject=(0x14, 1), keyboard_held=1, send_ready=1)
    assert (await side.clk(host=(0xFE, 0)))[1:3] == (None, 1)
    assert (await side.clk(keyboard=(0x1C, 0)))[3] == (0x14, 0)
    assert (await side.clk(keyboard=(0x1C, 0), send_ready=1))[3:6] == ((0x14, 0), 0, 0)
    assert (await side.clk(keyboard=(0x1C, 0), send_ready=1))[3:6] == ((0x1C, 0), 1, 0)
    assert (await side.clk(host=(0xFE, 0)))[1:3] == (
        (0xFE, 0),
        0,
    )  # a byte of the keyboard, unrelated to the command
    assert (await side.clk(host=(0xFE, 1)))[1:3] == ((0xFE, 1), 0)


@cocotb.test()
async def what_is_typed_is_distinguished_from_answers(dut):
    side = await Side(dut).begin()
    assert (await side.clk(keyboard=(0x1C, 0)))[7] == 1
    assert (await side.clk(keyboard=(0x1C, 0), send_ready=1))[7] == 0  # once
    await side.clk()
    assert (await side.clk(keyboard=(0x1C, 1), send_ready=1))[7] == 0  # damaged
    await side.order(0xFF)
    for answer in (0xFA, 0xAA):
        await side.clk()
        assert (await side.clk(keyboard=(answer, 0), send_ready=1))[7] == 0
    await side.clk()
    assert (await side.clk(keyboard=(0xF0, 0), send_ready=1))[7] == 1


@cocotb.test()
async def reset_ends_an_injection(dut):
    side = await Side(dut).begin()
    await side.wait_for_injection(30)
    await side.clk(inject=(0x14, 0), send_ready=1)
    await side.clk(rst=1)
    assert (await side.clk(inject=(0x1D, 0)))[6] == 0


@cocotb.test()
async def any_bytes_match_the_model(dut):
    side = await Side(dut).begin()
    for order in (0xED, 0x02):  # reset does not forget the last two
        await side.order(order)
    some = [0xE0, 0xE1, 0xF0, 0xFA, 0xFE, 0xFC, 0xFF, 0xAA, 0xF2, 0x00, 0x1C, 0x83]
    for _ in range(4000):
        i = dict(
            idle_ms=random.choice([0, 20, 25]),
            inject=random.choice([None, (0x14, 0), (0x14, 1)]),
            keyboard_busy=random.random() < 0.05,
            keyboard_held=random.randrange(2),
            command_ready=random.randrange(2),
            command_sent=random.random() < 0.1,
            command_unsent=random.random() < 0.02,
        )
        if random.random() < 0.3:
            i["keyboard"] = random.choice(some), int(random.random() < 0.1)
        if random.random() < 0.2:
            i["host"] = random.choice(some), int(random.random() < 0.1)
        if side.model.wires(Inputs(**i))[3]:
            i["send_ready"] = random.randrange(2)
        await side.clk(rst=int(random.random() < 0.002), **i)
        if random.random() < 0.03:
            await side.clk(
                n=random.randrange(1, 25) * MS, inject=(0x1D, 0), keyboard_held=random.randrange(2)
            )


def test_ps2_arbiter():
    bench.run("ps2_arbiter", __file__, CLK_HZ=CLK_HZ)
