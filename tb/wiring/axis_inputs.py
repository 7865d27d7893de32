# SPDX-License-Identifier: Apache-2.0
"""The inputs of an axis in a bench."""

from mutation.library import Bench, library

TOP = "axis_inputs"
PARAMETERS = {}


class AxisInputs(Bench):
    """The inputs, before their reset."""

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)
