/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/log.h"

#include "common/base/clock.h"
#include "common/base/log_limit.h"
#include "common/base/text.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

enum { LINE_MAX_BYTES = 2048 };

static const struct {
	const char *name;
	enum log_level level;
} events[] = {
#define LOG_ROW(name, text, level) [LOG_##name] = {text, LOG_LEVEL_##level},
	LOG_EVENTS(LOG_ROW)
#undef LOG_ROW
};

/* Events that anyone who reaches the port can cause. */
static const enum log_event limited[] = {LOG_PEER_ACCEPT, LOG_PEER_HELLO, LOG_PEER_REFUSED,
					 LOG_PEER_CLOSED, LOG_PEER_FAULT, LOG_PEER_GARBLED};
enum { LIMITED = sizeof limited / sizeof *limited };
static struct log_bucket buckets[LIMITED];
static pthread_mutex_t bucket_lock = PTHREAD_MUTEX_INITIALIZER;

static const char *const levels[] = {"debug", "info", "warn", "error"};

static atomic_int least_level = LOG_LEVEL_INFO;

void log_set_level(enum log_level least)
{
	atomic_store(&least_level, (int)least);
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
			 levels[events[event].level], events[event].name, *fields ? " " : "", fields);
	if (n < 0)
		return 0;
	return (size_t)n < size ? (size_t)n : size - 1;
}

static bool may_say(enum log_event event)
{
	bool may = true;
	for (int i = 0; i < LIMITED && atomic_load(&least_level) > LOG_LEVEL_DEBUG; i++) {
		if (limited[i] != event)
			continue;
		pthread_mutex_lock(&bucket_lock);
		may = log_bucket_take(&buckets[i], clock_seconds());
		pthread_mutex_unlock(&bucket_lock);
	}
	return may;
}

void log_tick(void)
{
	for (int i = 0; i < LIMITED; i++) {
		pthread_mutex_lock(&bucket_lock);
		uint64_t n = log_bucket_withheld(&buckets[i], clock_seconds());
		pthread_mutex_unlock(&bucket_lock);
		if (n)
			log_event(LOG_LOG_WITHHELD, "of=%s more=%llu", events[limited[i]].name, (unsigned long long)n);
	}
}

void log_event(enum log_event event, const char *fields, ...)
{
	if ((int)events[event].level < atomic_load(&least_level) || !may_say(event))
		return;
	char text[LINE_MAX_BYTES], line[LINE_MAX_BYTES];
	va_list ap;
	va_start(ap, fields);
	vsnprintf(text, sizeof text, fields, ap);
	va_end(ap);
	text_clean(text);
	size_t n = log_format(line, sizeof line - 1, event, text);
	line[n++] = '\n';
	/* Errors are ignored: a log that cannot be written must not stop the farm. */
	if (write(STDERR_FILENO, line, n) < 0)
		return;
}
