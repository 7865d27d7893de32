# SPDX-License-Identifier: Apache-2.0
"""The published machines as experiments against the twin, and the figures measured on them."""
