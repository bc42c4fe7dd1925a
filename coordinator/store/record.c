/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's record as JSON, with a checksum.
 *
 * record_to_json writes all that is remembered of a job, record_from_json reads it back; a key that is missing, because
 * an older version wrote the file, is zero or the text "". The counters follow from the list of
 * coordinator/core/counts.h. The checksum is over the content with sorted keys, so that layout does not matter.
 *
 * A text that is not UTF-8 is -EINVAL and the record is not written. A damaged file is -EBADMSG, one of another schema
 * -EPROTO. A record without a checksum is of an earlier version and believed.
 */
#include "coordinator/store/record.h"

#include "common/base/crc.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/json/convergence_json.h"
#include "common/json/forecast_json.h"
#include "common/json/strategy_json.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SCHEMA = 1 };

static const struct {
	const char *name;
	size_t offset;
} counts[] = {
	{"rounds", offsetof(struct job_record, rounds)},
	{"mutations", offsetof(struct job_record, mutations)},
	{"merged", offsetof(struct job_record, leases_merged)},
#define X(name, key) {key, offsetof(struct job_record, counts.name)},
	JOB_COUNTS(X)
#undef X
		{"stuck", offsetof(struct job_record, stuck)},
	{"longestStuck", offsetof(struct job_record, longest_stuck)},
};

void record_take_counted(struct job_record *r, const struct plan *p, const struct canvas_counts *n, bool black,
			 double beyond_share)
{
	r->stuck = n->counters[COUNT_STUCK];
	r->longest_stuck = n->counters[COUNT_LONGEST_STUCK];
	memcpy(r->strategy, n->strategy, sizeof r->strategy);
	strategy_note(p, n, black, r->note, sizeof r->note);
	strategy_add_beyond(beyond_share, r->note, sizeof r->note);
	convergence_add_note(&r->agreement, r->note, sizeof r->note);
}

void record_add_note(struct job_record *r, const char *text)
{
	size_t used = strlen(r->note);
	if (*text)
		text_print(r->note + used, sizeof r->note - used, "%s%s", used ? "; " : "", text);
}

void record_add_doubt(struct job_record *r)
{
	char text[sizeof r->rel_error_doubt + 64];
	snprintf(text, sizeof text, "the error's interval is not known: %s", r->rel_error_doubt);
	if (*r->rel_error_doubt && !strstr(r->note, text))
		record_add_note(r, text);
}

void record_begin_convergence(struct job_record *r)
{
	convergence_from_json(NULL, &r->agreement);
	classes_from_json(NULL, r->classes);
	r->b = 0;
}

void record_take_convergence(struct job_record *r, const struct canvas_image *img, const struct convergence *a)
{
	r->agreement = *a;
	r->b = img->b;
	memcpy(r->classes, img->classes, sizeof r->classes);
}

void record_take_error(struct job_record *r, const struct canvas_image *img)
{
	r->rel_error = img->rel_mse_doubt ? -1 : sqrt(img->rel_mse_upper);
	stated_error_doubt(img, r->rel_error_doubt, sizeof r->rel_error_doubt);
}

void record_take_effects(struct job_record *r, json_t *list)
{
	size_t n = list ? json_dumpb(list, r->effects, sizeof r->effects - 1, JSON_COMPACT) : 0;
	r->effects[n < sizeof r->effects ? n : 0] = 0;
	json_decref(list);
}

json_t *record_effects(const struct job_record *r)
{
	json_t *list = *r->effects ? json_loads(r->effects, JSON_REJECT_DUPLICATES, NULL) : NULL;
	if (json_is_array(list))
		return list;
	json_decref(list);
	return json_array();
}

json_t *record_strategies(const struct job_record *r)
{
	struct canvas_counts n = {{0}, {{0}}};
	memcpy(n.strategy, r->strategy, sizeof n.strategy);
	return strategy_to_json(r->mixture, &n);
}

/* A record from elsewhere must not name more strategies than there are counters for. */
static void take_strategies(const json_t *o, struct job_record *r)
{
	struct canvas_counts n;
	if (plan_strategy_count(r->mixture) < 0)
		memset(r->mixture, 0, sizeof r->mixture);
	strategy_from_json(json_object_get(o, "strategies"), &n);
	memcpy(r->strategy, n.strategy, sizeof r->strategy);
}

json_t *record_counts(const struct job_record *r)
{
	json_t *o = json_object();
	for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
		uint64_t n;
		if (!counts[i].name)
			continue;
		memcpy(&n, (const char *)r + counts[i].offset, sizeof n);
		json_object_set_new(o, counts[i].name, json_integer((json_int_t)n));
	}
	return o;
}

static void take_counts(const json_t *o, struct job_record *r)
{
	for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
		if (!counts[i].name)
			continue;
		uint64_t n = (uint64_t)json_integer_value(json_object_get(o, counts[i].name));
		memcpy((char *)r + counts[i].offset, &n, sizeof n);
	}
}

static void put_looks(json_t *o, const struct job_record *r)
{
	json_object_set_new(o, "targetError", json_real(r->target_error));
	json_object_set_new(o, "cpuSeconds", json_real(r->cpu_seconds));
	json_object_set_new(o, "bootstrapCpuSeconds", json_real(r->bootstrap_cpu_seconds));
	json_object_set_new(o, "bootstrapSeconds", json_real(r->bootstrap_seconds));
	json_object_set_new(o, "looks", forecast_looks_to_json(&r->looks));
}

static void take_looks(const json_t *o, struct job_record *r)
{
	r->target_error = json_number_value(json_object_get(o, "targetError"));
	r->cpu_seconds = json_number_value(json_object_get(o, "cpuSeconds"));
	r->bootstrap_cpu_seconds = json_number_value(json_object_get(o, "bootstrapCpuSeconds"));
	r->bootstrap_seconds = json_number_value(json_object_get(o, "bootstrapSeconds"));
	forecast_looks_from_json(json_object_get(o, "looks"), &r->looks);
}

/* Of what it says, however it is laid out. -ENOMEM */
static int checksum(const json_t *o, json_int_t *sum, struct error *e)
{
	char *text = json_dumps(o, JSON_COMPACT | JSON_SORT_KEYS);
	if (!text)
		return error_set(e, ENOMEM, "no memory for a record");
	*sum = crc32c(0, text, strlen(text));
	free(text);
	return 0;
}

/* A record without one is of an earlier version. */
static int check(json_t *o, struct error *e)
{
	const json_t *said = json_object_get(o, "crc32c");
	json_int_t want = json_integer_value(said), got = 0;
	if (!said)
		return 0;
	json_object_del(o, "crc32c");
	int rc = checksum(o, &got, e);
	return rc ? rc : got == want ? 0 : error_set(e, EBADMSG, "damaged: its checksum does not fit");
}

int record_to_json(const struct job_record *r, char **out, struct error *e)
{
	json_error_t fault;
	json_t *o = json_pack_ex(
		&fault, 0, "{s:i s:I s:s s:s s:s s:s s:s s:s s:i s:i s:b s:f s:f s:f s:f s:o s:s s:s s:o}", /* */
		"schema", SCHEMA, "id", (json_int_t)r->id, "name", r->name, "integrator", r->integrator,    /* */
		"state", r->state, "reason", r->reason, "why", r->why, "output", r->output,		    /* */
		"priority", r->priority, "exitCode", (int)r->exit_code, "result", (int)r->has_result,	    /* */
		"submitted", r->submitted, "ended", r->ended, "progress", r->progress,			    /* */
		"relError", r->rel_error, "counts", record_counts(r),					    /* */
		"mixture", r->mixture, "note", r->note, "strategies", record_strategies(r));
	if (!o)
		return error_set(e, json_error_code(&fault) == json_error_invalid_utf8 ? EINVAL : ENOMEM,
				 "the record of job j%llu cannot be written: %s", (unsigned long long)r->id,
				 fault.text);
	json_object_set_new(o, "owner", json_string(r->owner));
	json_object_set_new(o, "relErrorDoubt", json_string(r->rel_error_doubt));
	json_object_set_new(o, "endedSeen", json_real(r->ended_seen));
	json_object_set_new(o, "cleared", json_real(r->cleared));
	json_object_set_new(o, "extended", json_integer((json_int_t)r->extended));
	json_object_set_new(o, "verify", json_real(r->verify));
	json_object_set_new(o, "agreement", convergence_to_json(&r->agreement));
	json_object_set_new(o, "b", json_real(r->b));
	json_object_set_new(o, "classes", classes_to_json(r->classes));
	json_object_set_new(o, "effects", record_effects(r));
	put_looks(o, r);
	json_int_t sum = 0;
	int rc = checksum(o, &sum, e);
	if (rc || json_object_set_new(o, "crc32c", json_integer(sum))) {
		json_decref(o);
		return error_set(e, ENOMEM, "no memory for a record");
	}
	char *text = json_dumps(o, JSON_INDENT(2));
	json_decref(o);
	*out = text ? mem_strdup(text) : NULL;
	free(text);
	return *out ? 0 : error_set(e, ENOMEM, "no memory for the record of a job");
}

static void take_text(const json_t *o, const char *key, char *out, size_t size)
{
	const char *text = json_string_value(json_object_get(o, key));
	text_copy(out, size, text ? text : "");
}

int record_from_json(const char *text, size_t size, struct job_record *r, struct error *e)
{
	json_error_t fault;
	json_t *o = json_loadb(text, size, JSON_REJECT_DUPLICATES, &fault);
	const json_t *schema = json_object_get(o, "schema"); /* NULL of whatever is no object */
	memset(r, 0, sizeof *r);
	if (json_integer_value(schema) != SCHEMA) {
		int rc =
			json_is_integer(schema)
				? error_set(
					  e, EPROTO,
					  "a record of version %lld, and version %d is known here: another coordinator wrote it",
					  (long long)json_integer_value(schema), SCHEMA)
			: !o && json_error_code(&fault) == json_error_out_of_memory
				? error_set(e, ENOMEM, "no memory for a record")
				: error_set(e, EBADMSG, "not the record of a job: %s", o ? "no schema" : fault.text);
		json_decref(o);
		return rc;
	}
	int damaged = check(o, e);
	if (damaged) {
		json_decref(o);
		return damaged;
	}
	r->id = (uint64_t)json_integer_value(json_object_get(o, "id"));
	take_text(o, "name", r->name, sizeof r->name);
	take_text(o, "integrator", r->integrator, sizeof r->integrator);
	take_text(o, "state", r->state, sizeof r->state);
	take_text(o, "reason", r->reason, sizeof r->reason);
	take_text(o, "why", r->why, sizeof r->why);
	take_text(o, "output", r->output, sizeof r->output);
	take_text(o, "owner", r->owner, sizeof r->owner);
	r->extended = (uint64_t)json_integer_value(json_object_get(o, "extended"));
	r->priority = (int)json_integer_value(json_object_get(o, "priority"));
	r->exit_code = (uint32_t)json_integer_value(json_object_get(o, "exitCode"));
	r->has_result = json_is_true(json_object_get(o, "result"));
	r->cleared = json_number_value(json_object_get(o, "cleared"));
	r->verify = json_number_value(json_object_get(o, "verify"));
	r->submitted = json_number_value(json_object_get(o, "submitted"));
	r->ended = json_number_value(json_object_get(o, "ended"));
	const json_t *seen = json_object_get(o, "endedSeen");
	r->ended_seen = json_is_number(seen) ? json_number_value(seen) : -1;
	r->progress = json_number_value(json_object_get(o, "progress"));
	r->rel_error = json_number_value(json_object_get(o, "relError"));
	take_text(o, "relErrorDoubt", r->rel_error_doubt, sizeof r->rel_error_doubt);
	take_text(o, "mixture", r->mixture, sizeof r->mixture);
	take_text(o, "note", r->note, sizeof r->note);
	take_counts(json_object_get(o, "counts"), r);
	take_strategies(o, r);
	convergence_from_json(json_object_get(o, "agreement"), &r->agreement);
	r->b = json_number_value(json_object_get(o, "b"));
	classes_from_json(json_object_get(o, "classes"), r->classes);
	take_looks(o, r);
	json_t *effects = json_object_get(o, "effects");
	record_take_effects(r, json_is_array(effects) ? json_incref(effects) : NULL);
	json_decref(o);
	return 0;
}

bool record_is_ended(const struct job_record *r)
{
	return strcmp(r->state, "done") == 0 || strcmp(r->state, "failed") == 0 || strcmp(r->state, "cancelled") == 0;
}
