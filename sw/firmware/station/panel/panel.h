// SPDX-License-Identifier: Apache-2.0
// panel -- key-pad and character display: what the job does, in words, and its program and answers
// by key. Either may be missing.
#ifndef MOIRE_PANEL_H
#define MOIRE_PANEL_H

void panel_start(unsigned axes);
void panel_work(void);

#endif
