# SPDX-License-Identifier: Apache-2.0
"""What rtl/serial/half_duplex.sv does, in integers."""


def levels(driver_enable, tx_level, rx_pin):
    """(tx_pin, rx_level)"""
    return (tx_level, 1) if driver_enable else (1, rx_pin)
