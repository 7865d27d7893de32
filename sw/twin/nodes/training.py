# SPDX-License-Identifier: Apache-2.0
"""A short run of a library of the twin that counts its branches, for twin/build.py.

python training.py LIBRARY AXES CLK_HZ
"""

import ctypes
import sys

import numpy

from twin import build
from twin.machines.machine import FUNCTIONS as MACHINE_FUNCTIONS
from twin.machines.machine import declare, pack
from twin.nodes.library import FUNCTIONS
from twin.nodes.twin import BAUD

CYCLES = 2_400_000  # the soft core waits from 1 030 000 on
ASK_CYCLES = 100_000  # from one question of the host to the next
QUESTION = [0x111]  # to node 1: send your last reply
MACHINE = "stage"


def main() -> None:
    """Two nodes and their machines, with some words on the bus."""
    path, axes, clk_hz = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    library = ctypes.CDLL(path)
    declare(library, {**FUNCTIONS, **MACHINE_FUNCTIONS})
    image = numpy.array(build.firmware(axes=axes), dtype=numpy.uint32)
    addresses = numpy.array([1, 2], dtype=numpy.uint8)
    question = numpy.array(QUESTION, dtype=numpy.uint16)
    count = axes * len(addresses)
    table = pack(MACHINE, {}, library)
    twin = library.twin_new(
        1,
        len(addresses),
        addresses.ctypes.data,
        image.ctypes.data,
        len(image),
        (ctypes.c_char_p * count)(*[MACHINE.encode()] * count),
        (ctypes.c_void_p * count)(*[ctypes.addressof(table)] * count),
        clk_hz / BAUD,
    )
    for _ in range(CYCLES // ASK_CYCLES):
        library.twin_run(twin, ASK_CYCLES)
        library.twin_send_words(twin, question.ctypes.data, len(question), None, 0, 0)
    library.twin_delete(twin)


if __name__ == "__main__":
    main()
