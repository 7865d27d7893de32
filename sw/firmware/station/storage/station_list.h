// SPDX-License-Identifier: Apache-2.0
// station_list -- the angles that a job visits, saved in the EEPROM in two copies, with the
// settings of the station that belong to them.
//
// A new list is begun, given its stations in their order, and comes into force when it is saved.
#ifndef MOIRE_STATION_LIST_H
#define MOIRE_STATION_LIST_H

#include <stdbool.h>
#include <stdint.h>

#include "station/storage/store.h"

#define STATION_LIST_MAX 360u         // stations
#define STATION_LIST_TURN 129600000u  // a turn, 0.01 arcsec

extern const struct store_client station_list_client;

// The list in force. It has no stations while it is being loaded, or if there is none.
uint16_t station_list_count(void);              // stations
uint32_t station_list_angle(unsigned station);  // 0.01 arcsec; station < station_list_count
uint32_t station_list_generation(void);         // higher in each list that is saved; 0: none
uint32_t station_list_identity(void);           // its CRC-32; 0: none
bool station_list_damaged(void);                // one copy was damaged, the other is in force

// The new list. These return a bus_cause: ok, eeprom_busy or eeprom_missing, or
//   add: job_incomplete (none was begun), too_many_stations, angle_out_of_turn,
//        angles_not_ascending
//   save: no_stations. store_cause reports how the writing ends.
uint8_t station_list_begin(void);
uint8_t station_list_add(uint32_t angle);  // 0.01 arcsec, below a turn, more than the one before
uint16_t station_list_added(void);         // stations that it has so far
uint8_t station_list_save(void);

#endif
