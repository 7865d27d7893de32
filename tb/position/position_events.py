# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/position/position_events.sv, of the models of its blocks: step() advances one cycle
and returns all outputs after it, by name; what was captured is None while nothing is present.
"""

from tb.position.capture_events import CaptureEvents
from tb.position.index_capture import IndexCapture
from tb.position.position_capture import PositionCapture
from tb.position.position_compare import PositionCompare

CAPTURED = ("captured_sources", "captured_age", "captured_time", "captured_position")
COMPARED = ("armed", "compare_pulse", "late", "passed")


class PositionEvents:
    def __init__(self, delay, has_capture, has_compare):
        self.events, self.step_made = CaptureEvents(delay), 0
        self.capture = PositionCapture() if has_capture else None
        self.index_capture = IndexCapture()
        self.has_compare, self.compare = has_compare, PositionCompare()

    def step(self, inputs, rst=0):
        """inputs: {port: level}"""
        index, software = self.events.levels(
            *(inputs[name] for name in ("by_counts", "index_found", "capture_now", "sync"))
        )
        self.events.clk(rst, inputs["index_found"])
        captured = self.captures(inputs, index, software, rst)
        self.step_made = inputs["step_made"]
        return captured | dict(zip(COMPARED, self.compares(inputs, rst)))

    def captures(self, inputs, index, software, rst):
        """The outputs of the queue, or of the one position of an index."""
        common = dict(
            index=index,
            position=inputs["position"],
            pop=inputs["capture_next"],
            clear=inputs["capture_clear"],
            rst=rst,
        )
        if self.capture is None:
            enabled = inputs["capture_sources"] & 1
            present, position, overrun = self.index_capture.step(enabled=enabled, **common)
            entry, free = (1, 0, 0, position), 1 - present
        else:
            present, entry, free, overrun = self.capture.step(
                enabled=inputs["capture_sources"],
                software=software,
                valid=self.step_made if inputs["by_counts"] else inputs["position_valid"],
                **{name: inputs[name] for name in ("tick", "probe", "now")},
                **common,
            )
        seen = dict.fromkeys(CAPTURED) if not present else dict(zip(CAPTURED, entry))
        return dict(present=present, **seen, capture_free=free, overrun=overrun)

    def compares(self, inputs, rst):
        """What COMPARED names."""
        if not self.has_compare:
            return (0,) * len(COMPARED)
        return self.compare.step(
            start=inputs["compare_start"],
            step=inputs["compare_step"],
            count=inputs["compare_count"],
            pulse_length=inputs["pulse_length"],
            gap_length=inputs["gap_length"],
            arm=inputs["compare_arm"],
            disarm=inputs["compare_disarm"],
            valid=inputs["position_valid"],
            position=inputs["position"],
            shift=inputs["shifted"],
            shift_periods=inputs["shifted_periods"],
            rst=rst,
        )
