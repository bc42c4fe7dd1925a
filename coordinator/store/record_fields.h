/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The plain fields of a job's record. From this list follow struct job_record, the record in the spool, the JSON of the
 * status, and the message JobStatus; what has parts, or is made of several values, is done by hand (record.c,
 * job/view.c).
 *
 *   TEXT(member, bytes, key, shown, wire, core)
 *   NUMBER(kind, member, key, shown, wire, core)     kind: of fields.h
 *   COUNT(member, key, shown, wire, core)            uint64_t; its key is in the object "counts" of both JSONs
 *
 * key: its name in the record; shown: in the status; NULL: it is not there. wire: AT(member of JobStatus), or NOWHERE.
 * core: LIVE: while the job lives, the member of the same name of struct job_status takes its place; KEPT: none does.
 */
#ifndef COORDINATOR_STORE_RECORD_FIELDS_H
#define COORDINATOR_STORE_RECORD_FIELDS_H

#define RECORD_FIELDS(TEXT, NUMBER, COUNT)                                                                           \
	NUMBER(u64, id, "id", NULL, AT(job), KEPT)                                                                   \
	TEXT(name, 128, "name", "name", AT(name), KEPT)                                                              \
	TEXT(integrator, 16, "integrator", "integrator", NOWHERE, KEPT)                                              \
	TEXT(state, 16, "state", "state", AT(state), KEPT)                                                           \
	TEXT(reason, 16, "reason", "reason", AT(reason), KEPT)	 /* the bound that ended it */                       \
	TEXT(why, 256, "why", NULL, NOWHERE, KEPT)		 /* why it failed */                                 \
	TEXT(output, 1024, "output", "output", AT(output), KEPT) /* where the client wants its image */              \
	TEXT(owner, 72, "owner", "owner", AT(owner), KEPT)	 /* name in the owner's certificate; "": none */     \
	NUMBER(int, priority, "priority", "priority", AT(priority), LIVE)                                            \
	NUMBER(u32, exit_code, "exitCode", NULL, AT(exit_code), KEPT) /* of a program that waits for it */           \
	NUMBER(bool, has_result, "result", "result", AT(fetchable), KEPT)                                            \
	NUMBER(positive, cleared, "cleared", "cleared", NOWHERE, KEPT) /* when its result was; s since 1970 */       \
	NUMBER(u64, extended, "extended", NULL, NOWHERE, KEPT)	       /* number of extensions, as in the ledger */  \
	NUMBER(bool, cut, "cut", NULL, NOWHERE, KEPT)		       /* an extension was cancelled since */        \
	NUMBER(real, submitted, "submitted", "submitted", AT(submitted), KEPT) /* s since 1970 */                    \
	NUMBER(real, ended, "ended", "ended", NOWHERE, KEPT)		       /* s since 1970; 0: not yet */        \
	NUMBER(known, ended_seen, "endedSeen", NULL, NOWHERE,                                                        \
	       KEPT) /* observed time in s at that moment (age_clock.h) */                                           \
	NUMBER(real, progress, "progress", "progress", AT(progress), LIVE)                                           \
	NUMBER(known, rel_error, "relError", "error", AT(error), KEPT)                                               \
	NUMBER(known, rel_error_about, "relErrorAbout", "errorAbout", AT(error_about), KEPT)   /* the estimate */    \
	TEXT(rel_error_doubt, STATED_ERROR_TEXT, "relErrorDoubt", "errorDoubt", NOWHERE, KEPT) /* why not */         \
	NUMBER(positive, target_error, "targetError", "targetError", AT(target_error), KEPT)                         \
	NUMBER(real, cpu_seconds, "cpuSeconds", "cpuSeconds", AT(cpu_seconds), KEPT) /* of all leases */             \
	NUMBER(real, bootstrap_cpu_seconds, "bootstrapCpuSeconds", "bootstrapCpuSeconds", AT(bootstrap_cpu_seconds), \
	       KEPT)                                                                                                 \
	NUMBER(real, bootstrap_seconds, "bootstrapSeconds", "bootstrapSeconds", AT(bootstrap_seconds),               \
	       LIVE) /* wall clock */                                                                                \
	COUNT(rounds, "rounds", "rounds", AT(rounds), LIVE)                                                          \
	COUNT(mutations, "mutations", "mutations", NOWHERE, LIVE)                                                    \
	COUNT(leases_merged, "merged", NULL, NOWHERE, LIVE)                                                          \
	COUNT(stuck, "stuck", NULL, NOWHERE, KEPT) /* how often a chain accepted nothing during an epoch */          \
	COUNT(longest_stuck, "longestStuck", NULL, NOWHERE, KEPT)  /* most rejections in a row */                    \
	NUMBER(real, verify, "verify", "verify", AT(verify), LIVE) /* share of its leases computed by two workers */ \
	TEXT(mixture, PLAN_MUTATIONS_MAX, "mixture", "mixture", NOWHERE, KEPT)                                       \
	TEXT(note, STRATEGY_NOTE, "note", "note", AT(note), KEPT)                                                    \
	TEXT(scene_notes, HEADER_SCENE_NOTES, "sceneNotes", NULL, NOWHERE, KEPT) /* text_lines of them */            \
	NUMBER(positive, b, "b", "b", NOWHERE, KEPT)				 /* of the last image */

#endif
