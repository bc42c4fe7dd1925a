/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The plain fields of a job's record. From this list follow struct job_record, the record in the spool, the JSON of the
 * status, and the message JobStatus; what has parts, or is made of several values, is done by hand (record.c,
 * job/view.c).
 *
 *   TEXT(member, bytes, key, shown, wire)
 *   NUMBER(kind, member, key, shown, wire)     kind: of fields.h
 *   COUNT(member, key, shown, wire)            uint64_t; its key is in the object "counts" of both JSONs
 *
 * key: its name in the record; shown: in the status; NULL: it is not there. wire: AT(member of JobStatus), or NOWHERE.
 */
#ifndef COORDINATOR_STORE_RECORD_FIELDS_H
#define COORDINATOR_STORE_RECORD_FIELDS_H

#define RECORD_FIELDS(TEXT, NUMBER, COUNT)                                                                            \
	NUMBER(u64, id, "id", NULL, AT(job))                                                                          \
	TEXT(name, 128, "name", "name", AT(name))                                                                     \
	TEXT(integrator, 16, "integrator", "integrator", NOWHERE)                                                     \
	TEXT(state, 16, "state", "state", AT(state))                                                                  \
	TEXT(reason, 16, "reason", "reason", AT(reason))   /* the bound that ended it */                              \
	TEXT(why, 256, "why", NULL, NOWHERE)		   /* why it failed */                                        \
	TEXT(output, 1024, "output", "output", AT(output)) /* where the client wants its image */                     \
	TEXT(owner, 72, "owner", "owner", AT(owner))	   /* name in the owner's certificate; "": none */            \
	NUMBER(int, priority, "priority", "priority", AT(priority))                                                   \
	NUMBER(u32, exit_code, "exitCode", NULL, AT(exit_code)) /* of a program that waits for it */                  \
	NUMBER(bool, has_result, "result", "result", AT(fetchable))                                                   \
	NUMBER(positive, cleared, "cleared", "cleared", NOWHERE)	 /* when its result was; s since 1970 */      \
	NUMBER(u64, extended, "extended", NULL, NOWHERE)		 /* number of extensions, as in the ledger */ \
	NUMBER(real, submitted, "submitted", "submitted", AT(submitted)) /* s since 1970 */                           \
	NUMBER(real, ended, "ended", "ended", NOWHERE)			 /* s since 1970; 0: not yet */               \
	NUMBER(known, ended_seen, "endedSeen", NULL, NOWHERE) /* observed time in s at that moment (seen.h) */        \
	NUMBER(real, progress, "progress", "progress", AT(progress))                                                  \
	NUMBER(known, rel_error, "relError", "error", AT(error))                                                      \
	TEXT(rel_error_doubt, STATED_ERROR_TEXT, "relErrorDoubt", "errorDoubt", NOWHERE) /* why not */                \
	NUMBER(positive, target_error, "targetError", "targetError", AT(target_error))                                \
	NUMBER(real, cpu_seconds, "cpuSeconds", "cpuSeconds", AT(cpu_seconds)) /* of all leases */                    \
	NUMBER(real, bootstrap_cpu_seconds, "bootstrapCpuSeconds", "bootstrapCpuSeconds", AT(bootstrap_cpu_seconds))  \
	NUMBER(real, bootstrap_seconds, "bootstrapSeconds", "bootstrapSeconds",                                       \
	       AT(bootstrap_seconds)) /* wall clock */                                                                \
	COUNT(rounds, "rounds", "rounds", AT(rounds))                                                                 \
	COUNT(mutations, "mutations", "mutations", NOWHERE)                                                           \
	COUNT(leases_merged, "merged", NULL, NOWHERE)                                                                 \
	COUNT(stuck, "stuck", NULL, NOWHERE)		     /* how often a chain accepted nothing during an epoch */ \
	COUNT(longest_stuck, "longestStuck", NULL, NOWHERE)  /* most rejections in a row */                           \
	NUMBER(real, verify, "verify", "verify", AT(verify)) /* share of its leases computed by two workers */        \
	TEXT(mixture, PLAN_MUTATIONS_MAX, "mixture", "mixture", NOWHERE)                                              \
	TEXT(note, STRATEGY_NOTE, "note", "note", AT(note))                                                           \
	NUMBER(positive, b, "b", "b", NOWHERE) /* of the last image */

#endif
