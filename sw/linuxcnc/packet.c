// SPDX-License-Identifier: GPL-2.0-or-later
#include "packet.h"

#include <zlib.h>

static void put_word(uint8_t* bytes, uint32_t word) {
    for (unsigned n = 0; n < 4; n++) bytes[n] = (uint8_t)(word >> 8 * n);
}

static uint32_t word_at(const uint8_t* packet, size_t word) {
    const uint8_t* bytes = packet + 4 * word;
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static uint32_t crc_of(const uint8_t* packet, size_t words) {
    return (uint32_t)crc32(0, packet, (unsigned)(4 * words));
}

size_t packet_request(struct link_session* link, uint32_t time, const uint32_t* values,
                      uint32_t spare, uint32_t spare_value, uint8_t* packet) {
    link->sequence++;
    put_word(packet + 4 * PACKET_REQUEST_IDENTITY, PACKET_KIND_REQUEST | link->session << 8);
    put_word(packet + 4 * PACKET_REQUEST_SEQUENCE, link->sequence);
    put_word(packet + 4 * PACKET_REQUEST_TIME, time);
    uint8_t* value = packet + 4 * PACKET_REQUEST_WORDS;
    for (unsigned n = 0; n < link->writes; n++, value += 4) put_word(value, values[n]);
    put_word(value + 4 * PACKET_REQUEST_END_SPARE, spare);
    put_word(value + 4 * PACKET_REQUEST_END_SPARE_VALUE, spare_value);
    size_t words = PACKET_REQUEST_WORDS + link->writes + PACKET_REQUEST_END_WORDS;
    put_word(packet + 4 * words, crc_of(packet, words));
    return 4 * words + 4;
}

size_t packet_reply_length(const struct link_session* link) {
    return 4 * (PACKET_REPLY_WORDS + link->reads + PACKET_REPLY_END_WORDS + 1);
}

bool packet_reply(const struct link_session* link, const uint8_t* packet, size_t length,
                  struct link_reply* reply) {
    if (length != packet_reply_length(link)) return false;
    size_t words = length / 4 - 1;
    if (word_at(packet, words) != crc_of(packet, words)) return false;
    if (word_at(packet, PACKET_REPLY_IDENTITY) != (PACKET_KIND_REPLY | link->session << 8))
        return false;
    if (word_at(packet, PACKET_REPLY_SEQUENCE) != link->sequence) return false;
    reply->time = word_at(packet, PACKET_REPLY_TIME);
    uint64_t counts =
        word_at(packet, PACKET_REPLY_REFUSED) | (uint64_t)word_at(packet, PACKET_REPLY_STATE) << 32;
    for (unsigned n = 0; n < CAUSE_COUNTS; n++) reply->refused[n] = (uint8_t)(counts >> 8 * n);
    for (unsigned n = 0; n < link->reads; n++)
        reply->values[n] = word_at(packet, PACKET_REPLY_WORDS + n);
    reply->spare = word_at(packet, PACKET_REPLY_WORDS + link->reads + PACKET_REPLY_END_SPARE_VALUE);
    return true;
}
