# SPDX-License-Identifier: Apache-2.0
"""LinuxCNC with nodes of Moire: configurations from machine files, and runs without a screen."""
