# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC with nodes of Moire: configurations made from machine files, and runs without a screen."""
