// SPDX-License-Identifier: Apache-2.0
// panel -- key-pad and character display of a station: what the job does, in words, and by key its
// station list and its actions. Either device may be absent.
#ifndef MOIRE_PANEL_H
#define MOIRE_PANEL_H

void panel_start(unsigned axes);
void panel_work(void);

#endif
