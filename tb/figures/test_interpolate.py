# SPDX-License-Identifier: Apache-2.0
"""The figure of the interpolator that is measured in motion: its program builds, and measures what
the header of feedback_channel.sv says.
"""

import re
from pathlib import Path

from figures import interpolate as figures_interpolate

GRATING = Path(__file__).resolve().parents[2] / "rtl" / "feedback_channel.sv"


def test_the_latency_measured_at_the_ports_is_that_of_the_header():
    said = re.search(
        r"^// latency .*?(\d+) clk from a converter word to position",
        GRATING.read_text(),
        re.MULTILINE,
    )
    assert figures_interpolate.interpolate_latency_clk() == int(said.group(1))
