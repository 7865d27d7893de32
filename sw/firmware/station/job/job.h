// SPDX-License-Identifier: Apache-2.0
// job -- cuts all stations of the list, one after the other, without an operator.
#ifndef MOIRE_JOB_H
#define MOIRE_JOB_H

#include <stdbool.h>
#include <stdint.h>

void job_start(unsigned axes);
void job_work(void);
uint8_t job_operation(uint8_t operation);

uint8_t job_state(void);     // a bus_job_state
uint8_t job_cause(void);     // why it waits or has stopped: a bus_cause
uint16_t job_station(void);  // from 0
uint8_t job_answers(void);   // the actions that it would accept: bit n is the bus_job_action n

// Does a bus_job_action. Returns a bus_cause: ok, or why the action is refused.
uint8_t job_do(uint8_t action);

// As station_list_begin and station_list_save, but they return job_active while a job is under way
// and busy while the table turns.
uint8_t job_begin_list(void);
uint8_t job_save_list(void);

#endif
