/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A canvas in a file and back, open rounds too: whoever adds the same batches to both gets the same bits. What no batch
 * touched takes no room. The form is that of this build (versioned; numbers as they lie in memory). One thread at a
 * time.
 */
#ifndef COMMON_FILM_CANVAS_SAVE_H
#define COMMON_FILM_CANVAS_SAVE_H

#include "common/base/checked_file.h"
#include "common/film/canvas.h"

int canvas_save(const struct canvas *c, struct checked_file *out, struct error *e);
/* Into a new canvas of the same plan and grid. -EBADMSG: of another one; -EPROTO: of another version; the canvas is of
 * no use then. */
int canvas_load(struct canvas *c, struct checked_file *in, struct error *e);

#endif
