/* SPDX-License-Identifier: Apache-2.0 */
/* Checks that the files of a store still have the contents that their names stand for. Threads as for blob.h. */
#ifndef COMMON_BLOB_BLOB_CHECK_H
#define COMMON_BLOB_BLOB_CHECK_H

#include "common/blob/blob.h"

/* Reads the file of a blob and compares the hash, which takes about a second per gigabyte; skipped if the file exists
 * and that was done within the last `seconds`, or with BLOB_SINCE_OPENED since it was last opened. Returns 0; -EBADMSG
 * if the file is missing or its contents are wrong (it is then kept as damaged.NAME, and the blob counts as missing
 * until it is written again, while holds remain); -ENOENT if the blob is not in the store; another -errno if the file
 * cannot be read at the moment. */
enum { BLOB_SINCE_OPENED = -1 };
int blob_check(struct blob_store *s, const struct blob_hash *h, double seconds, struct error *e);
/* Like blob_check, but in parts, for a store whose thread must not wait for the disk. blob_check_begin returns 1 if a
 * check has begun, otherwise the result of the check. Then call blob_check_read, on any thread, as long as it returns
 * true; each call reads some megabytes. blob_check_end returns the result and frees the check; if it is called early,
 * the result is -ECANCELED and nothing is known. The blob is held in the meantime. */
struct blob_check;
int blob_check_begin(struct blob_check **out, struct blob_store *s, const struct blob_hash *h, double seconds,
		     struct error *e);
bool blob_is_being_checked(struct blob_store *s, const struct blob_hash *h); /* a check has begun and not ended */
bool blob_check_read(struct blob_check *c);
int blob_check_end(struct blob_check *c, struct error *e);

#endif
