/* SPDX-License-Identifier: Apache-2.0 */
/* Whether the files of a store still hold what their names say. As blob.h. */
#ifndef COMMON_BLOB_BLOB_CHECK_H
#define COMMON_BLOB_BLOB_CHECK_H

#include "common/blob/blob.h"

/* Verifies the file's contents, unless that was done within the last so many seconds or (BLOB_SINCE_GIVEN) since it
 * was last opened, and it is still there: about a second per gigabyte. -EBADMSG: the contents are wrong or the file is
 * missing; it is kept as damaged.NAME, and the blob counts as missing until it is written again, while holds remain.
 * -ENOENT: not in the store. Any other error: it cannot be read at the moment. */
enum { BLOB_SINCE_GIVEN = -1 };
int blob_check(struct blob_store *s, const struct blob_hash *h, double seconds, struct error *e);
/* The same in parts, for a store whose thread must not wait for the disk: begin (1: begun; 0 or an error: the answer),
 * read on any thread while it says that there is more, some megabytes each time, and end, which frees it. The blob is
 * held meanwhile. Ended early: -ECANCELED, and nothing is known. */
struct blob_check;
int blob_check_begin(struct blob_check **c, struct blob_store *s, const struct blob_hash *h, double seconds,
		     struct error *e);
bool blob_is_being_checked(struct blob_store *s, const struct blob_hash *h); /* begun, and not ended */
bool blob_check_read(struct blob_check *c);
int blob_check_end(struct blob_check *c, struct error *e);

#endif
