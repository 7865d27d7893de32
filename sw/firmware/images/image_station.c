// SPDX-License-Identifier: Apache-2.0
// image_station -- parts of a station of an indexing machine (S4), both main node and sub-node.
#include "core/hardware.h"
#include "station/devices/i2c.h"
#include "core/image.h"
#include "station/table/turn.h"
#include "station/job/job.h"
#include "station/storage/nonvolatile.h"
#include "station/storage/saved_values.h"
#include "made/bus_protocol.h"
#include "station/job/edm.h"
#include "station/panel/panel.h"
#include "station/table/peer.h"
#include "station/devices/readout.h"
#include "bus/scope.h"
#include "station/table/sensor.h"
#include "station/settings.h"
#include "station/storage/store.h"
#include "station/storage/value_store.h"

_Static_assert(BUS_SETTING_COUNT + HARDWARE_AXES * BUS_PARAMETER_COUNT <= VALUE_STORE_MAX,
               "the EEPROM holds all values");

const struct image_part image_parts[] = {
    {settings_start, 0, settings_operation, 0},
    {sensor_start, sensor_work, sensor_operation, 0},
    {turn_start, turn_work, turn_operation, 0},
    {peer_start, peer_work, peer_operation, 0},
    {i2c_start, i2c_work, 0, 0},
    {saved_values_start, 0, nonvolatile_operation, 0},
    {store_start, store_work, 0, 0},
    {edm_start, edm_work, 0, 0},
    {job_start, job_work, job_operation, 0},
    {panel_start, panel_work, 0, 0},
    {readout_start, readout_work, 0, 0},
    {scope_start, scope_work, scope_operation, scope_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;
