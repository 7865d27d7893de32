# SPDX-License-Identifier: Apache-2.0
"""The firmware of the soft core: C sources and the program that builds its images."""
