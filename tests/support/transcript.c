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

struct said {
	char text[4096];
	size_t used;
};

__attribute__((format(printf, 2, 3))) static void say(struct said *s, const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(s->text + s->used, sizeof s->text - s->used, format, ap);
	va_end(ap);
	assert_true(n >= 0 && s->used + (size_t)n < sizeof s->text);
	s->used += (size_t)n;
}

static void say_key(struct said *s, const struct lease_key *k)
{
	say(s, "j%" PRIu64 " g%u p%u ", k->job, k->group, k->part);
	if (k->kind == LEASE_BOOTSTRAP)
		say(s, "boot");
	else
		say(s, "e%" PRIu64, k->epoch);
}

static void say_ack(struct said *s, const struct action *a)
{
	static const char *const names[] = {"merged", "repeat", "refused", "noted"};
	say(s, "%s%s%s", names[a->ack], *a->text ? ": " : "", a->text);
}

static void say_changed(struct said *s, const struct action *a)
{
	say(s, "j%" PRIu64 " is %s", a->job, job_state_name(a->state));
	if (a->end != END_NONE)
		say(s, " (%s%s%s)", job_end_name(a->end), *a->text ? ": " : "", a->text);
}

static void say_action(struct said *s, const struct action *a)
{
	switch (a->kind) {
	case ACTION_SUBMITTED:
		say(s, "j%" PRIu64 " submitted", a->job);
		break;
	case ACTION_CANCELLED:
		say(s, "j%" PRIu64 " cancelled", a->job);
		break;
	case ACTION_REJECTED:
		say(s, "rejected: %s", a->text);
		break;
	case ACTION_SEND_LEASE:
	case ACTION_REVOKE:
		say(s, "w%" PRIu64 " %s ", a->peer, a->kind == ACTION_REVOKE ? "loses" : "gets");
		say_key(s, &a->key);
		if (a->anew)
			say(s, " anew");
		break;
	case ACTION_MERGE:
		say(s, "merge");
		break;
	case ACTION_ACK:
		say_ack(s, a);
		break;
	case ACTION_BOOTSTRAP_DONE:
		say(s, "j%" PRIu64 " prepare", a->job);
		break;
	case ACTION_ROUND_DONE:
		say(s, "j%" PRIu64 " round %" PRIu64, a->job, a->rounds);
		break;
	case ACTION_EVALUATE_ERROR:
		say(s, "j%" PRIu64 " evaluate %" PRIu64, a->job, a->rounds);
		break;
	case ACTION_PUBLISH:
		say(s, "j%" PRIu64 " publish %" PRIu64, a->job, a->rounds);
		break;
	case ACTION_JOB_CHANGED:
		say_changed(s, a);
		break;
	case ACTION_JOB_FORGOTTEN:
		say(s, "j%" PRIu64 " forgotten", a->job);
		break;
	case ACTION_CHAINS_ANEW:
		say(s, "anew");
		break;
	case ACTION_TAKE_BACK:
		say(s, "back ");
		say_key(s, &a->key);
		break;
	case ACTION_WRONG:
		say(s, "#%" PRIu64 " %s", a->who, a->text);
		break;
	case ACTION_QUARANTINE:
		say(s, "#%" PRIu64 " quarantined", a->who);
		break;
	case ACTION_CLOSE_PEER:
		say(s, "close w%" PRIu64, a->peer);
		break;
	}
}

/* ---- reading */

static bool skip_word(const char **at, const char *word)
{
	size_t n = strlen(word);
	if (strncmp(*at, word, n) != 0)
		return false;
	*at += n;
	while (**at == ' ')
		++*at;
	return true;
}

static double take_number(const char **at)
{
	char *end;
	double x = strtod(*at, &end);
	if (end == *at)
		fail_msg("a number is missing: %s", *at);
	*at = end;
	while (**at == ' ')
		++*at;
	return x;
}

static uint64_t take_count(const char **at)
{
	return (uint64_t)take_number(at);
}

static uint64_t take_id(const char **at, const char *letter)
{
	if (!skip_word(at, letter))
		fail_msg("'%s' is missing: %s", letter, *at);
	return take_count(at);
}

static struct lease_key take_key(const char **at)
{
	struct lease_key k = {.job = take_id(at, "j"), .kind = LEASE_RENDER};
	k.group = (uint32_t)take_id(at, "g");
	k.part = (uint32_t)take_id(at, "p");
	if (skip_word(at, "boot"))
		k.kind = LEASE_BOOTSTRAP;
	else
		k.epoch = take_id(at, "e");
	return k;
}

enum { WORD = 32 };

static const char *take_word(const char **at, char word[WORD])
{
	size_t n = strcspn(*at, " ");
	snprintf(word, WORD, "%.*s", (int)n, *at);
	*at += n;
	skip_word(at, " ");
	return word;
}

static void take_submit(const char **at, struct event *ev, struct plan *p, char owner[WORD])
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
	while (**at && **at != '-') {
		if (skip_word(at, "priority="))
			ev->submit.priority = (int)take_number(at);
		else if (skip_word(at, "mixed"))
			ev->submit.mixed = true;
		else if (skip_word(at, "samples"))
			p->kind = PLAN_SAMPLES;
		else if (skip_word(at, "owner="))
			ev->submit.owner = take_word(at, owner);
		else if (skip_word(at, "verify="))
			ev->submit.verify = take_number(at);
		else if (skip_word(at, "groups="))
			p->groups = (uint32_t)take_count(at);
		else if (skip_word(at, "parts="))
			p->parts = (uint32_t)take_count(at);
		else if (skip_word(at, "rounds=inf"))
			p->rounds = UINT64_MAX;
		else if (skip_word(at, "rounds="))
			p->rounds = take_count(at);
		else if (skip_word(at, "seconds="))
			p->seconds = take_number(at);
		else if (skip_word(at, "target="))
			p->target_error = take_number(at);
		else if (skip_word(at, "epoch="))
			p->epoch = take_count(at);
		else if (skip_word(at, "boot="))
			p->bootstrap = take_count(at);
		else
			fail_msg("not an option of submit: %s", *at);
	}
	p->chains = p->kind == PLAN_CHAINS ? p->groups * p->parts * 4 : 0;
}

/* Parses [certificate=C] [name=N] [home=H] [start=K], each one letter. */
static void take_identity(const char **at, struct event_join *j)
{
	static const char *const letters[] = {"a", "b", "c", "d"};
	const char **where[] = {&j->certificate, &j->name, &j->home};
	static const char *const words[] = {"certificate=", "name=", "home="};
	for (int i = 0; i < 3; i++)
		for (int k = 0; skip_word(at, words[i]); k = 0) {
			while (k < 3 && **at != *letters[k])
				k++;
			*where[i] = letters[k];
			skip_word(at, letters[k]);
		}
	if (skip_word(at, "start="))
		j->restarts = take_count(at);
}

static void take_worker(const char **at, struct event *ev, char *name, char *fingerprint)
{
	ev->peer = take_id(at, "w");
	if (skip_word(at, "joins")) {
		ev->kind = EVENT_JOINED;
		int n = 0;
		if (sscanf(*at, "%31s threads=%u%n", fingerprint, &ev->join.threads, &n) != 2)
			fail_msg("F threads=T is missing: %s", *at);
		*at += n;
		skip_word(at, " ");
		snprintf(name, 32, "w%" PRIu64, ev->peer);
		ev->join.peer = ev->peer;
		ev->join.name = name;
		ev->join.fingerprint = fingerprint;
		take_identity(at, &ev->join);
		ev->peer = 0;
	} else if (skip_word(at, "leaves")) {
		ev->kind = EVENT_LEFT;
	} else if (skip_word(at, "heartbeat")) {
		ev->kind = EVENT_HEARTBEAT;
	} else if (skip_word(at, "wants")) {
		ev->kind = EVENT_REQUEST;
		ev->want = (uint32_t)take_count(at);
	} else {
		bool lacks = skip_word(at, "lacks"), lost = !lacks && skip_word(at, "denies"),
		     late = !lacks && !lost && skip_word(at, "recalls"),
		     later = !lacks && !lost && !late && skip_word(at, "postpones");
		bool refuses = lost || late || (!lacks && !later && skip_word(at, "refuses"));
		ev->kind = lacks || refuses || later   ? EVENT_LEASE_FAILED
			   : skip_word(at, "batch")    ? EVENT_BATCH
			   : skip_word(at, "stored")   ? EVENT_STORED
			   : skip_word(at, "delivers") ? EVENT_DELIVERED
			   : skip_word(at, "fails")    ? EVENT_LEASE_FAILED
						       : EVENT_LEASE_RETURNED;
		if (ev->kind == EVENT_LEASE_RETURNED && !skip_word(at, "returns"))
			fail_msg("no such event: %s", *at);
		ev->lease.key = take_key(at);
		ev->lease.own = lacks || later;
		ev->lease.later = later;
		ev->lease.bad_states = refuses;
		ev->lease.can_take_back = refuses && !lost;
		ev->lease.other_states = late;
		ev->lease.valid = !skip_word(at, "bad");
		if (skip_word(at, "says "))
			memset(&ev->lease.digest, *(*at)++, sizeof ev->lease.digest);
		skip_word(at, " ");
	}
}

/* Parses restore [asked] J boot|render N,N,... [fingerprint=F] [elapsed=T] [completed=T] [black] [options of
 * submit]. */
static void take_restore(const char **at, struct event *ev, struct plan *p, char *fingerprint, uint64_t *next,
			 const struct forecast_history *looks, char owner[WORD])
{
	bool asked = skip_word(at, "asked");
	struct event_restore r = {.job = take_id(at, "j"),
				  .next = next,
				  .fingerprint = fingerprint,
				  .elapsed = NAN,
				  .opened = NAN,
				  .completed = NAN,
				  .looks = looks};
	r.kind = skip_word(at, "boot") ? LEASE_BOOTSTRAP : LEASE_RENDER;
	if (r.kind == LEASE_RENDER && !skip_word(at, "render"))
		fail_msg("boot or render is missing: %s", *at);
	fingerprint[0] = 0;
	do
		*next++ = take_count(at);
	while (skip_word(at, ","));
	if (skip_word(at, "fingerprint=")) {
		int n = 0;
		sscanf(*at, "%31s%n", fingerprint, &n);
		*at += n;
		skip_word(at, " ");
	}
	if (skip_word(at, "elapsed="))
		r.elapsed = r.opened = take_number(at);
	if (skip_word(at, "completed="))
		r.completed = take_number(at);
	r.black = skip_word(at, "black");
	take_submit(at, ev, p, owner);
	r.submit = ev->submit;
	ev->kind = EVENT_RESTORE;
	if (!asked)
		ev->tag = 0;
	ev->restore = r;
}

static void take_extend(const char **at, struct event *ev, struct plan *p, char owner[WORD])
{
	ev->job = take_id(at, "j");
	take_submit(at, ev, p, owner);
	ev->kind = EVENT_EXTEND;
	ev->plan = p;
}

static void take_job(const char **at, struct event *ev)
{
	if (skip_word(at, "cancel")) {
		ev->kind = EVENT_CANCEL;
		ev->job = take_id(at, "j");
	} else if (skip_word(at, "prepared")) {
		ev->kind = EVENT_PREPARED;
		ev->prepared.job = take_id(at, "j");
		ev->prepared.black = skip_word(at, "black");
		ev->prepared.ok = !skip_word(at, "bad");
	} else if (skip_word(at, "error")) {
		ev->kind = EVENT_ERROR_KNOWN;
		ev->error_known.job = take_id(at, "j");
		ev->error_known.rounds = take_count(at);
		ev->error_known.black = skip_word(at, "black");
		ev->error_known.rel_error = ev->error_known.black ? NAN : take_number(at);
	} else if (skip_word(at, "image")) {
		ev->kind = EVENT_IMAGE_KNOWN;
		ev->image_known.job = take_id(at, "j");
		ev->image_known.disagrees = skip_word(at, "disagrees");
	} else if (skip_word(at, "hold") || skip_word(at, "release")) {
		ev->kind = EVENT_HOLD;
		ev->tag = 7;
		ev->hold = skip_word(at, "order") ? HOLD_ORDERED : skip_word(at, "files") ? HOLD_FILES : HOLD_STORAGE;
		ev->job = take_id(at, "j");
	} else if (skip_word(at, "priority")) {
		ev->kind = EVENT_PRIORITY;
		ev->tag = 7;
		ev->job = take_id(at, "j");
		ev->priority = (int)take_number(at);
	} else if (skip_word(at, "quarantined")) { /* the letter of NAME, as for `joins` */
		ev->kind = EVENT_QUARANTINED;
		take_identity(at, &ev->join);
	} else if (skip_word(at, "broken")) {
		ev->kind = EVENT_JOB_BROKEN;
		ev->job = take_id(at, "j");
	} else if (!skip_word(at, "tick")) {
		fail_msg("no such event: %s", *at);
	}
}

static double last_wake;

static bool play_wake(const char *line, const char *expected)
{
	char text[32];
	snprintf(text, sizeof text, "%g", last_wake);
	if (strcmp(text, expected) == 0)
		return true;
	print_error("%s\n        but it is %s\n", line, text);
	return false;
}

static bool play_line(struct farm *f, const char *line)
{
	const char *at = line, *arrow = strstr(line, "-> ");
	char name[32], fingerprint[32], owner[WORD], text[256];
	struct plan plan;
	uint64_t next[64];
	struct forecast_history looks = {.count = 0};
	struct event ev = {.kind = EVENT_TICK};
	if (!arrow || !skip_word(&at, "["))
		fail_msg("not a line of a transcript: %s", line);
	ev.time = take_number(&at);
	skip_word(&at, "]");
	if (skip_word(&at, "unread="))
		ev.unread = take_number(&at);
	if (skip_word(&at, "wake"))
		return play_wake(line, arrow + 3);
	if (*at == 'w')
		take_worker(&at, &ev, name, fingerprint);
	else if (skip_word(&at, "submit"))
		take_submit(&at, &ev, &plan, owner);
	else if (skip_word(&at, "extend"))
		take_extend(&at, &ev, &plan, owner);
	else if (skip_word(&at, "restore"))
		take_restore(&at, &ev, &plan, fingerprint, next, &looks, owner);
	else
		take_job(&at, &ev);
	snprintf(text, sizeof text, "%.*s", at < arrow ? (int)(arrow - at) - 1 : 0, at);
	ev.text = text;

	struct update u;
	farm_step(f, &ev, &u);
	last_wake = u.wake;
	struct said s = {.used = 0};
	for (size_t i = 0; i < u.count; i++) {
		say(&s, "%s", i ? ", " : "");
		say_action(&s, &u.actions[i]);
	}
	if (u.count == 0)
		say(&s, "-");
	if (strcmp(s.text, arrow + 3) == 0)
		return true;
	print_error("\"%.*s%s\",\n", (int)(arrow + 3 - line), line, s.text);
	print_error("        but expected: %s\n", arrow + 3);
	return false;
}

struct farm *transcript_farm(void)
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
static bool says_why(const struct farm *f, const char *line)
{
	enum { JOBS = 64 };
	bool all = true;
	for (uint64_t id = 1; id <= JOBS; id++) {
		struct job_status s;
		if (!farm_job(f, id, 0, &s) || job_state_is_end(s.state) || (s.leases && s.state != JOB_HELD) ||
		    (*s.waiting && *s.owners_waiting))
			continue;
		print_error("\"%s\": j%llu waits and does not say for what\n", line, (unsigned long long)id);
		all = false;
	}
	return all;
}

void transcript_play(struct farm *f, const char *const *lines)
{
	int wrong = 0;
	for (; *lines; lines++)
		wrong += !play_line(f, *lines) + !says_why(f, *lines);
	assert_int_equal(wrong, 0);
}

void transcript(const char *const *lines)
{
	struct farm *f = transcript_farm();
	transcript_play(f, lines);
	farm_free(f);
}
