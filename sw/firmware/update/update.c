// SPDX-License-Identifier: Apache-2.0
// update -- new firmware over the bus, in two images behind the factory image, and the choice of
// the image that runs after power-up.
//
// The factory image (0) is never written. An image counts only if its entry is whole, its mark is
// whole and its bytes have the CRC-32 of the entry. The order of an update is: erase the entry with
// its mark, erase and write the image, read it back, write the entry, run the image on trial, write
// the mark when the host that reached the new firmware asks for it. A cut of the power before the
// last bit of the mark leaves an image that does not count, and the one before it runs.
#include "update/update.h"

#include "axis/axis.h"
#include "bus/bus.h"
#include "core/clock.h"
#include "core/crc32.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "update/flash.h"

#define IMAGES 2u
#define SPACING 0x10000u                // bytes from image to image
#define ENTRY (SPACING - FLASH_SECTOR)  // of an image, in a sector of its own
#define MARK (ENTRY + FLASH_PAGE)       // in a page of its own
#define LONGEST 32768u                  // PROGRAM_BYTES of rtl/node.sv
#define BLOCK 32u                       // bytes of operation.write_update
#define PIECE 64u                       // bytes whose CRC is made in one go
#define MAGIC 0x314D4957u
#define RUN_MS 100u  // after the request, so that its reply has been sent and can be repeated

struct entry {
    uint32_t magic;
    uint32_t generation;  // that of the newest image is the highest
    uint32_t bytes;       // of the image
    uint32_t image_crc;
    uint32_t map_crc;  // register map for which it was made
    uint32_t crc;      // of the words above; all bits inverted, it is the mark
};

static struct update {
    unsigned axes;
    struct entry entry;  // of the image that is written
    uint32_t own_crc;    // of the image that runs
    uint32_t at;         // byte of the image that is to be erased or checked next
    uint32_t crc;        // of the bytes before it
    uint32_t run_ms;     // time at which run was requested
    uint8_t state;       // bus_update_state
    uint8_t ended;       // bus_cause
    uint8_t image;       // that is written
    bool trial;          // the image that runs has no mark
} update;

static uint32_t address_of(unsigned image) { return flash_start() + image * SPACING; }

static uint32_t crc_of(const struct entry* entry) {
    return ~crc32_continue(UINT32_MAX, entry, sizeof *entry - sizeof entry->crc);
}

// Whether an image has a whole entry that this bitstream can run.
static bool entered(unsigned image, struct entry* entry) {
    flash_read(address_of(image) + ENTRY, entry, sizeof *entry);
    return entry->magic == MAGIC && entry->crc == crc_of(entry) && entry->bytes <= LONGEST &&
           entry->map_crc == node_read(NODE_MAP_CRC);
}

static bool marked(unsigned image, const struct entry* entry) {
    uint32_t mark;
    flash_read(address_of(image) + MARK, &mark, sizeof mark);
    return mark == ~entry->crc;
}

static uint32_t continue_crc(uint32_t crc, unsigned image, uint32_t at, uint32_t bytes) {
    uint8_t piece[PIECE];
    flash_read(address_of(image) + at, piece, bytes);
    return crc32_continue(crc, piece, bytes);
}

static uint32_t piece_at(uint32_t at, uint32_t bytes) {
    return bytes - at < PIECE ? bytes - at : PIECE;
}

static bool whole(unsigned image, const struct entry* entry) {
    uint32_t crc = UINT32_MAX, at = 0;
    while (at < entry->bytes) {
        uint32_t bytes = piece_at(at, entry->bytes);
        crc = continue_crc(crc, image, at, bytes);
        at += bytes;
    }
    return ~crc == entry->image_crc;
}

// The newest image that counts, or 0.
static unsigned choose(void) {
    unsigned chosen = 0;
    uint32_t newest = 0;
    for (unsigned image = 1; image <= IMAGES; image++) {
        struct entry entry;
        if (!entered(image, &entry) || !marked(image, &entry) || entry.generation <= newest ||
            !whole(image, &entry))
            continue;
        chosen = image;
        newest = entry.generation;
    }
    return chosen;
}

void update_start(unsigned axes) {
    unsigned image = flash_image();
    struct entry entry;
    update = (struct update){.axes = axes};
    if (flash_start() == 0) return;
    if (image == 0) {
        image = choose();
        if (image) flash_run(image, false);
    } else if (entered(image, &entry)) {
        update.own_crc = entry.image_crc;
        update.trial = !marked(image, &entry);
    }
}

static void end(uint8_t cause) {
    update.state = BUS_UPDATE_STATE_IDLE;
    update.ended = cause;
}

// The entry goes first: while its image is erased and written, it does not count.
static void erase_next(void) {
    if (flash_busy()) return;
    if (update.at == update.entry.bytes) {
        update.state = BUS_UPDATE_STATE_WRITING;
        update.ended = BUS_CAUSE_OK;
        return;
    }
    flash_erase(address_of(update.image) + update.at);
    update.at = update.entry.bytes - update.at < FLASH_SECTOR ? update.entry.bytes
                                                              : update.at + FLASH_SECTOR;
}

static void enter(void) {
    struct entry entry;
    flash_program(address_of(update.image) + ENTRY, &update.entry, sizeof update.entry);
    if (!flash_wait() || !entered(update.image, &entry)) return end(BUS_CAUSE_FLASH_FAILED);
    update.state = BUS_UPDATE_STATE_CHECKED;
    update.ended = BUS_CAUSE_OK;
}

static void check_next(void) {
    uint32_t bytes = piece_at(update.at, update.entry.bytes);
    if (bytes) {
        update.crc = continue_crc(update.crc, update.image, update.at, bytes);
        update.at += bytes;
    } else if (~update.crc == update.entry.image_crc) {
        enter();
    } else {
        end(BUS_CAUSE_FIRMWARE_DAMAGED);
    }
}

void update_work(void) {
    if (update.state == BUS_UPDATE_STATE_ERASING) erase_next();
    if (update.state == BUS_UPDATE_STATE_CHECKING) check_next();
    if (update.state == BUS_UPDATE_STATE_STARTING && clock_ms() - update.run_ms >= RUN_MS)
        flash_run(update.image, true);
}

bool update_idle(void) { return update.state == BUS_UPDATE_STATE_IDLE; }

static bool drive_on(void) {
    for (unsigned n = 0; HARDWARE_DRIVES && n < update.axes; n++)
        if (axis_flags(n) & BUS_FLAG_ENABLED) return true;
    return false;
}

static uint32_t request_word(uint32_t at) { return (uint32_t)bus_request_field(at, 4); }

static uint8_t begin(void) {
    uint32_t newest = 0, memory = FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_MEMORY) * 1024;
    struct entry entry = {
        .magic = MAGIC,
        .bytes = request_word(BUS_BEGIN_UPDATE_REQUEST_BYTES),
        .image_crc = request_word(BUS_BEGIN_UPDATE_REQUEST_CRC),
        .map_crc = request_word(BUS_BEGIN_UPDATE_REQUEST_MAP_CRC),
    };
    if (entry.bytes == 0) return BUS_CAUSE_OUT_OF_RANGE;
    if (entry.bytes > LONGEST) return BUS_CAUSE_FIRMWARE_TOO_LONG;
    if (entry.map_crc != node_read(NODE_MAP_CRC) ||
        request_word(BUS_BEGIN_UPDATE_REQUEST_MEMORY) > memory ||
        bus_request_field(BUS_BEGIN_UPDATE_REQUEST_AXES, 1) < update.axes)
        return BUS_CAUSE_FIRMWARE_OF_OTHER_NODE;
    if (drive_on()) return BUS_CAUSE_DRIVE_ON;
    if (update.trial) return BUS_CAUSE_FIRMWARE_ON_TRIAL;
    if (update.state == BUS_UPDATE_STATE_ERASING || update.state == BUS_UPDATE_STATE_STARTING)
        return BUS_CAUSE_NOT_NOW;
    if (!flash_wait()) return BUS_CAUSE_FLASH_FAILED;  // a block of an update that is given up
    for (unsigned image = 1; image <= IMAGES; image++) {
        struct entry old;
        if (entered(image, &old) && old.generation > newest) newest = old.generation;
    }
    entry.generation = newest + 1;
    entry.crc = crc_of(&entry);
    update.entry = entry;
    update.image = flash_image() == 1 ? 2 : 1;
    update.at = 0;
    update.state = BUS_UPDATE_STATE_ERASING;
    update.ended = BUS_CAUSE_RUNNING;
    flash_erase(address_of(update.image) + ENTRY);
    return BUS_CAUSE_OK;
}

static uint8_t write(void) {
    uint32_t at = (uint32_t)bus_request_field(BUS_WRITE_UPDATE_REQUEST_BLOCK, 2) * BLOCK;
    uint32_t words[BLOCK / 4];
    if (update.state != BUS_UPDATE_STATE_WRITING) return BUS_CAUSE_NOT_NOW;
    if (at >= update.entry.bytes) return BUS_CAUSE_OUT_OF_RANGE;
    for (unsigned n = 0; n < BLOCK / 4; n++)
        words[n] = request_word(BUS_WRITE_UPDATE_REQUEST_WORD_0 + 4 * n);
    if (!flash_wait()) {
        end(BUS_CAUSE_FLASH_FAILED);
        return BUS_CAUSE_FLASH_FAILED;
    }
    flash_program(address_of(update.image) + at, words, sizeof words);
    return BUS_CAUSE_OK;
}

static uint8_t check(void) {
    if (update.state != BUS_UPDATE_STATE_WRITING) return BUS_CAUSE_NOT_NOW;
    if (!flash_wait()) return BUS_CAUSE_FLASH_FAILED;
    update.at = 0;
    update.crc = UINT32_MAX;
    update.state = BUS_UPDATE_STATE_CHECKING;
    update.ended = BUS_CAUSE_RUNNING;
    return BUS_CAUSE_OK;
}

static uint8_t run(void) {
    if (update.state != BUS_UPDATE_STATE_CHECKED) return BUS_CAUSE_NOT_NOW;
    if (drive_on()) return BUS_CAUSE_DRIVE_ON;
    update.state = BUS_UPDATE_STATE_STARTING;
    update.run_ms = clock_ms();
    return BUS_CAUSE_OK;
}

// The trial ends only after the mark has been read back.
static uint8_t confirm(void) {
    unsigned image = flash_image();
    struct entry entry;
    uint32_t mark;
    if (image == 0 || !entered(image, &entry)) return BUS_CAUSE_NOT_NOW;
    mark = ~entry.crc;
    if (update.trial) flash_program(address_of(image) + MARK, &mark, sizeof mark);
    if (!flash_wait() || !marked(image, &entry)) return BUS_CAUSE_FLASH_FAILED;
    flash_keep();
    update.trial = false;
    return BUS_CAUSE_OK;
}

static uint8_t act(void) {
    switch (bus_request_field(BUS_UPDATE_REQUEST_ACTION, 1)) {
    case BUS_UPDATE_ACTION_CHECK: return check();
    case BUS_UPDATE_ACTION_RUN: return run();
    case BUS_UPDATE_ACTION_CONFIRM: return confirm();
    default: return BUS_CAUSE_OUT_OF_RANGE;
    }
}

static uint8_t report(void) {
    bus_reply_field(BUS_UPDATE_STATE_REPLY_STATE, update.state, 1);
    bus_reply_field(BUS_UPDATE_STATE_REPLY_ENDED, update.ended, 1);
    bus_reply_field(BUS_UPDATE_STATE_REPLY_IMAGE, flash_image(), 1);
    bus_reply_field(BUS_UPDATE_STATE_REPLY_TRIAL, update.trial, 1);
    bus_reply_field(BUS_UPDATE_STATE_REPLY_CRC, update.own_crc, 4);
    bus_reply_field(BUS_UPDATE_STATE_REPLY_LONGEST, LONGEST, 4);
    return BUS_CAUSE_OK;
}

uint8_t update_operation(uint8_t operation) {
    if (flash_start() == 0) return BUS_CAUSE_NOT_BUILT;
    switch (operation) {
    case BUS_OPERATION_UPDATE_STATE: return report();
    case BUS_OPERATION_BEGIN_UPDATE: return begin();
    case BUS_OPERATION_WRITE_UPDATE: return write();
    case BUS_OPERATION_UPDATE: return act();
    default: return BUS_CAUSE_NOT_BUILT;
    }
}
