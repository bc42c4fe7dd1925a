/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The counters of a job: what went wrong and cost nothing, and what was verified. This list is all that there is of
 * them: core, status, journal, checkpoint, record and the JSON of both status and record follow from it, and each has a
 * field of its name in proto/stored.proto. What counts is where it happens: job->counts.NAME++.
 */
#ifndef COORDINATOR_CORE_COUNTS_H
#define COORDINATOR_CORE_COUNTS_H

#include <stdint.h>

/* X(name, its key in JSON; NULL: it is not shown, AT(its member of the message JobStatus) or NOWHERE) */
#define JOB_COUNTS(X)                                                                                 \
	X(repeats, "repeats", NOWHERE)		    /* results of leases that were merged already */  \
	X(refused, "refused", NOWHERE)		    /* results that could not count */                \
	X(faults, NULL, NOWHERE)		    /* those of them that no worker may send */       \
	X(failures, "failures", NOWHERE)	    /* leases that a worker tried and could not do */ \
	X(timeouts, "timeouts", NOWHERE)	    /* leases that were handed out again */           \
	X(duplicates, "duplicates", NOWHERE)	    /* second copies of leases that took long */      \
	X(verified, "verified", AT(verified))	    /* leases on which two workers agreed */          \
	X(mismatched, "mismatched", AT(mismatched)) /* ... of which the first two did not */

struct job_counts {
#define X(name, key, wire) uint64_t name;
	JOB_COUNTS(X)
#undef X
};

#endif
