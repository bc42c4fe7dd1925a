/* SPDX-License-Identifier: Apache-2.0 */
/*
 * header_fill goes through the plan, the result and the extra values, and adds an attribute for each value that is
 * known. Names and types come from header_list.h. All strings are stored in one buffer of fixed size; strings that do
 * not fit are cut, which is not an error. Nothing here fails.
 */
#include "common/exr/header.h"

#include "common/base/version.h"
#include "common/estimate/convergence.h"
#include "common/estimate/stated_error.h"
#include "common/estimate/strategy.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <string.h>
#include <time.h>

#define ROW(name, text, type, excluded, meaning) H_##name,
enum header_name {
#include "common/exr/header_list.h"
};
#undef ROW

enum { HEADER_STRATEGIES_MAX = 5120 };

#define STRING EXR_ATTRIBUTE_STRING
#define DOUBLE EXR_ATTRIBUTE_DOUBLE
#define INT EXR_ATTRIBUTE_INT

const struct header_row header_rows[] = {
#define ROW(name, text, type, excluded, meaning) [H_##name] = {text, type, excluded, meaning},
#include "common/exr/header_list.h"
#undef ROW
	{NULL, 0, false, NULL},
};

bool header_is_excluded(const char *name)
{
	for (const struct header_row *r = header_rows; r->name; r++)
		if (strcmp(r->name, name) == 0)
			return r->is_excluded;
	return false;
}

static struct exr_attribute *add_attribute(struct header *h, enum header_name name, int type)
{
	assert(h->count < HEADER_ATTRIBUTES_MAX && header_rows[name].type == type);
	(void)type;
	struct exr_attribute *a = &h->attributes[h->count++];
	*a = (struct exr_attribute){.name = header_rows[name].name};
	return a;
}

static void add_int(struct header *h, enum header_name name, uint32_t value)
{
	struct exr_attribute *a = add_attribute(h, name, INT);
	a->type = EXR_ATTRIBUTE_INT;
	a->integer = (int)value;
}

static void add_double(struct header *h, enum header_name name, double value)
{
	struct exr_attribute *a = add_attribute(h, name, DOUBLE);
	a->type = EXR_ATTRIBUTE_DOUBLE;
	a->number = value;
}

static void begin_string(struct header *h, enum header_name name)
{
	struct exr_attribute *a = add_attribute(h, name, STRING);
	a->type = EXR_ATTRIBUTE_STRING;
	a->string = h->unused_bytes.end;
	*h->unused_bytes.end = 0;
}

static void end_string(struct header *h)
{
	if (h->unused_bytes.remaining > 1) {
		h->unused_bytes.end++;
		h->unused_bytes.remaining--;
	}
}

static void add_string(struct header *h, enum header_name name, const char *value)
{
	begin_string(h, name);
	text_appendf(&h->unused_bytes, "%s", value);
	end_string(h);
}

static void add_count(struct header *h, enum header_name name, uint64_t value)
{
	begin_string(h, name);
	text_appendf(&h->unused_bytes, "%" PRIu64, value);
	end_string(h);
}

static void add_plan(struct header *h, const struct plan *p, uint64_t rounds, const struct plan_scene *inputs)
{
	static const struct plan_scene none = {.define_count = 0};
	char options[PLAN_OPTIONS_TEXT_MAX];
	plan_print_options_with_scene(p, rounds, inputs ? inputs : &none, options, sizeof options);
	add_string(h, H_INTEGRATOR, p->integrator);
	if (*p->mutations)
		add_string(h, H_MIXTURE, p->mutations);
	add_string(h, H_OPTIONS, options);
	add_count(h, H_SEED, p->seed);
	add_int(h, H_MIN_DEPTH, p->min_depth);
	add_int(h, H_MAX_DEPTH, p->max_depth);
	add_int(h, H_GROUPS, p->groups);
	add_count(h, H_BOOTSTRAP, p->bootstrap);
	add_count(h, H_EPOCH, p->epoch);
	add_count(h, H_ROUNDS, rounds);
}

static void add_convergence(struct header *h, const struct canvas_image *img, const struct plan *p,
			    const struct convergence *a)
{
	if (p->kind != PLAN_CHAINS)
		return;
	char table[CONVERGENCE_TABLE_MAX];
	add_string(h, H_AGREEMENT, convergence_name(a->verdict));
	if (*a->text)
		add_string(h, H_DISAGREEMENT, a->text);
	if (!isnan(a->max_r_hat)) {
		add_double(h, H_R_HAT_MEDIAN, a->median_r_hat);
		add_double(h, H_R_HAT_WORST, a->max_r_hat);
	}
	convergence_print_table(img->classes, img->b, a, table, sizeof table);
	if (*table)
		add_string(h, H_CLASSES, table);
}

static void add_error(struct header *h, const struct canvas_image *img)
{
	char why[STATED_ERROR_TEXT_MAX];
	stated_error_print_doubt(img, why, sizeof why);
	if (*why) {
		add_string(h, H_REL_MSE_DOUBT, why);
	} else if (isfinite(img->rel_mse)) {
		add_double(h, H_REL_MSE_UPPER, img->rel_mse_upper);
		add_double(h, H_REL_MSE_LOW_95, img->rel_mse_interval_95[0]);
		add_double(h, H_REL_MSE_HIGH_95, img->rel_mse_interval_95[1]);
	}
	add_string(h, H_REL_MSE_DEFINITION, REL_MSE_DEFINITION);
	if (img->unvisited_count)
		add_count(h, H_UNVISITED, img->unvisited_count);
}

static void add_b_error(struct header *h, const struct canvas_image *img)
{
	char why[STATED_ERROR_TEXT_MAX];
	stated_error_print_b_doubt(img, why, sizeof why);
	if (*why)
		add_string(h, H_B_ERROR_DOUBT, why);
	else if (isfinite(img->b_error))
		add_double(h, H_B_ERROR, img->b_error);
}

static void add_result(struct header *h, const struct canvas_image *img, const struct plan *p)
{
	if (p->kind == PLAN_CHAINS) {
		add_int(h, H_CHAINS, p->chains);
		add_count(h, H_MUTATIONS, img->samples);
		add_double(h, H_B, img->b);
		add_b_error(h, img);
		add_double(h, H_BEYOND, img->overlong_share);
		add_count(h, H_ACCEPTED, img->counts.counters[COUNT_ACCEPTED]);
		add_count(h, H_INDEPENDENT, img->counts.counters[COUNT_INDEPENDENT]);
		add_count(h, H_STUCK, img->counts.counters[COUNT_STUCK]);
		add_count(h, H_LONGEST_STUCK, img->counts.counters[COUNT_LONGEST_STUCK]);
	} else {
		add_count(h, H_SAMPLES, img->rounds * p->groups * p->epoch);
	}
	if (isfinite(img->rel_mse))
		add_double(h, H_REL_MSE, img->rel_mse);
	add_error(h, img);
	add_count(h, H_NAN, img->counts.counters[COUNT_NAN]);
	add_count(h, H_INFINITE, img->counts.counters[COUNT_INFINITE]);
	add_count(h, H_NEGATIVE, img->counts.counters[COUNT_NEGATIVE]);
	add_count(h, H_RAYS_CLOSEST, img->counts.counters[COUNT_RAYS_CLOSEST]);
	add_count(h, H_RAYS_SHADOW, img->counts.counters[COUNT_RAYS_SHADOW]);
	char text[HEADER_STRATEGIES_MAX];
	strategy_print_lines(p->mutations, &img->counts, text, sizeof text);
	if (*text)
		add_string(h, H_STRATEGIES, text);
	struct convergence a;
	convergence_judge(p, img, &a);
	strategy_print_note(p, &img->counts, img->is_black, text, sizeof text);
	strategy_append_overlong(img->overlong_share, text, sizeof text);
	convergence_append_note(&a, text, sizeof text);
	if (*text)
		add_string(h, H_NOTE, text);
	add_convergence(h, img, p, &a);
}

static void add_extra(struct header *h, const struct header_extra *x)
{
	add_string(h, H_SCENE, x->scene ? x->scene : "");
	if (x->scene_hash)
		add_string(h, H_SCENE_HASH, x->scene_hash);
	if (x->camera && *x->camera)
		add_string(h, H_CAMERA, x->camera);
	if (x->scene_notes && *x->scene_notes)
		add_string(h, H_SCENE_NOTES, x->scene_notes);
	add_int(h, H_MIXED, x->has_mixed_fingerprints);
	begin_string(h, H_EFFECTS);
	for (size_t i = 0; i < x->effect_count; i++)
		text_appendf(&h->unused_bytes, "%s%s: %s%s (%s; %s: %s)", i ? "\n" : "", x->effects[i].name,
			     x->effects[i].is_on ? "on" : "off", x->effects[i].is_forced ? " (forced)" : "",
			     x->effects[i].reason, x->effects[i].is_on ? "omitting it would save" : "saves",
			     x->effects[i].savings);
	end_string(h);
	add_double(h, H_WALL, x->wall_seconds);
	add_double(h, H_CPU, x->cpu_seconds);
	add_int(h, H_WORKERS, x->worker_count);
	char date[32] = "";
	time_t now = time(NULL);
	struct tm utc;
	if (!x->date && gmtime_r(&now, &utc))
		strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", &utc);
	add_string(h, H_DATE, x->date ? x->date : date);
	if (x->end_name)
		add_string(h, H_END, x->end_name);
}

void header_fill(struct header *h, const struct canvas_image *img, const struct plan *p, const struct header_extra *x)
{
	h->count = 0;
	h->unused_bytes = (struct text){h->text, HEADER_TEXT_MAX};
	add_string(h, H_VERSION, HSLT_VERSION);
	add_plan(h, p, img->rounds, x->inputs);
	add_result(h, img, p);
	add_extra(h, x);
}
