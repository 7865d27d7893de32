// SPDX-License-Identifier: Apache-2.0
// job -- cuts all stations of the program, one after the other, with nobody touching it.
#ifndef MOIRE_JOB_H
#define MOIRE_JOB_H

#include <stdbool.h>
#include <stdint.h>

void job_start(unsigned axes);
void job_work(void);
uint8_t job_operation(uint8_t operation);

uint8_t job_state(void);         // a bus_job_state
uint8_t job_cause(void);         // why it waits, or did not go on: a bus_cause
uint16_t job_station(void);      // from 0 on
uint8_t job_answers(void);       // that it waits for: a bit for each bus_job_action
uint8_t job_do(uint8_t action);  // a bus_cause
uint8_t job_begin_list(
    void);  // station_list_begin and station_list_save, but not while a job is under way
uint8_t job_save_list(void);

#endif
