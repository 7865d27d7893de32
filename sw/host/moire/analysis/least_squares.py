# SPDX-License-Identifier: Apache-2.0
"""Least squares of Levenberg and Marquardt, for models of a few parameters."""

from collections.abc import Callable

import numpy
from numpy.typing import ArrayLike, NDArray

Array = NDArray[numpy.float64]

STEP = 1e-5  # of a parameter, for the slope
LARGEST_CHANGE = 0.5  # of a parameter in one step
SMALLEST_CHANGE = 1e-6  # the fit has ended
STEPS = 60
STIFFEST = 1e9


def least_squares(beyond: Callable[[Array], Array], guess: ArrayLike) -> tuple[Array, Array]:
    """The parameters from a guess on with the smallest sum of squares of beyond(parameters), and
    what is left. The parameters are of the order of 1, such as logarithms.
    """
    values, damper = numpy.asarray(guess, float), 1e-2
    found = beyond(values)
    for _ in range(STEPS):
        slope = numpy.column_stack(
            [(beyond(values + STEP * unit) - found) / STEP for unit in numpy.eye(len(values))]
        )
        normal = slope.T @ slope
        wall = damper * numpy.diag(numpy.diag(normal) + 1e-30)
        change = numpy.clip(
            numpy.linalg.solve(normal + wall, -slope.T @ found), -LARGEST_CHANGE, LARGEST_CHANGE
        )
        tried = beyond(values + change)
        if tried @ tried < found @ found:
            values, found, damper = values + change, tried, damper / 5
            if numpy.abs(change).max() < SMALLEST_CHANGE:
                break
        else:
            damper *= 5
            if damper > STIFFEST:
                break
    return values, found
