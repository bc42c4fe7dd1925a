/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The fields of a job. This one list generates struct job_record and the record in the spool (coordinator/store),
 * struct job_status, struct job_view, the JSON of the status and the message JobStatus (coordinator/live_job), and,
 * for the counters, struct job_counts, journals, checkpoints, restart and extension. Written by hand are fields that
 * have parts (estimates, strategies, convergence, classes), those that are composed of several values (view.c,
 * record.c), and those that other interfaces define: submissions, the columns of the database (ledger_job.h), the
 * files of earlier versions.
 *
 *   TEXT(member, bytes, in, by, key, shown, wire)
 *   NUMBER(kind, member, in, by, key, shown, wire)   kind: one of field_KIND below
 *   COUNT(member, by, key, shown, wire)              uint64_t, in the record; its key is in the object "counts"
 *   COUNTER(member, key, wire)                       a member of struct job_counts, for job->counts.MEMBER++
 *
 * - in: IN_RECORD: a member of struct job_record, kept after the job has ended; IN_VIEW: a member of struct
 *   job_view, only shown.
 * - by: BY_CORE: also a member of struct job_status, whose value is shown while the job is live; BY_JOBS: set where
 *   the record or the view is filled.
 * - key: its name in the record; shown: its name in the JSON of the status. NULL: it is not there. Counts and
 *   counters are in the object "counts" of both.
 * - wire: AT(member of JobStatus, proto/farm.proto), or NOWHERE.
 *
 * Each counter has a field of its name in Counts of proto/stored.proto.
 */
#ifndef COORDINATOR_CORE_JOB_FIELDS_H
#define COORDINATOR_CORE_JOB_FIELDS_H

#include <stdbool.h>
#include <stdint.h>

/* Real numbers that may be unknown and are then shown as null: `positive` ones are unknown unless greater than 0,
 * `known` ones if negative. */
typedef int field_int;
typedef uint32_t field_u32;
typedef uint64_t field_u64;
typedef bool field_bool;
typedef double field_real, field_positive, field_known;

/* clang-format off */
#define JOB_FIELDS(TEXT, NUMBER, COUNT, COUNTER) \
	NUMBER(u64, id, IN_RECORD, BY_JOBS, "id", NULL, AT(job)) \
	TEXT(name, 128, IN_RECORD, BY_JOBS, "name", "name", AT(name)) \
	TEXT(integrator, 16, IN_RECORD, BY_JOBS, "integrator", "integrator", NOWHERE) \
	TEXT(state, 16, IN_RECORD, BY_JOBS, "state", "state", AT(state)) \
	TEXT(reason, 16, IN_RECORD, BY_JOBS, "reason", "reason", AT(reason)) /* the bound that ended it */ \
	TEXT(why, 256, IN_RECORD, BY_CORE, "why", NULL, NOWHERE) /* why it failed, or a lease's last failure */ \
	TEXT(output, 1024, IN_RECORD, BY_JOBS, "output", "output", AT(output)) /* where the client wants its image */ \
	/* Name in the owner's certificate; "": no certificate. */ \
	TEXT(owner, 72, IN_RECORD, BY_JOBS, "owner", "owner", AT(owner)) \
	NUMBER(int, priority, IN_RECORD, BY_CORE, "priority", "priority", AT(priority)) \
	/* Exit code of a program that waits for the job. */ \
	NUMBER(u32, exit_code, IN_RECORD, BY_JOBS, "exitCode", NULL, AT(exit_code)) \
	NUMBER(bool, has_result, IN_RECORD, BY_JOBS, "result", "result", AT(fetchable)) \
	/* When the result was deleted; s since 1970. */ \
	NUMBER(positive, cleared, IN_RECORD, BY_JOBS, "cleared", "cleared", NOWHERE) \
	/* Number of extensions, as in the ledger. */ \
	NUMBER(u64, extended, IN_RECORD, BY_JOBS, "extended", NULL, NOWHERE) \
	NUMBER(bool, cut, IN_RECORD, BY_JOBS, "cut", NULL, NOWHERE) /* an extension was cancelled since */ \
	NUMBER(real, submitted, IN_RECORD, BY_JOBS, "submitted", "submitted", AT(submitted)) /* s since 1970 */ \
	NUMBER(real, ended, IN_RECORD, BY_JOBS, "ended", "ended", NOWHERE) /* s since 1970; 0: not yet */ \
	/* The end in observed time, s (store/age_clock.h). */ \
	NUMBER(known, ended_seen, IN_RECORD, BY_JOBS, "endedSeen", NULL, NOWHERE) \
	NUMBER(real, progress, IN_RECORD, BY_CORE, "progress", "progress", AT(progress)) /* [0,1], never decreases */ \
	NUMBER(known, rel_error, IN_RECORD, BY_JOBS, "relError", "error", AT(error)) /* of the last image */ \
	/* Estimate of the relative error, even if its interval is unknown. */ \
	NUMBER(known, rel_error_about, IN_RECORD, BY_JOBS, "relErrorAbout", "errorAbout", AT(error_about)) \
	/* Why the interval of the error is unknown; "": it is known. */ \
	TEXT(rel_error_doubt, STATED_ERROR_TEXT_MAX, IN_RECORD, BY_JOBS, "relErrorDoubt", "errorDoubt", NOWHERE) \
	NUMBER(positive, target_error, IN_RECORD, BY_JOBS, "targetError", "targetError", AT(target_error)) \
	NUMBER(real, cpu_seconds, IN_RECORD, BY_JOBS, "cpuSeconds", "cpuSeconds", AT(cpu_seconds)) /* of all leases */ \
	NUMBER(real, bootstrap_cpu_seconds, IN_RECORD, BY_JOBS, "bootstrapCpuSeconds", "bootstrapCpuSeconds", \
	       AT(bootstrap_cpu_seconds)) \
	NUMBER(real, bootstrap_seconds, IN_RECORD, BY_CORE, "bootstrapSeconds", "bootstrapSeconds", \
	       AT(bootstrap_seconds)) /* wall clock, first lease to first round; core: NAN: not yet */ \
	COUNT(rounds, BY_CORE, "rounds", "rounds", AT(rounds)) /* complete rounds */ \
	COUNT(mutations, BY_CORE, "mutations", "mutations", NOWHERE) \
	COUNT(leases_merged, BY_CORE, "merged", NULL, NOWHERE) /* render leases, including those of open rounds */ \
	/* How often a chain accepted nothing during an epoch. */ \
	COUNT(stuck, BY_JOBS, "stuck", NULL, NOWHERE) \
	COUNT(longest_stuck, BY_JOBS, "longestStuck", NULL, NOWHERE) /* most rejections in a row */ \
	/* Fraction of the leases that two workers compute. */ \
	NUMBER(real, verify, IN_RECORD, BY_CORE, "verify", "verify", AT(verify)) \
	TEXT(mixture, PLAN_MUTATIONS_MAX, IN_RECORD, BY_JOBS, "mixture", "mixture", NOWHERE) \
	TEXT(note, STRATEGY_NOTE_MAX, IN_RECORD, BY_JOBS, "note", "note", AT(note)) \
	/* Notes about the scene, one per line (text_join_lines). */ \
	TEXT(scene_notes, HEADER_SCENE_NOTES_MAX, IN_RECORD, BY_JOBS, "sceneNotes", NULL, NOWHERE) \
	NUMBER(positive, b, IN_RECORD, BY_JOBS, "b", "b", NOWHERE) /* of the last image */ \
	/* Bootstrap samples or mutations merged per second, over the last half minute. */ \
	NUMBER(real, rate, IN_VIEW, BY_CORE, NULL, "rate", AT(rate)) \
	NUMBER(known, eta, IN_VIEW, BY_CORE, NULL, "eta", AT(eta)) /* s; core: NAN: unknown */ \
	NUMBER(known, eta_low, IN_VIEW, BY_CORE, NULL, NULL, AT(eta_low)) /* of the 90 % interval */ \
	NUMBER(known, eta_high, IN_VIEW, BY_CORE, NULL, NULL, AT(eta_high)) \
	NUMBER(u32, leases, IN_VIEW, BY_CORE, NULL, "leases", AT(leases)) /* leases out */ \
	/* Machines that hold leases of the job. */ \
	NUMBER(u32, workers, IN_VIEW, BY_CORE, NULL, "workers", AT(workers)) \
	/* Machines that could compute it. */ \
	NUMBER(u32, machines, IN_VIEW, BY_CORE, NULL, "machines", NOWHERE) \
	/* Machines due to it by its priority (core/share.h). */ \
	NUMBER(known, share, IN_VIEW, BY_CORE, NULL, NULL, AT(share)) \
	/* `workers` and `machines` in words, and which jobs go first. */ \
	TEXT(place, 160, IN_VIEW, BY_CORE, NULL, "place", AT(place)) \
	/* Fraction of its stored data that has been read, after a restart. */ \
	NUMBER(known, reading, IN_VIEW, BY_JOBS, NULL, "reading", NOWHERE) \
	/* Why no worker computes it; "": one does. */ \
	TEXT(waiting, 256, IN_VIEW, BY_CORE, NULL, "waiting", NOWHERE) \
	/* `place` and `waiting` for its owner, without the ids of other owners' jobs. */ \
	TEXT(owners_place, 160, IN_VIEW, BY_CORE, NULL, NULL, NOWHERE) \
	TEXT(owners_waiting, 256, IN_VIEW, BY_CORE, NULL, NULL, NOWHERE) \
	COUNTER(repeats, "repeats", NOWHERE)         /* results of leases that had been merged before */ \
	COUNTER(refused, "refused", NOWHERE)         /* results that did not count */ \
	COUNTER(faults, NULL, NOWHERE)               /* those refused results that no correct worker sends */ \
	COUNTER(failures, "failures", NOWHERE)       /* leases that a worker could not compute */ \
	COUNTER(timeouts, "timeouts", NOWHERE)       /* leases that timed out and were handed out again */ \
	COUNTER(lost, "lost", NOWHERE)               /* leases whose worker was lost before it sent a result */ \
	COUNTER(duplicates, "duplicates", NOWHERE)   /* second copies of slow leases */ \
	COUNTER(verified, "verified", AT(verified))  /* leases on which two workers agreed */ \
	COUNTER(mismatched, "mismatched", AT(mismatched)) /* leases whose first two answers differed */
/* clang-format on */

/* For lists of only some kinds of fields. */
#define JOB_NO_FIELD(...)
#define JOB_COUNTERS(COUNTER) JOB_FIELDS(JOB_NO_FIELD, JOB_NO_FIELD, JOB_NO_FIELD, COUNTER)

struct job_counts {
#define COUNTER(member, key, wire) uint64_t member;
	JOB_COUNTERS(COUNTER)
#undef COUNTER
};

#endif
