/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Each line is formatted in memory and written by a single call. The reader of stderr may stop reading: a terminal
 * after Ctrl-S or behind a hanging connection, or a pipe to a stopped program. A daemon must not hang with it: a line
 * waits for at most 100 ms, and once a wait has been in vain, lines are dropped and counted until stderr accepts one
 * again. The number of dropped lines is logged then. Errors of write are ignored.
 */
#include "common/base/log.h"

#include "common/base/clock.h"
#include "common/base/log_limit.h"
#include "common/base/text.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
	LINE_BYTES_MAX = 2048,
	WRITE_TIMEOUT_MS = 100, /* the longest wait for a slow reader of stderr */
};

static const struct {
	const char *name;
	enum log_level level;
} events[] = {
#define LOG_ROW(name, text, level) [LOG_##name] = {text, LOG_LEVEL_##level},
	LOG_EVENTS(LOG_ROW)
#undef LOG_ROW
};

/* Rate-limited events: anyone who can connect to the port, or a worker by its messages, can cause them. */
static const enum log_event limited_events[] = {LOG_PEER_ACCEPT,  LOG_PEER_HELLO,     LOG_PEER_REFUSED,
						LOG_PEER_CLOSED,  LOG_PEER_FAULT,     LOG_PEER_GARBLED,
						LOG_LEASE_FAILED, LOG_BATCH_REPEATED, LOG_BATCH_REFUSED};
enum { LIMITED_COUNT = sizeof limited_events / sizeof *limited_events };
static struct log_bucket buckets[LIMITED_COUNT];
static pthread_mutex_t bucket_lock = PTHREAD_MUTEX_INITIALIZER;

static const char *const level_names[] = {"debug", "info", "warn", "error"};

static atomic_int min_level = LOG_LEVEL_INFO;

void log_set_level(enum log_level level)
{
	atomic_store(&min_level, (int)level);
}

struct log_value log_quote(const char *text)
{
	struct log_value v;
	size_t n = 0;
	v.text[n++] = '"';
	for (; *text && n + 3 < sizeof v.text; text++) {
		if (*text == '"' || *text == '\\')
			v.text[n++] = '\\';
		v.text[n++] = *text;
	}
	v.text[n++] = '"';
	v.text[n] = 0;
	text_clean(v.text);
	return v;
}

size_t log_format(char *line, size_t size, enum log_event event, const char *fields)
{
	struct timespec now;
	struct tm utc;
	char stamp[32];
	clock_gettime(CLOCK_REALTIME, &now);
	gmtime_r(&now.tv_sec, &utc);
	strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
	int n = snprintf(line, size, "time=%s.%03ldZ level=%s event=%s%s%s", stamp, now.tv_nsec / 1000000,
			 level_names[events[event].level], events[event].name, *fields ? " " : "", fields);
	if (n < 0)
		return 0;
	return (size_t)n < size ? (size_t)n : size - 1;
}

static bool is_enabled(enum log_event event)
{
	return (int)events[event].level >= atomic_load(&min_level);
}

static bool take_log_token(enum log_event event)
{
	bool allowed = true;
	for (int i = 0; i < LIMITED_COUNT && atomic_load(&min_level) > LOG_LEVEL_DEBUG; i++) {
		if (limited_events[i] != event)
			continue;
		pthread_mutex_lock(&bucket_lock);
		allowed = log_bucket_take(&buckets[i], clock_seconds());
		pthread_mutex_unlock(&bucket_lock);
	}
	return allowed;
}

/* ---- writing ---- */

static pthread_mutex_t output_lock = PTHREAD_MUTEX_INITIALIZER;
static int output_fd = -1;
static bool is_stuck;	       /* the last line was dropped */
static uint64_t dropped_count; /* lines dropped since the last line that was written */

/* Pipes and terminals are opened a second time, because O_NONBLOCK on the inherited descriptor would also apply to the
 * other programs that share it. A file that cannot be reopened (a socket) is used as it is; write then blocks only if
 * poll was wrong. */
static int open_output(void)
{
	struct stat st;
	int fd = -1;
	if (fstat(STDERR_FILENO, &st) == 0 && (S_ISFIFO(st.st_mode) || S_ISCHR(st.st_mode)))
		fd = open("/proc/self/fd/2", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
	return fd >= 0 ? fd : STDERR_FILENO;
}

/* Writes one line. Returns false if it was dropped; otherwise *dropped_before is the number of lines dropped just
 * before. */
static bool write_or_drop(const char *line, size_t size, uint64_t *dropped_before)
{
	pthread_mutex_lock(&output_lock);
	if (output_fd < 0)
		output_fd = open_output();
	struct pollfd p = {.fd = output_fd, .events = POLLOUT};
	is_stuck = poll(&p, 1, is_stuck ? 0 : WRITE_TIMEOUT_MS) == 0 ||
		   (write(output_fd, line, size) < 0 && errno == EAGAIN);
	*dropped_before = is_stuck ? 0 : dropped_count;
	dropped_count = is_stuck ? dropped_count + 1 : 0;
	bool written = !is_stuck;
	pthread_mutex_unlock(&output_lock);
	return written;
}

static void restore_dropped(uint64_t lines)
{
	pthread_mutex_lock(&output_lock);
	dropped_count += lines;
	pthread_mutex_unlock(&output_lock);
}

static size_t format_dropped(char *line, size_t size, uint64_t lines)
{
	char text[32];
	snprintf(text, sizeof text, "more=%llu", log_u64_arg(lines));
	size_t n = log_format(line, size - 1, LOG_LOG_DROPPED, text);
	line[n++] = '\n';
	return n;
}

static void write_line(const char *line, size_t size)
{
	char report[160];
	uint64_t dropped_before, ignored;
	if (!write_or_drop(line, size, &dropped_before) || !dropped_before)
		return;
	size_t n = format_dropped(report, sizeof report, dropped_before);
	if (!write_or_drop(report, n, &ignored))
		restore_dropped(dropped_before - 1); /* write_or_drop has counted the report itself as a dropped line */
}

void log_report_withheld(void)
{
	for (int i = 0; i < LIMITED_COUNT; i++) {
		pthread_mutex_lock(&bucket_lock);
		uint64_t n = log_bucket_take_withheld(&buckets[i], clock_seconds());
		pthread_mutex_unlock(&bucket_lock);
		if (n && is_enabled(limited_events[i]))
			log_event(LOG_LOG_WITHHELD, "of=%s more=%llu", events[limited_events[i]].name,
				  (unsigned long long)n);
	}
}

bool log_event(enum log_event event, const char *fields, ...)
{
	if (!take_log_token(event))
		return false;
	if (!is_enabled(event))
		return true;
	char text[LINE_BYTES_MAX], line[LINE_BYTES_MAX];
	va_list ap;
	va_start(ap, fields);
	vsnprintf(text, sizeof text, fields, ap);
	va_end(ap);
	text_clean(text);
	size_t n = log_format(line, sizeof line - 1, event, text);
	line[n++] = '\n';
	write_line(line, n);
	return true;
}
