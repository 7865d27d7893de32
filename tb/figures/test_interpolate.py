# SPDX-License-Identifier: Apache-2.0
"""The latency of the interpolation, measured at the ports, is what the header of
feedback_channel.sv states.
"""

import re

from figures.interpolate import CHANNEL, interpolate_latency_clk


def test_the_latency_measured_at_the_ports_is_that_of_the_header():
    words = r"(\d+) (?:clk|cycles) from an? (?:converter|ADC) word to (?:the )?position"
    stated = re.search(rf"^// latency .*?{words}", CHANNEL.read_text(), re.MULTILINE)
    assert stated and interpolate_latency_clk() == int(stated[1])
