# SPDX-License-Identifier: Apache-2.0
"""Made by tables/link.py from tables/link.toml: do not edit."""

KIND_REQUEST = 81
KIND_REPLY = 162
REQUEST_IDENTITY = 0
REQUEST_SEQUENCE = 1
REQUEST_TIME = 2
REQUEST_WORDS = 3
REQUEST_END_SPARE = 0
REQUEST_END_SPARE_VALUE = 1
REQUEST_END_WORDS = 2
REPLY_IDENTITY = 0
REPLY_SEQUENCE = 1
REPLY_TIME = 2
REPLY_REFUSED = 3
REPLY_STATE = 4
REPLY_WORDS = 5
REPLY_END_SPARE_VALUE = 0
REPLY_END_WORDS = 1
FRAME_WORDS = 6
REPLY_FRAME_WORDS = 7
LONGEST_WORDS = 128
MOST_VALUES = 121
UDP_PORT = 27181
SPI_TURNROUND_NS = 5000
SPI_TURNROUND_BYTE_NS = 100

# why a packet is refused, in the order of its count: (name, words)
CAUSES = (
    ("damaged", "the CRC-32 is wrong, or the carrier has lost a byte"),
    ("foreign", "another kind or session, another host while a drive is on, or the link is off"),
    ("wrong_length", "another length than the lists have"),
    ("replayed", "the sequence is not later than the last one"),
    ("out_of_time", "its time differs from the time of the node by more than the window"),
    ("busy", "the last request is still being played or answered"),
)
