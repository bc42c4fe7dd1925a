/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Transcripts (transcript.h): a line's words become an event, the core handles it, and its actions become text that is
 * compared with the part after the arrow. A line that cannot be parsed ends the test with its text; one that differs is
 * printed as it is and as it should be.
 */
#include "tests/support/transcript.h"

#include <inttypes.h>
#include <math.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct answer_text {
	char text[4096];
	size_t used;
};

__attribute__((format(printf, 2, 3))) static void append_words(struct answer_text *s, const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(s->text + s->used, sizeof s->text - s->used, format, ap);
	va_end(ap);
	assert_true(n >= 0 && s->used + (size_t)n < sizeof s->text);
	s->used += (size_t)n;
}

static void append_key(struct answer_text *s, const struct lease_key *k)
{
	append_words(s, "j%" PRIu64 " g%u p%u ", k->job, k->group, k->part);
	if (k->kind == LEASE_BOOTSTRAP)
		append_words(s, "boot");
	else
		append_words(s, "e%" PRIu64, k->epoch);
}

static void append_ack(struct answer_text *s, const struct action *a)
{
	static const char *const names[] = {"merged", "repeat", "refused", "noted"};
	append_words(s, "%s%s%s", names[a->ack], *a->text ? ": " : "", a->text);
}

static void append_job_state(struct answer_text *s, const struct action *a)
{
	append_words(s, "j%" PRIu64 " is %s", a->job, job_state_name(a->state));
	if (a->end != END_NONE)
		append_words(s, " (%s%s%s)", job_end_name(a->end), *a->text ? ": " : "", a->text);
}

static void append_action(struct answer_text *s, const struct action *a)
{
	switch (a->kind) {
	case ACTION_SUBMITTED:
		append_words(s, "j%" PRIu64 " submitted", a->job);
		break;
	case ACTION_CANCELLED:
		append_words(s, "j%" PRIu64 " cancelled", a->job);
		break;
	case ACTION_REJECTED:
		append_words(s, "rejected: %s", a->text);
		break;
	case ACTION_SEND_LEASE:
	case ACTION_REVOKE_LEASE:
		append_words(s, "w%" PRIu64 " %s ", a->peer, a->kind == ACTION_REVOKE_LEASE ? "loses" : "gets");
		append_key(s, &a->key);
		if (a->starts_from_seeds)
			append_words(s, " anew");
		break;
	case ACTION_MERGE_BATCH:
		append_words(s, "merge");
		break;
	case ACTION_ACKNOWLEDGE:
		append_ack(s, a);
		break;
	case ACTION_BOOTSTRAP_DONE:
		append_words(s, "j%" PRIu64 " prepare", a->job);
		break;
	case ACTION_ROUND_DONE:
		append_words(s, "j%" PRIu64 " round %" PRIu64, a->job, a->rounds);
		break;
	case ACTION_ESTIMATE_ERROR:
		append_words(s, "j%" PRIu64 " evaluate %" PRIu64, a->job, a->rounds);
		break;
	case ACTION_PUBLISH:
		append_words(s, "j%" PRIu64 " publish %" PRIu64, a->job, a->rounds);
		break;
	case ACTION_JOB_CHANGED:
		append_job_state(s, a);
		break;
	case ACTION_JOB_FORGOTTEN:
		append_words(s, "j%" PRIu64 " forgotten", a->job);
		break;
	case ACTION_RESTART_CHAINS:
		append_words(s, "anew");
		break;
	case ACTION_ROLL_BACK_EPOCH:
		append_words(s, "back ");
		append_key(s, &a->key);
		break;
	case ACTION_WRONG_RESULT:
		append_words(s, "#%" PRIu64 " %s", a->worker_id, a->text);
		break;
	case ACTION_QUARANTINE:
		append_words(s, "#%" PRIu64 " quarantined", a->worker_id);
		break;
	case ACTION_CLOSE_PEER:
		append_words(s, "close w%" PRIu64, a->peer);
		break;
	}
}

/* ---- reading */

static bool skip_word(const char **cursor, const char *word)
{
	size_t n = strlen(word);
	if (strncmp(*cursor, word, n) != 0)
		return false;
	*cursor += n;
	while (**cursor == ' ')
		++*cursor;
	return true;
}

static double parse_number(const char **cursor)
{
	char *end;
	double x = strtod(*cursor, &end);
	if (end == *cursor)
		fail_msg("a number is missing: %s", *cursor);
	*cursor = end;
	while (**cursor == ' ')
		++*cursor;
	return x;
}

static uint64_t parse_count(const char **cursor)
{
	return (uint64_t)parse_number(cursor);
}

static uint64_t parse_id(const char **cursor, const char *letter)
{
	if (!skip_word(cursor, letter))
		fail_msg("'%s' is missing: %s", letter, *cursor);
	return parse_count(cursor);
}

static struct lease_key parse_key(const char **cursor)
{
	struct lease_key k = {.job = parse_id(cursor, "j"), .kind = LEASE_RENDER};
	k.group = (uint32_t)parse_id(cursor, "g");
	k.part = (uint32_t)parse_id(cursor, "p");
	if (skip_word(cursor, "boot"))
		k.kind = LEASE_BOOTSTRAP;
	else
		k.epoch = parse_id(cursor, "e");
	return k;
}

enum { WORD_BYTES = 32 };

static const char *parse_word(const char **cursor, char word[WORD_BYTES])
{
	size_t n = strcspn(*cursor, " ");
	snprintf(word, WORD_BYTES, "%.*s", (int)n, *cursor);
	*cursor += n;
	skip_word(cursor, " ");
	return word;
}

static void parse_submit(const char **cursor, struct event *ev, struct plan *p, char owner[WORD_BYTES])
{
	*p = (struct plan){.kind = PLAN_CHAINS,
			   .width = 8,
			   .height = 8,
			   .crop_width = 8,
			   .crop_height = 8,
			   .groups = 2,
			   .parts = 1,
			   .rounds = 2,
			   .epoch = 100,
			   .bootstrap = 1000};
	ev->kind = EVENT_SUBMIT;
	ev->tag = 7;
	ev->submit = (struct event_submit){.plan = p, .name = "job", .owner = ""};
	while (**cursor && **cursor != '-') {
		if (skip_word(cursor, "priority="))
			ev->submit.priority = (int)parse_number(cursor);
		else if (skip_word(cursor, "mixed"))
			ev->submit.is_mixed = true;
		else if (skip_word(cursor, "samples"))
			p->kind = PLAN_SAMPLES;
		else if (skip_word(cursor, "owner="))
			ev->submit.owner = parse_word(cursor, owner);
		else if (skip_word(cursor, "verify="))
			ev->submit.verify_fraction = parse_number(cursor);
		else if (skip_word(cursor, "groups="))
			p->groups = (uint32_t)parse_count(cursor);
		else if (skip_word(cursor, "parts="))
			p->parts = (uint32_t)parse_count(cursor);
		else if (skip_word(cursor, "rounds=inf"))
			p->rounds = UINT64_MAX;
		else if (skip_word(cursor, "rounds="))
			p->rounds = parse_count(cursor);
		else if (skip_word(cursor, "seconds="))
			p->seconds = parse_number(cursor);
		else if (skip_word(cursor, "target="))
			p->target_error = parse_number(cursor);
		else if (skip_word(cursor, "epoch="))
			p->epoch = parse_count(cursor);
		else if (skip_word(cursor, "boot="))
			p->bootstrap = parse_count(cursor);
		else
			fail_msg("not an option of submit: %s", *cursor);
	}
	p->chains = p->kind == PLAN_CHAINS ? p->groups * p->parts * 4 : 0;
}

/* Parses [certificate=C] [name=N] [home=H] [start=K], each one letter. */
static void parse_identity(const char **cursor, struct event_join *j)
{
	static const char *const letters[] = {"a", "b", "c", "d"};
	const char **targets[] = {&j->certificate, &j->name, &j->home};
	static const char *const words[] = {"certificate=", "name=", "home="};
	for (int i = 0; i < 3; i++)
		for (int k = 0; skip_word(cursor, words[i]); k = 0) {
			while (k < 3 && **cursor != *letters[k])
				k++;
			*targets[i] = letters[k];
			skip_word(cursor, letters[k]);
		}
	if (skip_word(cursor, "start="))
		j->restarts = parse_count(cursor);
}

static void parse_worker(const char **cursor, struct event *ev, char *name, char *fingerprint)
{
	ev->peer = parse_id(cursor, "w");
	if (skip_word(cursor, "joins")) {
		ev->kind = EVENT_JOINED;
		int n = 0;
		if (sscanf(*cursor, "%31s threads=%u%n", fingerprint, &ev->join.threads, &n) != 2)
			fail_msg("F threads=T is missing: %s", *cursor);
		*cursor += n;
		skip_word(cursor, " ");
		snprintf(name, 32, "w%" PRIu64, ev->peer);
		ev->join.peer = ev->peer;
		ev->join.name = name;
		ev->join.fingerprint = fingerprint;
		parse_identity(cursor, &ev->join);
		ev->peer = 0;
	} else if (skip_word(cursor, "leaves")) {
		ev->kind = EVENT_LEFT;
	} else if (skip_word(cursor, "heartbeat")) {
		ev->kind = EVENT_HEARTBEAT;
	} else if (skip_word(cursor, "wants")) {
		ev->kind = EVENT_LEASE_REQUEST;
		ev->wanted_leases = (uint32_t)parse_count(cursor);
	} else {
		bool lacks = skip_word(cursor, "lacks"), lost = !lacks && skip_word(cursor, "denies"),
		     late = !lacks && !lost && skip_word(cursor, "recalls"),
		     later = !lacks && !lost && !late && skip_word(cursor, "postpones");
		bool refuses = lost || late || (!lacks && !later && skip_word(cursor, "refuses"));
		ev->kind = lacks || refuses || later	   ? EVENT_LEASE_FAILED
			   : skip_word(cursor, "batch")	   ? EVENT_BATCH
			   : skip_word(cursor, "stored")   ? EVENT_STORED_BATCH
			   : skip_word(cursor, "delivers") ? EVENT_BATCH_DELIVERED
			   : skip_word(cursor, "fails")	   ? EVENT_LEASE_FAILED
							   : EVENT_LEASE_RETURNED;
		if (ev->kind == EVENT_LEASE_RETURNED && !skip_word(cursor, "returns"))
			fail_msg("no such event: %s", *cursor);
		ev->lease.key = parse_key(cursor);
		ev->lease.is_worker_at_fault = lacks || later;
		ev->lease.is_memory_full = later;
		ev->lease.has_bad_states = refuses;
		ev->lease.can_roll_back = refuses && !lost;
		ev->lease.has_outdated_states = late;
		ev->lease.is_valid = !skip_word(cursor, "bad");
		if (skip_word(cursor, "says "))
			memset(&ev->lease.digest, *(*cursor)++, sizeof ev->lease.digest);
		skip_word(cursor, " ");
	}
}

/* Parses restore [asked] J boot|render N,N,... [fingerprint=F] [elapsed=T] [completed=T] [black] [options of submit].
 */
static void parse_restore(const char **cursor, struct event *ev, struct plan *p, char *fingerprint, uint64_t *next,
			  const struct forecast_history *history, char owner[WORD_BYTES])
{
	bool is_requested = skip_word(cursor, "asked");
	struct event_restore r = {.job = parse_id(cursor, "j"),
				  .next_epochs = next,
				  .fingerprint = fingerprint,
				  .elapsed = NAN,
				  .first_round_at = NAN,
				  .last_round_end = NAN,
				  .looks = history};
	r.kind = skip_word(cursor, "boot") ? LEASE_BOOTSTRAP : LEASE_RENDER;
	if (r.kind == LEASE_RENDER && !skip_word(cursor, "render"))
		fail_msg("boot or render is missing: %s", *cursor);
	fingerprint[0] = 0;
	do
		*next++ = parse_count(cursor);
	while (skip_word(cursor, ","));
	if (skip_word(cursor, "fingerprint=")) {
		int n = 0;
		sscanf(*cursor, "%31s%n", fingerprint, &n);
		*cursor += n;
		skip_word(cursor, " ");
	}
	if (skip_word(cursor, "elapsed="))
		r.elapsed = r.first_round_at = parse_number(cursor);
	if (skip_word(cursor, "completed="))
		r.last_round_end = parse_number(cursor);
	r.is_black = skip_word(cursor, "black");
	parse_submit(cursor, ev, p, owner);
	r.submit = ev->submit;
	ev->kind = EVENT_RESTORE;
	if (!is_requested)
		ev->tag = 0;
	ev->restore = r;
}

static void parse_extend(const char **cursor, struct event *ev, struct plan *p, char owner[WORD_BYTES])
{
	ev->job = parse_id(cursor, "j");
	parse_submit(cursor, ev, p, owner);
	ev->kind = EVENT_EXTEND;
	ev->plan = p;
}

static void parse_job(const char **cursor, struct event *ev)
{
	if (skip_word(cursor, "cancel")) {
		ev->kind = EVENT_CANCEL;
		ev->job = parse_id(cursor, "j");
	} else if (skip_word(cursor, "prepared")) {
		ev->kind = EVENT_PREPARED;
		ev->prepared.job = parse_id(cursor, "j");
		ev->prepared.black = skip_word(cursor, "black");
		ev->prepared.ok = !skip_word(cursor, "bad");
	} else if (skip_word(cursor, "error")) {
		ev->kind = EVENT_ERROR_ESTIMATED;
		ev->error_estimated.job = parse_id(cursor, "j");
		ev->error_estimated.rounds = parse_count(cursor);
		ev->error_estimated.black = skip_word(cursor, "black");
		ev->error_estimated.rel_error = ev->error_estimated.black ? NAN : parse_number(cursor);
	} else if (skip_word(cursor, "image")) {
		ev->kind = EVENT_IMAGE_PUBLISHED;
		ev->image_published.job = parse_id(cursor, "j");
		ev->image_published.chains_disagree = skip_word(cursor, "disagrees");
	} else if (skip_word(cursor, "hold") || skip_word(cursor, "release")) {
		ev->kind = EVENT_HOLD;
		ev->tag = 7;
		ev->hold = skip_word(cursor, "order")	? HOLD_USER
			   : skip_word(cursor, "files") ? HOLD_FILES
							: HOLD_STORAGE;
		ev->job = parse_id(cursor, "j");
	} else if (skip_word(cursor, "priority")) {
		ev->kind = EVENT_SET_PRIORITY;
		ev->tag = 7;
		ev->job = parse_id(cursor, "j");
		ev->priority = (int)parse_number(cursor);
	} else if (skip_word(cursor, "quarantined")) { /* the letter of NAME, as for `joins` */
		ev->kind = EVENT_QUARANTINED;
		parse_identity(cursor, &ev->join);
	} else if (skip_word(cursor, "broken")) {
		ev->kind = EVENT_JOB_FAILED;
		ev->job = parse_id(cursor, "j");
	} else if (!skip_word(cursor, "tick")) {
		fail_msg("no such event: %s", *cursor);
	}
}

static double last_wake_time;

static bool play_wake(const char *line, const char *expected)
{
	char text[32];
	snprintf(text, sizeof text, "%g", last_wake_time);
	if (strcmp(text, expected) == 0)
		return true;
	print_error("%s\n        but it is %s\n", line, text);
	return false;
}

static bool play_line(struct farm *f, const char *line)
{
	const char *cursor = line, *arrow = strstr(line, "-> ");
	char name[32], fingerprint[32], owner[WORD_BYTES], text[256];
	struct plan plan;
	uint64_t next[64];
	struct forecast_history history = {.count = 0};
	struct event ev = {.kind = EVENT_TICK};
	if (!arrow || !skip_word(&cursor, "["))
		fail_msg("not a line of a transcript: %s", line);
	ev.time = parse_number(&cursor);
	skip_word(&cursor, "]");
	if (skip_word(&cursor, "unread="))
		ev.unread_seconds = parse_number(&cursor);
	if (skip_word(&cursor, "wake"))
		return play_wake(line, arrow + 3);
	if (*cursor == 'w')
		parse_worker(&cursor, &ev, name, fingerprint);
	else if (skip_word(&cursor, "submit"))
		parse_submit(&cursor, &ev, &plan, owner);
	else if (skip_word(&cursor, "extend"))
		parse_extend(&cursor, &ev, &plan, owner);
	else if (skip_word(&cursor, "restore"))
		parse_restore(&cursor, &ev, &plan, fingerprint, next, &history, owner);
	else
		parse_job(&cursor, &ev);
	snprintf(text, sizeof text, "%.*s", cursor < arrow ? (int)(arrow - cursor) - 1 : 0, cursor);
	ev.text = text;

	struct update u;
	farm_step(f, &ev, &u);
	last_wake_time = u.wake_time;
	struct answer_text s = {.used = 0};
	for (size_t i = 0; i < u.count; i++) {
		append_words(&s, "%s", i ? ", " : "");
		append_action(&s, &u.actions[i]);
	}
	if (u.count == 0)
		append_words(&s, "-");
	if (strcmp(s.text, arrow + 3) == 0)
		return true;
	print_error("\"%.*s%s\",\n", (int)(arrow + 3 - line), line, s.text);
	print_error("        but expected: %s\n", arrow + 3);
	return false;
}

struct farm *transcript_farm_new(void)
{
	struct farm_config c;
	struct farm *f = NULL;
	struct error e;
	farm_config_init(&c);
	assert_int_equal(farm_new(&f, &c, &e), 0);
	return f;
}

/* Returns whether a job that is active but has no leases, or is held, states what it waits for, to its owner as
 * well. */
static bool is_waiting_explained(const struct farm *f, const char *line)
{
	enum { JOBS = 64 };
	bool is_explained = true;
	for (uint64_t id = 1; id <= JOBS; id++) {
		struct job_status s;
		if (!farm_job_status(f, id, 0, &s) || job_state_is_end(s.state) || (s.leases && s.state != JOB_HELD) ||
		    (*s.waiting && *s.owners_waiting))
			continue;
		print_error("\"%s\": j%llu waits and does not say for what\n", line, (unsigned long long)id);
		is_explained = false;
	}
	return is_explained;
}

void transcript_play(struct farm *f, const char *const *lines)
{
	int failures = 0;
	for (; *lines; lines++)
		failures += !play_line(f, *lines) + !is_waiting_explained(f, *lines);
	assert_int_equal(failures, 0);
}

void transcript_check(const char *const *lines)
{
	struct farm *f = transcript_farm_new();
	transcript_play(f, lines);
	farm_free(f);
}
