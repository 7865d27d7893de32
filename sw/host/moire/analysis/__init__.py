# SPDX-License-Identifier: Apache-2.0
"""Measures and judges an axis: scope, tuning, self-test, harmonics of a ring, and reports."""
