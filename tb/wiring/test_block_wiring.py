# SPDX-License-Identifier: Apache-2.0
"""The wires inside blocks that have tests of their own for cocotb: these tests, on the bench of the
wiring.
"""

import random

from tb.bench import seed
from tb.link import test_process_link
from tb.sense import test_axis_inputs
from tb.system import test_relay
from tb.wiring.cocotb_handle import cases_of, run


@cases_of(test_relay)
def test_of_the_relay(relay, name):
    random.seed(seed())
    assert run(test_relay, name, relay)


@cases_of(test_process_link)
def test_of_the_real_time_link(process_link, name):
    random.seed(seed())
    assert run(test_process_link, name, process_link)


@cases_of(test_axis_inputs)
def test_of_the_inputs_of_an_axis(axis_inputs, name):
    random.seed(seed())
    assert run(test_axis_inputs, name, axis_inputs)
