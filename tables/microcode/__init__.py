# SPDX-License-Identifier: Apache-2.0
"""The microcode of motion_engine: its program, its assembler, and what it takes at most."""
