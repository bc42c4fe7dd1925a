/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Log lines of the daemons: one logfmt line per event on stderr, "time=... level=... event=... key=value ...". All
 * events are in the table below, so every line can be found by the event's name. Any thread (one write per line). If
 * stderr cannot take a line, the line is dropped, and the number of dropped lines is logged later. Libraries do not
 * log.
 */
#ifndef COMMON_BASE_LOG_H
#define COMMON_BASE_LOG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LOG_EVENTS(X)                                      \
	X(START, "start", INFO)                            \
	X(LISTEN, "listen", INFO)                          \
	X(LIMITS, "limits", INFO)                          \
	X(STATUS_SOCKET, "status_socket", WARN)            \
	X(STOP, "stop", INFO)                              \
	X(LOG_WITHHELD, "log_withheld", WARN)              \
	X(LOG_DROPPED, "log_dropped", WARN)                \
	X(ROOT, "runs_as_root", WARN)                      \
	X(PEER_ACCEPT, "peer_accept", DEBUG)               \
	X(PEER_HELLO, "peer_hello", INFO)                  \
	X(PEER_REFUSED, "peer_refused", WARN)              \
	X(PEER_CLOSED, "peer_closed", INFO)                \
	X(PEER_GARBLED, "peer_garbled", WARN)              \
	X(PEER_FAULT, "peer_fault", WARN)                  \
	X(TLS_READ, "tls_read", INFO)                      \
	X(TLS_FAULT, "tls_fault", ERROR)                   \
	X(TLS_EXPIRY, "tls_expiry", WARN)                  \
	X(CONNECT, "connect", INFO)                        \
	X(CONNECT_FAILED, "connect_failed", WARN)          \
	X(JOB_SUBMIT, "job_submit", INFO)                  \
	X(JOB_STATE, "job_state", INFO)                    \
	X(JOB_HELD, "job_held", WARN)                      \
	X(JOB_NOTE, "job_note", INFO)                      \
	X(JOB_DONE, "job_done", INFO)                      \
	X(JOB_FAILED, "job_failed", ERROR)                 \
	X(LEASE_GRANTED, "lease_granted", DEBUG)           \
	X(LEASE_TAKEN_BACK, "lease_taken_back", DEBUG)     \
	X(LEASE_FAILED, "lease_failed", WARN)              \
	X(BATCH_MERGED, "batch_merged", DEBUG)             \
	X(BATCH_STORED, "batch_stored", DEBUG)             \
	X(BATCH_ACKNOWLEDGED, "batch_acknowledged", DEBUG) \
	X(BATCH_RESTORED, "batch_restored", DEBUG)         \
	X(BATCH_TAKEN_BACK, "batch_taken_back", WARN)      \
	X(BATCH_REPEATED, "batch_repeated", INFO)          \
	X(BATCH_NOTED, "batch_noted", DEBUG)               \
	X(WORKER_WRONG, "worker_wrong", WARN)              \
	X(WORKER_QUARANTINED, "worker_quarantined", ERROR) \
	X(WORKER_FORGIVEN, "worker_forgiven", INFO)        \
	X(NOT_FORGIVEN, "worker_not_forgiven", WARN)       \
	X(BATCH_REFUSED, "batch_refused", WARN)            \
	X(BLOB_STORED, "blob_stored", DEBUG)               \
	X(WORLD_BUILT, "world_built", INFO)                \
	X(WORLD_FAILED, "world_failed", ERROR)             \
	X(PROCESS_LOST, "process_lost", ERROR)             \
	X(CHECKPOINT, "checkpoint", INFO)                  \
	X(JOB_CLEARED, "job_cleared", INFO)                \
	X(SPOOL_READ, "spool_read", INFO)                  \
	X(SPOOL_FAULT, "spool_fault", ERROR)

enum log_event {
#define LOG_ENUM(name, text, level) LOG_##name,
	LOG_EVENTS(LOG_ENUM)
#undef LOG_ENUM
};

enum log_level { LOG_LEVEL_DEBUG, LOG_LEVEL_INFO, LOG_LEVEL_WARN, LOG_LEVEL_ERROR };

/* Suppresses events below this level. The default is INFO. */
void log_set_level(enum log_level level);

/* Writes one line. `fields` is a format such as "job=j%llu name=%s"; text from outside must go through log_quote. A
 * line has at most 2,047 bytes. Returns false if the rate limit of its kind suppressed it (see log_report_withheld). */
__attribute__((format(printf, 2, 3))) bool log_event(enum log_event event, const char *fields, ...);

enum { LOG_VALUE_MAX = 512 };
struct log_value {
	char text[LOG_VALUE_MAX];
};
/* Returns the text in double quotes, escaped, without control characters, cut to fit. */
struct log_value log_quote(const char *text);
/* Converts for %llu, whatever type uint64_t is. */
static inline unsigned long long log_u64_arg(uint64_t n)
{
	return n;
}

/* Events that a peer can cause are rate-limited, each kind on its own: a burst of 100 lines, then 5 a second; the rest
 * are only counted (log_limit.h). With LOG_LEVEL_DEBUG all are written. Call log_report_withheld regularly: it logs how
 * many lines of each kind were suppressed. */
void log_report_withheld(void);

/* Formats the line that log_event would write, without the newline, for the logs of jobs. Returns its length. */
size_t log_format(char *line, size_t size, enum log_event event, const char *fields);

#endif
