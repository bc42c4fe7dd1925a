/*
 * A job's journal: what was merged since its last checkpoint, one record after the other in jobs/jN/journal.G (G counts the
 * checkpoints). A record is believed when its checksum fits; the first that does not, and all behind it, were not whole when
 * the machine stopped, and are cut off. What is appended is durable after journal_sync.
 * A file of which a call failed is bad: it is neither written nor flushed again, because a flush that failed may have forgotten
 * what it did not write and would say next time that all is well. What is appended from then on is kept in memory until
 * journal_renew has brought all into a new file. (Who reads a journal believes what is read: the machine that failed to write it
 * has forgotten that with its process.)
 * One thread at a time, but journal_sync may run beside the others: the handle is counted, so that a flush outlives a close.
 * Numbers are in the byte order of the machine: a spool stays where it is.
 */
#ifndef COORDINATOR_STORE_JOURNAL_H
#define COORDINATOR_STORE_JOURNAL_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum journal_kind {
	JOURNAL_BATCH = 1,  /* a frame as it came: prefix, header, payload */
	JOURNAL_PINNED = 2, /* the fingerprint that the job belongs to */
	JOURNAL_LOOK = 3,   /* struct forecast_look */
	JOURNAL_COUNTS = 4, /* struct job_counts: in all, not since the last */
};

struct journal;

/* A new one, durable with its name before it returns. The folder exists. */
int journal_create(struct journal **j, const char *folder, uint64_t job, uint64_t generation, struct error *e);

/* elapsed: as it was given to journal_append. Not 0: the reading stops with this code. */
typedef int journal_visit(void *user, enum journal_kind kind, double elapsed, const unsigned char *body, size_t size, struct error *e);

/* Visits what is whole, cuts off the rest (*cut: so many bytes), goes on behind it. -ENOENT: there is none; -EBADMSG: that of
 * another job or generation. */
int journal_open(struct journal **j, const char *folder, uint64_t job, uint64_t generation, journal_visit *visit, void *user,
		 uint64_t *cut, struct error *e);
void journal_hold(struct journal *j);
void journal_release(struct journal *j); /* NULL: nothing */

/* Room on the disk for a record with a body of so many bytes, so that appending it does not fail for want of it. -ENOSPC */
int journal_reserve(struct journal *j, size_t body, struct error *e);
/* The body is a and b, one behind the other. A record that cannot be written makes the journal bad, and stays in memory: -ENOMEM,
 * -EFBIG; but what is not of the result (looks, counts) is just not written when the disk is full: -ENOSPC. */
int journal_append(struct journal *j, enum journal_kind kind, double elapsed, const void *a, size_t a_size, const void *b,
		   size_t b_size, struct error *e);
uint64_t journal_bytes(const struct journal *j); /* all that was appended, or read */
uint64_t journal_generation(const struct journal *j);
/* All that was appended before the call is durable when it returns; costs nothing when it was already. Any thread, one at a
 * time. */
int journal_sync(struct journal *j, struct error *e);

/* All of a bad journal into a new file, flushed, in the place of the old one; then it is a good one. -EAGAIN: a
 * flush is still under way. */
bool journal_is_bad(const struct journal *j);
int journal_renew(struct journal *j, struct error *e);
/* All that was appended is safe elsewhere: journal_sync has nothing more to do. */
void journal_settle(struct journal *j);

/* journal.G's of the folder but that of `keep` go; UINT64_MAX: all. */
void journal_clear(const char *folder, uint64_t keep);

#endif
