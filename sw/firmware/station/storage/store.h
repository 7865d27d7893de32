// SPDX-License-Identifier: Apache-2.0
// store -- the EEPROM 24AA128 of a station as a block device: it reads bytes, and writes pages that
// it reads back, for one client at a time.
//
// Three clients keep their data in it: value_store, station_list and journal. At power-up, and when
// a missing EEPROM comes back, each loads in turn; afterwards one of them at a time may write. All
// of it is polled: a client asks for a transfer or for its next step, and store calls it when that
// is due. Whatever a client puts into several pages must be safe against a power cut on its own: a
// page that is being written when the power goes may hold anything afterwards.
#ifndef MOIRE_STORE_H
#define MOIRE_STORE_H

#include <stdbool.h>
#include <stdint.h>

#define STORE_PAGE 64u  // bytes

enum store_state { STORE_LOADING, STORE_READY, STORE_WRITING, STORE_MISSING };

struct store_client {
    void (*reset)(void);    // forgets what it loaded; called for all clients before any loads
    void (*load)(void);     // begins to load
    void (*read)(void);     // the bytes that store_read asked for are in store_bytes
    void (*step)(void);     // the step that store_step asked for; null: it asks for none
    void (*written)(void);  // the page that store_write wrote was read back as it should be
    void (*rewrite)(void);  // it was not; null: the same page is written again
    uint8_t* cause;         // receives how its writing ended; null: store_cause reports it
};

#define STORE_CLIENTS 3u
extern const struct store_client* const store_clients[STORE_CLIENTS];  // in the order of loading

void store_start(unsigned axes);
void store_work(void);
enum store_state store_state(void);
bool store_busy(void);          // it loads or writes
bool store_powering_up(void);   // it loads for the first time since store_start
uint8_t store_cause(void);      // a bus_cause: how the last loading or writing ended
uint8_t store_may_write(void);  // ok, eeprom_busy or eeprom_missing

// For the client that loads or writes.
extern uint8_t store_bytes[STORE_PAGE];             // what was read
void store_read(unsigned address, unsigned count);  // at most a page
bool store_blank(unsigned count);                   // all these bytes of store_bytes are erased
void store_step(void);
void store_loaded(uint8_t cause);  // this client has loaded; the next one follows
void store_begin(const struct store_client* client);  // begins to write; store_may_write said ok
void store_put(const void* bytes, unsigned count);    // appends to the page that is written next
unsigned store_filled(void);                          // bytes that it has so far
void store_write(unsigned address);
void store_end(uint8_t cause);  // the writing has ended

#endif
