/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Saves a canvas to a file and loads it, open rounds included: adding the same batches to both gives the same bits.
 * Untouched tiles take no space. The format is that of this build (versioned, numbers in memory layout). One thread at
 * a time.
 */
#ifndef COMMON_FILM_CANVAS_SAVE_H
#define COMMON_FILM_CANVAS_SAVE_H

#include "common/base/checked_file.h"
#include "common/film/canvas.h"

int canvas_save(const struct canvas *c, struct checked_file *out, struct error *e);
/* Loads into a new canvas of the same plan and grid. -EBADMSG: it is of another one; -EPROTO: of another version.
 * The canvas is unusable after an error. */
int canvas_load(struct canvas *c, struct checked_file *in, struct error *e);

#endif
