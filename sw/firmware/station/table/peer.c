// SPDX-License-Identifier: Apache-2.0
// peer -- the connection between main node and sub-node, 115200 baud, 8N1. It has two modes:
//
//   legacy   S4's bytes: FF FF AA "cutting done, turn to the next station", FF FF 55 "turned". They
//            are recognised among any other bytes. The sub-node has the list of stations and counts
//            them; its count is in its EEPROM, so a power cut does not lose it. Nothing is ever
//            sent twice: only a time-out shows that a message was lost.
//   frames   00 · COBS of body and its CRC-32 · 00. The bodies are those of the RS-485 bus: the
//            main node requests, and the sub-node acts as it does on the bus. A request without a
//            reply is sent again; a request that arrives again gets the same reply and is not done
//            again. If a fault of the sub-node was the cause, the main node asks which; it resets
//            the fault only when a person requests it.
#include "station/table/peer.h"

#include "core/clock.h"
#include "core/hardware.h"
#include "station/table/turn.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "station/table/sensor.h"
#include "station/settings.h"
#include "station/storage/journal.h"
#include "station/storage/station_list.h"

#define BAUD 115200u
#define BYTES_PER_POLL 16u
#define CRC_BYTES 4u
#define LONGEST_PART (1u + BUS_LONGEST_BODY + CRC_BYTES)  // between the zeros of a frame
#define ANSWER_MS 100u                                    // then a request is sent again
#define MOST_ATTEMPTS 20u                                 // then the sub-node is silent
#define PAUSE_MS 50u                                      // from a reply to the next poll
#define BEGIN_MS 10000u  // that a sub-node which is still busy may take to stop

enum mode { NOT_IN_USE, LEGACY, FRAMES };
enum role { MAIN, SUB };
enum legacy { HEAD = 0xFF, DONE = 0x55, NEXT = 0xAA };  // twice the head, then one of the others
enum step {
    NOTHING,
    POLLING,
    CLEARING,
    RESETTING,
    SETTING_SPEED,
    ORDERING,
    WATCHING,
    STOPPING,
    ASKING_FAULT
};  // that was requested last

static struct peer {
    uint8_t phase;  // bus_peer_phase
    uint8_t ended;  // bus_cause
    uint16_t station;
    uint32_t angle;
    uint32_t since_ms;  // when the turn was ordered
    uint32_t heard, garbage, repeated;
    uint16_t faults;       // of the sub-node
    uint8_t failure;       // the cause, while the faults are requested
    bool reset_requested;  // by a person
    bool noting;           // a sub-node in mode legacy is writing its count
} peer;

static struct requests {  // of a main node, frames
    uint8_t step;
    uint8_t body[BUS_SET_PARAMETER_REQUEST_LENGTH];  // the longest one
    uint8_t length;
    uint8_t attempts;
    bool answered;  // the next poll_status waits for PAUSE_MS
    uint32_t sent_ms;
} requests;

static struct replies {  // of a sub-node, frames
    bool any;
    uint32_t request_crc;
    uint8_t body[BUS_LONGEST_BODY];
    uint8_t length;
} replies;

static struct incoming {
    uint8_t heads;                // of a legacy order, two at most
    uint8_t bytes[LONGEST_PART];  // of a frame
    uint32_t count;               // LONGEST_PART + 1: the frame is too long
} incoming;

static uint8_t mode(void) { return (uint8_t)settings_get(BUS_SETTING_PEER_MODE); }

static uint8_t role(void) { return (uint8_t)settings_get(BUS_SETTING_PEER_ROLE); }

static void end(uint8_t phase, uint8_t cause) {
    peer.phase = phase;
    peer.ended = cause;
    peer.reset_requested = peer.noting = false;
    requests.step = NOTHING;
}

// ---- legacy

static void send_legacy(uint8_t what) {
    const uint8_t bytes[] = {HEAD, HEAD, what};
    for (uint32_t n = 0; n < sizeof bytes; n++)
        peripherals_write(PERIPHERALS_PEER_TRANSMIT, bytes[n]);
}

// The next station of this sub-node, from the journal.
static uint16_t next_station(void) {
    const struct journal_record* record = journal_last();
    return record->step == JOURNAL_NEXT && record->list == station_list_identity() ? record->station
                                                                                   : 0;
}

static void next_ordered(void) {
    uint8_t cause = BUS_CAUSE_NO_STATION;
    if (peer.phase == BUS_PEER_PHASE_TURNING) return;
    peer.station = next_station();
    if (peer.station < station_list_count()) {
        peer.angle = station_list_angle(peer.station);
        cause = turn_to(peer.angle);
    }
    end(cause == BUS_CAUSE_OK ? BUS_PEER_PHASE_TURNING : BUS_PEER_PHASE_FAILED,
        cause == BUS_CAUSE_OK ? BUS_CAUSE_RUNNING : cause);
}

// A sub-node: the count is in the journal before the main node receives DONE.
static void watch_turn(void) {
    uint8_t ended = turn_ended();
    if (peer.phase != BUS_PEER_PHASE_TURNING || ended == BUS_CAUSE_RUNNING ||
        store_state() == STORE_WRITING)
        return;
    if (ended == BUS_CAUSE_OK)
        ended = peer.noting ? store_cause()
                            : journal_write((uint16_t)(peer.station + 1u), JOURNAL_NEXT);
    if (ended != BUS_CAUSE_OK) return end(BUS_PEER_PHASE_FAILED, ended);
    if (!peer.noting) {
        peer.noting = true;
        return;
    }
    end(BUS_PEER_PHASE_TURNED, BUS_CAUSE_OK);
    send_legacy(DONE);
}

static void legacy_byte(uint8_t byte) {
    if (byte == HEAD) {
        if (incoming.heads == 2) peer.garbage++;
        if (incoming.heads < 2) incoming.heads++;
        return;
    }
    bool whole = incoming.heads == 2 && byte == (role() == SUB ? NEXT : DONE);
    peer.garbage += whole ? 0 : 1u + incoming.heads;
    peer.heard += whole;
    incoming.heads = 0;
    if (!whole) return;
    if (role() == SUB)
        next_ordered();
    else if (peer.phase == BUS_PEER_PHASE_TURNING)
        end(BUS_PEER_PHASE_TURNED, BUS_CAUSE_OK);
}

static void legacy_work(void) {
    if (role() == SUB)
        watch_turn();
    else if (peer.phase == BUS_PEER_PHASE_TURNING &&
             clock_ms() - peer.since_ms > (uint32_t)settings_get(BUS_SETTING_PEER_TIMEOUT))
        end(BUS_PEER_PHASE_SILENT, BUS_CAUSE_CHECK_SUB_NODE);
}

// ---- frames

static void send_frame(const uint8_t* body, uint32_t length) {
    uint8_t part[LONGEST_PART];
    uint32_t crc = bus_crc(body, length), whole = length + CRC_BYTES, code = 0;
    if (FIELD_GET(peripherals_read(PERIPHERALS_PEER_STATE), PERIPHERALS_PEER_STATE_TRANSMIT_FREE) <
        whole + 3u)
        return;  // no frame rather than half a frame
    for (uint32_t n = 0; n < whole; n++) {
        uint8_t byte = (uint8_t)(n < length ? body[n] : crc >> 8 * (n - length));
        part[n + 1] = byte;
        if (byte) continue;
        part[code] = (uint8_t)(n + 1 - code);
        code = n + 1;
    }
    part[code] = (uint8_t)(whole + 1 - code);
    peripherals_write(PERIPHERALS_PEER_TRANSMIT, 0);
    for (uint32_t n = 0; n <= whole; n++) peripherals_write(PERIPHERALS_PEER_TRANSMIT, part[n]);
    peripherals_write(PERIPHERALS_PEER_TRANSMIT, 0);
}

// Decodes COBS in place; the body begins at the second byte. Returns the length of body and CRC-32,
// or 0 if the codes do not lead to the end.
static uint32_t decode(uint8_t* part, uint32_t count) {
    uint32_t at = 0;
    while (at < count && part[at]) {
        uint32_t code = part[at];
        if (at) part[at] = 0;
        at += code;
    }
    return at == count ? count - 1 : 0;
}

static void repeat_request(void) {
    requests.attempts++;
    requests.sent_ms = clock_ms();
    send_frame(requests.body, requests.length);
}

static void ask(uint8_t step, uint8_t operation, uint64_t fields, uint8_t field_bytes) {
    requests.step = step;
    requests.body[0]++;  // sequence
    requests.body[1] = operation;
    for (uint32_t n = 0; n < field_bytes; n++, fields >>= 8)
        requests.body[BUS_REQUEST_HEAD + n] = (uint8_t)fields;
    requests.length = BUS_REQUEST_HEAD + field_bytes;
    requests.attempts = 0;
    requests.answered = false;
    repeat_request();
}

static void set_speed(void) {
    uint64_t override = 65536u * (uint32_t)settings_get(BUS_SETTING_JOB_SPEED) / 100u;
    ask(SETTING_SPEED, BUS_OPERATION_SET_PARAMETER,
        override << 16 | BUS_PARAMETER_FEED_OVERRIDE << 8,
        BUS_SET_PARAMETER_REQUEST_LENGTH - BUS_REQUEST_HEAD);  // of axis 0
}

// A poll before an order also makes the order differ from the last request, even if this node began
// its sequence from scratch.
static void poll_status(uint8_t step) { ask(step, BUS_OPERATION_TURN_STATE, 0, 0); }

static void stop(uint8_t step) { ask(step, BUS_OPERATION_STOP, 0, 1); }

// An order has failed. If a fault was the cause, the faults are requested.
static void fail(uint8_t cause) {
    if (cause != BUS_CAUSE_FAULTED && cause != BUS_CAUSE_ENDED_BY_FAULT &&
        cause != BUS_CAUSE_FAULT_PERSISTS)
        return end(BUS_PEER_PHASE_FAILED, cause);
    peer.failure = cause;
    ask(ASKING_FAULT, BUS_OPERATION_STATUS, 0, 1);
}

static uint32_t field_of(const uint8_t* reply, uint32_t at, uint32_t bytes) {
    uint32_t value = 0;
    while (bytes--) value = value << 8 | reply[at + bytes];
    return value;
}

static void reset_fault(void) {
    peer.reset_requested = false;
    ask(RESETTING, BUS_OPERATION_RESET_FAULTS, 0, 1);
}

static void report_faults(const uint8_t* reply, uint8_t cause) {
    if (cause == BUS_CAUSE_OK) {
        uint32_t first = field_of(reply, BUS_STATUS_REPLY_FIRST_FAULT, 2);
        peer.faults = (uint16_t)(first ? first : field_of(reply, BUS_STATUS_REPLY_FAULTS, 2));
    }
    end(BUS_PEER_PHASE_FAILED, peer.failure);
}

static void state_heard(const uint8_t* reply) {
    uint8_t ended = reply[BUS_TURN_STATE_REPLY_ENDED];
    if (ended == BUS_CAUSE_NO_MOTION_YET ||
        field_of(reply, BUS_TURN_STATE_REPLY_TARGET, 4) != peer.angle)
        fail(BUS_CAUSE_PEER_RESTARTED);
    else if (ended == BUS_CAUSE_OK)
        end(BUS_PEER_PHASE_TURNED, BUS_CAUSE_OK);
    else if (ended != BUS_CAUSE_RUNNING)
        fail(ended);
}

static void reply_heard(const uint8_t* reply, uint32_t length) {
    bool ours = requests.step != NOTHING && !requests.answered && length >= BUS_REPLY_HEAD &&
                reply[0] == requests.body[0] && reply[1] == requests.body[1];
    uint8_t cause = ours ? reply[2] : BUS_CAUSE_OK;
    uint32_t expected = reply[1] == BUS_OPERATION_TURN_STATE ? BUS_TURN_STATE_REPLY_LENGTH
                        : reply[1] == BUS_OPERATION_STATUS   ? BUS_STATUS_REPLY_LENGTH
                                                             : BUS_REPLY_HEAD;
    if (!ours || (cause == BUS_CAUSE_OK && length != expected)) {
        peer.garbage++;
        return;
    }
    peer.heard++;
    requests.answered = true;
    requests.sent_ms = clock_ms();
    if (requests.step == POLLING && cause == BUS_CAUSE_OK &&
        reply[BUS_TURN_STATE_REPLY_PHASE] != BUS_TURN_PHASE_IDLE)
        cause = BUS_CAUSE_BUSY;
    if (cause == BUS_CAUSE_BUSY && clock_ms() - peer.since_ms < BEGIN_MS)
        stop(CLEARING);
    else if (requests.step == ASKING_FAULT)
        report_faults(reply, cause);
    else if (cause != BUS_CAUSE_OK)
        fail(cause);
    else if (requests.step == POLLING && peer.reset_requested)
        reset_fault();
    else if (requests.step == POLLING || requests.step == RESETTING)
        set_speed();
    else if (requests.step == SETTING_SPEED)
        ask(ORDERING, BUS_OPERATION_TURN_TO, peer.angle, 4);
    else if (requests.step == WATCHING)
        state_heard(reply);
}

static void request_heard(const uint8_t* request, uint32_t length, uint32_t crc) {
    peer.heard++;
    if (replies.any && replies.request_crc == crc && replies.body[0] == request[0]) {
        peer.repeated++;
    } else {
        replies.any = true;
        replies.request_crc = crc;
        replies.length = bus_execute(request, (uint8_t)length, replies.body);
    }
    send_frame(replies.body, replies.length);
}

static void frame_ended(void) {
    uint32_t count = incoming.count, whole, length, crc = 0;
    uint8_t* body = &incoming.bytes[1];
    incoming.count = 0;
    if (count == 0) return;
    whole = count > LONGEST_PART ? 0 : decode(incoming.bytes, count);
    length = whole - CRC_BYTES;
    if (whole > CRC_BYTES)
        for (uint32_t n = 0; n < CRC_BYTES; n++) crc |= (uint32_t)body[length + n] << 8 * n;
    if (whole <= CRC_BYTES || crc != bus_crc(body, length))
        peer.garbage++;
    else if (role() == SUB)
        request_heard(body, length, crc);
    else
        reply_heard(body, length);
}

static void frame_byte(uint8_t byte) {
    if (byte == 0) {
        frame_ended();
        return;
    }
    if (incoming.count < LONGEST_PART) incoming.bytes[incoming.count] = byte;
    if (incoming.count <= LONGEST_PART) incoming.count++;
}

static void frames_work(void) {
    if (requests.step == NOTHING ||
        clock_ms() - requests.sent_ms < (requests.answered ? PAUSE_MS : ANSWER_MS))
        return;
    if (!requests.answered && requests.attempts == MOST_ATTEMPTS)
        end(BUS_PEER_PHASE_SILENT, BUS_CAUSE_PEER_SILENT);
    else if (!requests.answered)
        repeat_request();
    else
        poll_status(requests.step == CLEARING ? POLLING : WATCHING);
}

void peer_start(unsigned axes) {
    uint64_t sixteenths = 16 * (uint64_t)node_read(NODE_CLK_HZ);
    (void)axes;
    peer = (struct peer){.phase = BUS_PEER_PHASE_IDLE, .ended = BUS_CAUSE_NO_MOTION_YET};
    requests = (struct requests){.step = NOTHING};
    replies.any = false;
    incoming.heads = 0;
    incoming.count = 0;
    peripherals_write(PERIPHERALS_PEER_BIT_TIME, (uint32_t)((sixteenths + BAUD / 2) / BAUD));
}

void peer_work(void) {
    uint8_t used = mode();
    if (used == NOT_IN_USE || (used == LEGACY && store_state() == STORE_LOADING))
        return;  // received bytes wait in the queue
    for (uint32_t n = 0; n < BYTES_PER_POLL; n++) {
        uint32_t received = peripherals_read(PERIPHERALS_PEER_RECEIVE);
        if (!(received & PERIPHERALS_PEER_RECEIVE_PRESENT_MASK)) break;
        uint8_t byte = (uint8_t)FIELD_GET(received, PERIPHERALS_PEER_RECEIVE_DATA);
        if (used == LEGACY)
            legacy_byte(byte);
        else
            frame_byte(byte);
    }
    if (used == LEGACY)
        legacy_work();
    else if (role() == MAIN)
        frames_work();
}

uint8_t peer_turn_to(uint16_t station, uint32_t angle) {
    if (!(peripherals_read(PERIPHERALS_BUILT) & PERIPHERALS_BUILT_PEER_MASK))
        return BUS_CAUSE_NOT_BUILT;
    if (mode() == NOT_IN_USE || role() != MAIN) return BUS_CAUSE_PEER_OFF;
    if (peer.phase == BUS_PEER_PHASE_TURNING) return BUS_CAUSE_BUSY;
    peer.phase = BUS_PEER_PHASE_TURNING;
    peer.ended = BUS_CAUSE_RUNNING;
    peer.station = station;
    peer.angle = angle;
    peer.since_ms = clock_ms();
    peer.faults = 0;
    if (mode() == LEGACY)
        send_legacy(NEXT);
    else
        poll_status(POLLING);
    return BUS_CAUSE_OK;
}

uint8_t peer_stop(void) {
    if (peer.phase != BUS_PEER_PHASE_TURNING || role() != MAIN) return BUS_CAUSE_OK;
    if (mode() == FRAMES)
        stop(STOPPING);
    else
        end(BUS_PEER_PHASE_FAILED, BUS_CAUSE_STOPPED);
    return BUS_CAUSE_OK;
}

uint8_t peer_state(void) { return peer.phase; }

uint8_t peer_cause(void) { return peer.ended; }

uint16_t peer_faults(void) { return peer.faults; }

void peer_reset_fault(void) { peer.reset_requested = peer.faults != 0; }

static uint8_t take_next(void) {
    uint16_t station = (uint16_t)bus_request_field(BUS_PEER_NEXT_REQUEST_STATION, 2);
    if (role() != SUB) return BUS_CAUSE_PEER_OFF;
    if (station >= station_list_count()) return BUS_CAUSE_NO_STATION;
    if (peer.phase == BUS_PEER_PHASE_TURNING) return BUS_CAUSE_BUSY;
    return journal_write(station, JOURNAL_NEXT);
}

uint8_t peer_operation(uint8_t operation) {
    switch (operation) {
    case BUS_OPERATION_PEER_NEXT: return take_next();
    case BUS_OPERATION_PEER: break;
    default: return BUS_CAUSE_NOT_BUILT;
    }
    bus_reply_field(BUS_PEER_REPLY_PHASE, peer.phase, 1);
    bus_reply_field(BUS_PEER_REPLY_ENDED, peer.ended, 1);
    bus_reply_field(BUS_PEER_REPLY_STATION, peer.station, 2);
    bus_reply_field(BUS_PEER_REPLY_STATIONS, station_list_count(), 2);
    bus_reply_field(BUS_PEER_REPLY_NEXT, next_station(), 2);
    bus_reply_field(BUS_PEER_REPLY_HEARD, peer.heard, 4);
    bus_reply_field(BUS_PEER_REPLY_GARBAGE, peer.garbage, 4);
    bus_reply_field(BUS_PEER_REPLY_REPEATED, peer.repeated, 4);
    return BUS_CAUSE_OK;
}
