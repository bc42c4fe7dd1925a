/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job as it is displayed: a record, plus values that only a live job has, as a message or JSON.
 *
 * view_from_record starts a view, view_add_status adds the core's values. Users who may see only their own jobs get
 * texts without the ids of other owners' jobs (view_hide_other_owners). Unknown numbers are null in JSON and negative
 * in messages. Messages borrow the view's texts and must be sent while the view exists. JSON is NULL if memory runs
 * out.
 */
#include "coordinator/live_job/view.h"

#include "common/base/text.h"
#include "common/json/estimate_json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The part of struct job_view that a field is in. */
#define IN_RECORD record.
#define IN_VIEW

void view_from_record(struct job_view *v, const struct job_record *r)
{
	memset(v, 0, sizeof *v);
	v->record = *r;
	v->eta = record_is_ended(r) ? 0 : -1;
	v->share = v->reading = -1;
}

/* Converts a number of the core to that of the record: unknown becomes 0, or negative where 0 has a meaning. */
static double from_core_real(double x)
{
	return isfinite(x) ? x : 0;
}

static double from_core_known(double x)
{
	return isfinite(x) ? x : -1;
}

static int from_core_int(int n)
{
	return n;
}

static uint32_t from_core_u32(uint32_t n)
{
	return n;
}

void view_add_status(struct job_view *v, const struct job_status *s)
{
	struct job_record *r = &v->record;
	text_copy(r->state, sizeof r->state, job_state_name(s->state));
	text_copy(r->reason, sizeof r->reason, s->end == END_NONE ? "" : job_end_name(s->end));
	r->exit_code = job_state_is_end(s->state) ? (uint32_t)job_exit_code(s) : 0;
	r->looks = *s->looks;
	r->counts = s->counts;
	v->halving_cpu = s->halving_cpu;
	v->halving_seconds = s->halving_seconds;
#define BY_CORE(statement) statement;
#define BY_JOBS(statement)
#define TEXT(member, size, in, by, key, shown, wire) by(text_copy(v->in member, size, s->member))
#define NUMBER(kind, member, in, by, key, shown, wire) by(v->in member = from_core_##kind(s->member))
#define COUNT(member, by, key, shown, wire) by(r->member = s->member)
	JOB_FIELDS(TEXT, NUMBER, COUNT, JOB_NO_FIELD)
#undef BY_CORE
#undef BY_JOBS
#undef TEXT
#undef NUMBER
#undef COUNT
}

void view_hide_other_owners(struct job_view *v)
{
	memcpy(v->place, v->owners_place, sizeof v->place);
	memcpy(v->waiting, v->owners_waiting, sizeof v->waiting);
}

static const char *displayed_reason(const struct job_view *v)
{
	return *v->waiting ? v->waiting : v->record.why;
}

void view_to_wire(const struct job_view *v, Farm__JobStatus *out)
{
	const struct job_record *r = &v->record;
	farm__job_status__init(out);
#define SEND(x) (x)
#define IGNORE(x)
#define AT(to) out->to = SEND
#define NOWHERE IGNORE
#define TEXT(member, size, in, by, key, shown, wire) wire(text_unconst(v->in member));
#define NUMBER(kind, member, in, by, key, shown, wire) wire(v->in member);
#define COUNT(member, by, key, shown, wire) wire(r->member);
#define COUNTER(member, key, wire) wire(r->counts.member);
	JOB_FIELDS(TEXT, NUMBER, COUNT, COUNTER)
#undef AT
#undef NOWHERE
#undef TEXT
#undef NUMBER
#undef COUNT
#undef COUNTER
	out->why = text_unconst(displayed_reason(v));
	out->ended = record_is_ended(r);
	out->halving_cpu_seconds = v->halving_cpu.middle;
	out->halving_seconds = v->halving_seconds.middle;
}

void view_looks_to_wire(const struct job_view *v, struct view_looks *looks, Farm__JobStatus *out)
{
	const struct forecast_history *h = &v->record.looks;
	for (uint32_t i = 0; i < h->count; i++) {
		Farm__Look *l = looks->pointers[i] = &looks->items[i];
		farm__look__init(l);
		FORECAST_COPY_LOOK(l, &h->looks[i]);
		l->doubtful = h->looks[i].is_doubtful != 0;
	}
	out->n_looks = h->count;
	out->looks = looks->pointers;
}

static json_t *number_or_null(double x, bool is_known)
{
	return is_known ? json_real_or_null(x) : json_null();
}

/* Adds the estimated error and the cost of halving it. */
static void add_forecast(json_t *o, const struct job_view *v)
{
	const struct job_record *r = &v->record;
	struct forecast_range error, eta = {v->eta_low, v->eta, v->eta_high};
	bool is_known = forecast_current_error(&r->looks, &error), live = !record_is_ended(r);
	json_object_set_new(o, "errorNow", is_known ? forecast_range_to_json(&error) : json_null());
	json_object_set_new(o, "etaRange", live && v->eta >= 0 ? forecast_range_to_json(&eta) : json_null());
	json_object_set_new(o, "nextHalving",
			    !is_known || !live
				    ? json_null()
				    : json_pack("{s:o s:o}", "cpuSeconds", forecast_range_to_json(&v->halving_cpu),
						"wallSeconds", forecast_range_to_json(&v->halving_seconds)));
}

static json_t *lines_to_json(const char *lines)
{
	json_t *list = json_array();
	for (size_t n = 0; *lines; lines += n + (lines[n] == '\n')) {
		n = strcspn(lines, "\n");
		json_array_append_new(list, json_stringn(lines, n));
	}
	return list;
}

static void add_details(json_t *o, const struct job_record *r)
{
	json_object_set_new(o, "sceneNotes", lines_to_json(r->scene_notes));
	json_object_set_new(o, "strategies", record_strategies_to_json(r));
	json_object_set_new(o, "classes", classes_to_json(r->classes));
	json_object_set_new(o, "effects", record_effects_to_json(r));
	json_object_set_new(o, "looks", forecast_looks_to_json(&r->looks));
}

#define TEXT(member, size, in, by, key, shown, wire) {FIELD_TEXT, offsetof(struct job_view, in member), size, shown},
#define NUMBER(kind, member, in, by, key, shown, wire) {FIELD_##kind, offsetof(struct job_view, in member), 0, shown},
#define COUNT(member, by, key, shown, wire) {FIELD_u64, offsetof(struct job_view, record.member), 0, shown},
static const struct job_field fields[] = {JOB_FIELDS(TEXT, NUMBER, COUNT, JOB_NO_FIELD)};
#undef TEXT
#undef NUMBER
#undef COUNT

json_t *view_to_json(const struct job_view *v, bool details)
{
	const struct job_record *r = &v->record;
	char id[32];
	snprintf(id, sizeof id, "j%llu", (unsigned long long)r->id);
	json_t *o = json_pack("{s:s}", "id", id);
	if (!o || !fields_to_status_json(fields, sizeof fields / sizeof *fields, v, o)) {
		json_decref(o);
		return NULL;
	}
	json_object_set_new(o, "why", json_string(displayed_reason(v)));
	json_object_set_new(o, "share", number_or_null(v->share, v->share >= 0 && !record_is_ended(r)));
	add_forecast(o, v);
	json_object_set_new(o, "counts", record_counts_to_json(r));
	json_object_set_new(o, "agreement", convergence_to_json(&r->convergence));
	if (details)
		add_details(o, r);
	return o;
}

json_t *view_peer_to_json(const struct peer_status *p, double now)
{
	/* clang-format off */
	return json_pack("{s:I s:s s:s s:s s:i s:i s:i s:f s:f s:I s:I s:I s:I s:I s:I s:s}",
			 "id", (json_int_t)p->id, "name", p->name, "state", peer_state_name(p->state),
			 "fingerprint", p->fingerprint, "threads", (int)p->threads, "want", (int)p->wanted_leases,
			 "leases", (int)p->held_leases, "connected", now - p->joined_at, "heard", now - p->last_seen,
			 "merged", (json_int_t)p->merged, "repeats", (json_int_t)p->repeats,
			 "refused", (json_int_t)p->refused, "failures", (json_int_t)p->failures,
			 "faults", (json_int_t)p->faults, "restarts", (json_int_t)p->restarts, "text", p->last_fault);
	/* clang-format on */
}

json_t *view_quarantined_to_json(const struct worker_status *w)
{
	/* clang-format off */
	return json_pack("{s:s s:s s:s s:I s:I s:s}",
			 "name", w->name, "certificate", w->certificate, "home", w->home,
			 "restarts", (json_int_t)w->restarts, "wrong", (json_int_t)w->wrong_results, "why", w->last_fault);
	/* clang-format on */
}

json_t *view_lease_to_json(const struct lease_status *l, const char *worker, double now)
{
	char id[32];
	snprintf(id, sizeof id, "j%llu", (unsigned long long)l->key.job);
	return json_pack("{s:s s:s s:i s:i s:I s:s s:f s:b}", "job", id, "kind", lease_kind_name(l->key.kind), "group",
			 (int)l->key.group, "part", (int)l->key.part, "epoch", (json_int_t)l->key.epoch, "worker",
			 worker, "age", now - l->sent_at, "overdue", (int)l->is_overdue);
}
