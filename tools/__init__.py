# SPDX-License-Identifier: Apache-2.0
"""Checks and helpers of the workshop; run them as `python -m tools.NAME`."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
