// SPDX-License-Identifier: Apache-2.0
// link_packet.h -- made by tables/link.py from tables/link.toml: do not edit.
#pragma once
#include <cstdint>

namespace link_packet {
constexpr uint32_t KIND_REQUEST = 81;
constexpr uint32_t KIND_REPLY = 162;
constexpr uint32_t REQUEST_IDENTITY = 0;
constexpr uint32_t REQUEST_SEQUENCE = 1;
constexpr uint32_t REQUEST_TIME = 2;
constexpr uint32_t REQUEST_WORDS = 3;
constexpr uint32_t REQUEST_END_SPARE = 0;
constexpr uint32_t REQUEST_END_SPARE_VALUE = 1;
constexpr uint32_t REQUEST_END_WORDS = 2;
constexpr uint32_t REPLY_IDENTITY = 0;
constexpr uint32_t REPLY_SEQUENCE = 1;
constexpr uint32_t REPLY_TIME = 2;
constexpr uint32_t REPLY_REFUSED = 3;
constexpr uint32_t REPLY_STATE = 4;
constexpr uint32_t REPLY_WORDS = 5;
constexpr uint32_t REPLY_END_SPARE_VALUE = 0;
constexpr uint32_t REPLY_END_WORDS = 1;
constexpr uint32_t FRAME_WORDS = 6;
constexpr uint32_t REPLY_FRAME_WORDS = 7;
constexpr uint32_t LONGEST_WORDS = 128;
constexpr uint32_t MOST_VALUES = 121;
constexpr uint32_t UDP_PORT = 27181;
constexpr uint32_t SPI_TURNROUND_NS = 5000;
constexpr uint32_t SPI_TURNROUND_BYTE_NS = 100;
}  // namespace link_packet
