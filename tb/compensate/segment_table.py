# SPDX-License-Identifier: Apache-2.0
"""What rtl/compensate/segment_table.sv does to one position, in integers."""


def segment_table(position, errors, origin, length, linear, enable=1, index_bits=8):
    """(corrected, outside); errors at the borders 0..segments."""
    segments, distance = len(errors) - 1, position - origin
    outside = distance < 0 or distance >= length * min(segments, 1 << index_bits)
    if outside:
        error = errors[0] if distance < 0 else errors[segments]
    else:
        n, rest = divmod(distance, length)
        low, high = errors[n], errors[n + 1]
        fraction = (rest << 16) // length
        error = low + ((high - low) * fraction + 32768 >> 16) if linear else low + high + 1 >> 1
    return position - (error if enable else 0), outside
