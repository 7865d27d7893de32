# SPDX-License-Identifier: Apache-2.0
"""What the tests reach of the RTL, of the firmware and of the host package (`make coverage`)."""
