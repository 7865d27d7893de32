// SPDX-License-Identifier: Apache-2.0
// journal -- records each step of a job before and after it is done, so that a loss of power never
// hides whether a cut had begun.
//
// Each record has a page of its own, and the pages are used in turn: so a power cut while a record
// is written spoils no other. A page that does not hold what was written is passed over.
#include "station/storage/journal.h"

#include "made/bus_protocol.h"
#include "station/storage/record_copies.h"
#include "station/storage/station_list.h"

#define AT 4096u  // address, behind the two copies of the station list
#define PAGES 64u
#define CHECKED 12u     // bytes of a record before its CRC-32
#define BLANK_PAGES 3u  // store passes over fewer worn pages, so behind these there is no record

static struct journal_record last, candidate;
static uint16_t page;         // that is read
static unsigned blank_pages;  // one after the other

static uint32_t crc_of(const struct journal_record* record) {
    return ~crc32_continue(UINT32_MAX, record, CHECKED);
}

static unsigned address_of(uint32_t sequence) { return AT + sequence % PAGES * STORE_PAGE; }

static void reset(void) { last = (struct journal_record){0}; }

static void read_page(void) { store_read(address_of(page), sizeof candidate); }

static void load(void) {
    page = 0;
    read_page();
}

static void take_page(void) {
    blank_pages = page && store_blank(sizeof candidate) ? blank_pages + 1u : 0;
    __builtin_memcpy(&candidate, store_bytes, sizeof candidate);
    if (candidate.sequence > last.sequence && candidate.sequence % PAGES == page &&
        crc_of(&candidate) == candidate.crc)
        last = candidate;
    if (++page == PAGES || blank_pages == BLANK_PAGES) return store_loaded(BUS_CAUSE_OK);
    read_page();
}

static void write_candidate(void) {
    candidate.crc = crc_of(&candidate);
    store_put(&candidate, sizeof candidate);
    store_write(address_of(candidate.sequence));
}

static void written(void) {
    last = candidate;
    store_end(BUS_CAUSE_OK);
}

static void write_on_next_page(void) {
    candidate.sequence++;
    write_candidate();
}

const struct store_client journal_client = {
    .reset = reset,
    .load = load,
    .read = take_page,
    .written = written,
    .rewrite = write_on_next_page,
};

const struct journal_record* journal_last(void) { return &last; }

uint8_t journal_write(uint16_t station, enum journal_step step) {
    uint8_t refused = store_may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    candidate = (struct journal_record){.sequence = last.sequence + 1,
                                        .list = station_list_identity(),
                                        .station = station,
                                        .step = (uint16_t)step};
    store_begin(&journal_client);
    write_candidate();
    return BUS_CAUSE_OK;
}
