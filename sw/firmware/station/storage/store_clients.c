// SPDX-License-Identifier: Apache-2.0
// store_clients -- the clients of store, in the order in which they load: the station list compares
// its generation with that of the values, which must be known by then.
#include "station/storage/journal.h"
#include "station/storage/station_list.h"
#include "station/storage/store.h"
#include "station/storage/value_store.h"

const struct store_client* const store_clients[STORE_CLIENTS] = {
    &value_store_client, &station_list_client, &journal_client};
