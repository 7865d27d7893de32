// SPDX-License-Identifier: Apache-2.0
// image_station -- a station of an indexing machine (S4), main node and sub-node alike.
#include "hardware.h"
#include "i2c.h"
#include "image.h"
#include "index.h"
#include "job.h"
#include "keep.h"
#include "line_protocol.h"
#include "machine.h"
#include "panel.h"
#include "peer.h"
#include "readout.h"
#include "scope.h"
#include "sensor.h"
#include "settings.h"
#include "store.h"

_Static_assert(LINE_SETTING_COUNT + HARDWARE_AXES * LINE_PARAMETER_COUNT <= STORE_VALUES, "the EEPROM keeps all values");

const struct image_part image_parts[] = {
    {settings_start, 0, settings_operation},
    {sensor_start, sensor_work, sensor_operation},
    {index_start, index_work, index_operation},
    {peer_start, peer_work, peer_operation},
    {i2c_start, i2c_work, 0},
    {keep_start, 0, keep_operation},
    {store_start, store_work, 0},
    {machine_start, machine_work, 0},
    {job_start, job_work, job_operation},
    {panel_start, panel_work, 0},
    {readout_start, readout_work, 0},
    {scope_start, scope_work, scope_operation},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;
