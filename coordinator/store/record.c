/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's record as JSON, with a checksum.
 *
 * record_to_json writes everything that is kept of a job, record_from_json reads it back; a key that is missing,
 * because an older version wrote the record, becomes zero, unknown or "". Plain fields and counters are generated
 * from the list in coordinator/core/job_fields.h. The checksum is over the content with sorted keys, so that
 * formatting does not matter.
 *
 * If a text is not UTF-8, writing fails with -EINVAL. A damaged record is -EBADMSG, one of another schema -EPROTO. A
 * record without a checksum is of an earlier version and trusted.
 */
#include "coordinator/store/record.h"

#include "common/base/crc.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/json/estimate_json.h"
#include "common/json/compose.h"

#include <math.h>
#include <string.h>

enum { SCHEMA = 1 };

#define IN_RECORD(...) {__VA_ARGS__},
#define IN_VIEW(...)
#define TEXT(member, size, in, by, key, shown, wire) in(FIELD_TEXT, offsetof(struct job_record, member), size, key)
#define NUMBER(kind, member, in, by, key, shown, wire) in(FIELD_##kind, offsetof(struct job_record, member), 0, key)
static const struct job_field record_fields[] = {JOB_FIELDS(TEXT, NUMBER, JOB_NO_FIELD, JOB_NO_FIELD)};
#undef IN_RECORD
#undef IN_VIEW
#undef TEXT
#undef NUMBER

/* The members of the object "counts". */
#define COUNT(member, by, key, shown, wire) {FIELD_u64, offsetof(struct job_record, member), 0, key},
#define COUNTER(member, key, wire) {FIELD_u64, offsetof(struct job_record, counts.member), 0, key},
static const struct job_field count_fields[] = {JOB_FIELDS(JOB_NO_FIELD, JOB_NO_FIELD, COUNT, COUNTER)};
#undef COUNT
#undef COUNTER

enum {
	RECORD_FIELD_COUNT = sizeof record_fields / sizeof *record_fields,
	COUNT_FIELD_COUNT = sizeof count_fields / sizeof *count_fields
};

void record_set_counters(struct job_record *r, const struct plan *p, const struct canvas_counts *n, bool black,
			 double beyond_share)
{
	r->stuck = n->counters[COUNT_STUCK];
	r->longest_stuck = n->counters[COUNT_LONGEST_STUCK];
	memcpy(r->strategies, n->strategies, sizeof r->strategies);
	strategy_print_note(p, n, black, r->note, sizeof r->note);
	strategy_append_overlong(beyond_share, r->note, sizeof r->note);
	convergence_append_note(&r->convergence, r->note, sizeof r->note);
}

void record_add_note(struct job_record *r, const char *text)
{
	size_t used = strlen(r->note);
	if (*text)
		text_print(r->note + used, sizeof r->note - used, "%s%s", used ? "; " : "", text);
}

void record_add_doubt(struct job_record *r)
{
	char text[sizeof r->rel_error_doubt + 96], prefix[48] = "the error's interval";
	if (r->rel_error_about >= 0)
		snprintf(prefix, sizeof prefix, "the error is about %.3g %%, its interval", 100 * r->rel_error_about);
	snprintf(text, sizeof text, "%s is not known: %s", prefix, r->rel_error_doubt);
	if (*r->rel_error_doubt && !strstr(r->note, text))
		record_add_note(r, text);
}

void record_init(struct job_record *r, uint64_t id, const char *name, const char *owner)
{
	memset(r, 0, sizeof *r);
	r->id = id;
	text_copy(r->name, sizeof r->name, name);
	text_copy(r->owner, sizeof r->owner, owner);
	r->ended_seen = r->rel_error = r->rel_error_about = -1;
	convergence_from_json(NULL, &r->convergence);
	classes_from_json(NULL, r->classes);
	r->b = 0;
}

void record_set_convergence(struct job_record *r, const struct canvas_image *img, const struct convergence *a)
{
	r->convergence = *a;
	r->b = img->b;
	memcpy(r->classes, img->classes, sizeof r->classes);
}

void record_set_error(struct job_record *r, const struct canvas_image *img)
{
	r->rel_error_about = sqrt(img->rel_mse);
	r->rel_error = img->rel_mse_doubt ? -1 : sqrt(img->rel_mse_upper);
	stated_error_print_doubt(img, r->rel_error_doubt, sizeof r->rel_error_doubt);
}

void record_set_effects(struct job_record *r, json_t *list)
{
	size_t n = list ? json_dumpb(list, r->effects, sizeof r->effects - 1, JSON_COMPACT) : 0;
	r->effects[n < sizeof r->effects ? n : 0] = 0;
	json_decref(list);
}

json_t *record_effects_to_json(const struct job_record *r)
{
	return *r->effects ? json_loads(r->effects, JSON_REJECT_DUPLICATES, NULL) : json_array();
}

json_t *record_strategies_to_json(const struct job_record *r)
{
	struct canvas_counts n = {{0}, {{0}}};
	memcpy(n.strategies, r->strategies, sizeof n.strategies);
	return strategy_to_json(r->mixture, &n);
}

/* Clears a mixture that names more strategies than there are counters for. */
static void read_strategies(const json_t *o, struct job_record *r)
{
	struct canvas_counts n;
	if (plan_strategy_count(r->mixture) < 0)
		memset(r->mixture, 0, sizeof r->mixture);
	strategy_from_json(json_object_get(o, "strategies"), &n);
	memcpy(r->strategies, n.strategies, sizeof r->strategies);
}

json_t *record_counts_to_json(const struct job_record *r)
{
	json_t *o = json_object();
	if (fields_to_json(count_fields, COUNT_FIELD_COUNT, r, o, NULL) == 0)
		return o;
	json_decref(o);
	return NULL;
}

static int add_to_checksum(const char *piece, size_t size, void *sum)
{
	*(uint32_t *)sum = crc32c(*(uint32_t *)sum, piece, size);
	return 0;
}

/* Computes the checksum of the content, independent of formatting, piece by piece without a copy of the text. Returns
 * -ENOMEM. */
static int compute_checksum(const json_t *o, json_int_t *sum, struct error *e)
{
	uint32_t crc = 0;
	if (json_dump_callback(o, add_to_checksum, &crc, JSON_COMPACT | JSON_SORT_KEYS))
		return error_set(e, ENOMEM, "no memory for a record");
	*sum = crc;
	return 0;
}

/* A record without a checksum is of an earlier version and passes. */
static int verify_checksum(json_t *o, struct error *e)
{
	const json_t *stated = json_object_get(o, "crc32c");
	json_int_t expected = json_integer_value(stated), actual = 0;
	if (!stated)
		return 0;
	json_object_del(o, "crc32c");
	int rc = compute_checksum(o, &actual, e);
	return rc ? rc : actual == expected ? 0 : error_set(e, EBADMSG, "damaged: its checksum does not match");
}

int record_to_json(const struct job_record *r, char **out, struct error *e)
{
	json_t *o = json_pack("{s:i}", "schema", SCHEMA);
	int rc = o ? fields_to_json(record_fields, RECORD_FIELD_COUNT, r, o, e) : error_set(e, ENOMEM, "no memory");
	if (rc) {
		json_decref(o);
		return error_prefix(e, rc, "the record of job j%llu cannot be written", (unsigned long long)r->id);
	}
	o = json_object_with(o, "counts", record_counts_to_json(r));
	o = json_object_with(o, "strategies", record_strategies_to_json(r));
	o = json_object_with(o, "agreement", convergence_to_json(&r->convergence));
	o = json_object_with(o, "classes", classes_to_json(r->classes));
	o = json_object_with(o, "effects", record_effects_to_json(r));
	o = json_object_with(o, "looks", forecast_looks_to_json(&r->looks));
	json_int_t sum = 0;
	if (!o || compute_checksum(o, &sum, e) || !(o = json_object_with(o, "crc32c", json_integer(sum)))) {
		json_decref(o);
		return error_set(e, ENOMEM, "no memory for a record");
	}
	/* json_dumps would silently lose parts of the text if memory runs out. */
	size_t size = json_dumpb(o, NULL, 0, JSON_INDENT(2));
	char *text = size ? mem_alloc(size + 1, 1) : NULL;
	bool complete = text && json_dumpb(o, text, size, JSON_INDENT(2)) == size;
	json_decref(o);
	if (complete) {
		*out = text;
		return 0;
	}
	mem_free(text);
	return error_set(e, ENOMEM, "no memory for the record of a job");
}

int record_from_json(const char *text, size_t size, struct job_record *r, struct error *e)
{
	json_error_t fault;
	json_t *o = json_loadb(text, size, JSON_REJECT_DUPLICATES, &fault);
	const json_t *schema = json_object_get(o, "schema"); /* NULL unless o is an object */
	memset(r, 0, sizeof *r);
	if (json_integer_value(schema) != SCHEMA) {
		int rc =
			json_is_integer(schema)
				? error_set(
					  e, EPROTO,
					  "a record of version %lld, and this coordinator reads version %d: another release wrote it",
					  (long long)json_integer_value(schema), SCHEMA)
			: !o && json_error_code(&fault) == json_error_out_of_memory
				? error_set(e, ENOMEM, "no memory for a record")
				: error_set(e, EBADMSG, "not the record of a job: %s", o ? "no schema" : fault.text);
		json_decref(o);
		return rc;
	}
	int damaged = verify_checksum(o, e);
	if (damaged) {
		json_decref(o);
		return damaged;
	}
	fields_from_json(record_fields, RECORD_FIELD_COUNT, r, o);
	fields_from_json(count_fields, COUNT_FIELD_COUNT, r, json_object_get(o, "counts"));
	read_strategies(o, r);
	convergence_from_json(json_object_get(o, "agreement"), &r->convergence);
	classes_from_json(json_object_get(o, "classes"), r->classes);
	forecast_looks_from_json(json_object_get(o, "looks"), &r->looks);
	json_t *effects = json_object_get(o, "effects");
	record_set_effects(r, json_is_array(effects) ? json_incref(effects) : NULL);
	json_decref(o);
	return 0;
}

bool record_is_ended(const struct job_record *r)
{
	return strcmp(r->state, "done") == 0 || strcmp(r->state, "failed") == 0 || strcmp(r->state, "cancelled") == 0;
}
