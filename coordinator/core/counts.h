/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The counters of a job: events that did no harm, and verification. All users are generated from this list: core,
 * status, journal, checkpoint, record and the JSON of both status and record. Each counter also has a field of its name
 * in proto/stored.proto. Count with job->counts.NAME++ where the event happens.
 */
#ifndef COORDINATOR_CORE_COUNTS_H
#define COORDINATOR_CORE_COUNTS_H

#include <stdint.h>

/* X(name, its key in JSON; NULL: not shown, AT(its member of the message JobStatus) or NOWHERE) */
#define JOB_COUNTS(X)                                                                                        \
	X(repeats, "repeats", NOWHERE)		    /* results of leases that were merged before */          \
	X(refused, "refused", NOWHERE)		    /* results that could not count */                       \
	X(faults, NULL, NOWHERE)		    /* ... of these, results that no correct worker sends */ \
	X(failures, "failures", NOWHERE)	    /* leases that a worker could not compute */             \
	X(timeouts, "timeouts", NOWHERE)	    /* leases that timed out and were handed out again */    \
	X(duplicates, "duplicates", NOWHERE)	    /* second copies of slow leases */                       \
	X(verified, "verified", AT(verified))	    /* leases on which two workers agreed */                 \
	X(mismatched, "mismatched", AT(mismatched)) /* ... of which the first two disagreed */

struct job_counts {
#define X(name, key, wire) uint64_t name;
	JOB_COUNTS(X)
#undef X
};

#endif
