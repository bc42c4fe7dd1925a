/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Each ..._to_json function writes an estimate as an object or a list, and ..._from_json reads it again. JSON has
 * neither infinities nor NaN; such numbers become null. A value that is missing or of another type is read as 0 or as
 * unknown, so files of older versions can be read. Writing returns NULL if memory is out; reading cannot fail.
 */
#include "common/json/estimate_json.h"

#include "common/base/text.h"
#include "common/estimate/strategy.h"
#include "common/json/compose.h"

#include <math.h>
#include <string.h>

/* ---- errors and forecasts ---- */

json_t *json_real_or_null(double x)
{
	return isfinite(x) ? json_real(x) : json_null();
}

json_t *forecast_range_to_json(const struct forecast_range *r)
{
	return json_pack("{s:o s:o s:o}", "low", json_real_or_null(r->low), "expected", json_real_or_null(r->middle),
			 "high", json_real_or_null(r->high));
}

json_t *forecast_looks_to_json(const struct forecast_history *h)
{
	json_t *list = json_array();
	for (uint32_t i = 0; i < h->count; i++) {
		const struct forecast_look *l = &h->looks[i];
		if (!isfinite(l->work + l->cpu_seconds + l->seconds + l->rel_mse + l->rel_mse_upper))
			continue; /* JSON has neither infinities nor NaN */
		list = json_array_with(list, json_pack("{s:f s:f s:f s:f s:f s:o s:b}", "mutations", l->work,
						       "cpuSeconds", l->cpu_seconds, "wallSeconds", l->seconds,
						       "relMSE", l->rel_mse, "relMSEUpper", l->rel_mse_upper, "degrees",
						       json_real_or_null(l->degrees), "doubtful", l->is_doubtful != 0));
	}
	return list;
}

static double read_number(const json_t *o, const char *key)
{
	return json_number_value(json_object_get(o, key));
}

void forecast_looks_from_json(const json_t *list, struct forecast_history *h)
{
	size_t i;
	const json_t *o;
	h->count = 0;
	json_array_foreach(list, i, o)
	{
		struct forecast_look l = {.work = read_number(o, "mutations"),
					  .cpu_seconds = read_number(o, "cpuSeconds"),
					  .seconds = read_number(o, "wallSeconds"),
					  .rel_mse = read_number(o, "relMSE"),
					  .rel_mse_upper = read_number(o, "relMSEUpper"),
					  .degrees = read_number(o, "degrees"),
					  .is_doubtful = json_is_true(json_object_get(o, "doubtful"))};
		forecast_add_look(h, &l);
	}
}

/* ---- agreement of chains ---- */

static double read_real_or_nan(const json_t *o, const char *key)
{
	const json_t *x = json_object_get(o, key);
	return json_is_number(x) ? json_number_value(x) : NAN;
}

static uint32_t read_uint32(const json_t *x)
{
	json_int_t n = json_integer_value(x);
	return n < 0 ? 0 : n > UINT32_MAX ? UINT32_MAX : (uint32_t)n;
}

static json_t *class_names_to_json(uint32_t classes)
{
	json_t *list = json_array();
	for (unsigned k = 0; k < PATH_CLASSES; k++)
		if (classes >> k & 1)
			list = json_array_with(list, json_string(path_class_name(k)));
	return list;
}

json_t *convergence_to_json(const struct convergence *a)
{
	return json_pack("{s:s s:s s:o s:o s:[I,I] s:I s:I s:o s:o s:o s:o}", "verdict", convergence_name(a->verdict),
			 "text", a->text, /* */
			 "rHatMedian", json_real_or_null(a->median_r_hat), "rHatWorst",
			 json_real_or_null(a->max_r_hat),							 /* */
			 "worst", (json_int_t)a->worst_x, (json_int_t)a->worst_y, "tiles", (json_int_t)a->tiles, /* */
			 "tilesFlagged", (json_int_t)a->flagged_tiles, "energyFlagged",
			 json_real_or_null(a->flagged_energy_share), /* */
			 "stuckShare", json_real_or_null(a->stuck_share), "classesFlagged",
			 class_names_to_json(a->flagged_classes), /* */
			 "classesApart", class_names_to_json(a->inconsistent_classes));
}

static unsigned find_class(const json_t *name)
{
	unsigned k = 0;
	while (k < PATH_CLASSES && (!json_is_string(name) || strcmp(json_string_value(name), path_class_name(k)) != 0))
		k++;
	return k;
}

static uint32_t read_classes(const json_t *list)
{
	uint32_t classes = 0;
	for (size_t i = 0; i < json_array_size(list); i++) {
		unsigned k = find_class(json_array_get(list, i));
		if (k < PATH_CLASSES)
			classes |= UINT32_C(1) << k;
	}
	return classes;
}

void convergence_from_json(const json_t *o, struct convergence *a)
{
	const char *verdict = json_string_value(json_object_get(o, "verdict")),
		   *text = json_string_value(json_object_get(o, "text"));
	const json_t *worst = json_object_get(o, "worst");
	*a = (struct convergence){.median_r_hat = read_real_or_nan(o, "rHatMedian"),
				  .max_r_hat = read_real_or_nan(o, "rHatWorst")};
	for (int v = CHAINS_AGREE; verdict && v <= CHAINS_DISAGREE; v++)
		if (strcmp(verdict, convergence_name((enum convergence_verdict)v)) == 0)
			a->verdict = (enum convergence_verdict)v;
	text_copy(a->text, sizeof a->text, text ? text : "");
	a->worst_x = read_uint32(json_array_get(worst, 0));
	a->worst_y = read_uint32(json_array_get(worst, 1));
	a->tiles = read_uint32(json_object_get(o, "tiles"));
	a->flagged_tiles = read_uint32(json_object_get(o, "tilesFlagged"));
	a->flagged_energy_share = json_number_value(json_object_get(o, "energyFlagged"));
	a->stuck_share = json_number_value(json_object_get(o, "stuckShare"));
	a->flagged_classes = read_classes(json_object_get(o, "classesFlagged"));
	a->inconsistent_classes = read_classes(json_object_get(o, "classesApart"));
}

json_t *classes_to_json(const struct path_class_energy classes[PATH_CLASSES])
{
	json_t *list = json_array();
	for (unsigned k = 0; k < PATH_CLASSES; k++) {
		const struct path_class_energy *c = &classes[k];
		if (!(c->bootstrap > 0) && !(c->chains > 0))
			continue;
		list = json_array_with(list, json_pack("{s:s s:o s:o s:o s:o s:o}", "class", path_class_name(k),
						       "bootstrap", json_real_or_null(c->bootstrap), "bootstrapError",
						       json_real_or_null(c->bootstrap_error), "chains",
						       json_real_or_null(c->chains), "chainsError",
						       json_real_or_null(c->chains_error), "t",
						       json_real_or_null(c->difference_t)));
	}
	return list;
}

void classes_from_json(const json_t *list, struct path_class_energy classes[PATH_CLASSES])
{
	for (unsigned k = 0; k < PATH_CLASSES; k++)
		classes[k] = (struct path_class_energy){.difference_t = NAN};
	for (size_t i = 0; i < json_array_size(list); i++) {
		const json_t *o = json_array_get(list, i);
		unsigned k = find_class(json_object_get(o, "class"));
		if (k == PATH_CLASSES)
			continue;
		classes[k] = (struct path_class_energy){json_number_value(json_object_get(o, "bootstrap")),
							read_real_or_nan(o, "bootstrapError"),
							json_number_value(json_object_get(o, "chains")),
							read_real_or_nan(o, "chainsError"), read_real_or_nan(o, "t")};
	}
}

/* ---- counters of strategies ---- */

static json_t *clamped_integer(uint64_t n)
{
	return json_integer(n > INT64_MAX ? INT64_MAX : (json_int_t)n);
}

static json_t *counters_to_json(const char *name, const uint64_t counts[STRATEGY_COUNTERS])
{
	json_t *o = json_object_with(json_object(), "name", json_string(name)), *failures = json_object();
	for (int k = 0; k < STRATEGY_COUNTERS; k++) {
		json_t **destination = k < STRATEGY_FAIL_FIRST ? &o : &failures;
		*destination = json_object_with(*destination, strategy_counter_name((enum strategy_counter)k),
						clamped_integer(counts[k]));
	}
	return json_object_with(o, "failures", failures);
}

json_t *strategy_to_json(const char *mixture, const struct canvas_counts *n)
{
	json_t *list = json_array();
	int count = plan_strategy_count(mixture);
	for (int i = 0; i < count; i++) {
		char name[PLAN_MUTATIONS_MAX];
		plan_strategy_name(mixture, (uint32_t)i, name, sizeof name);
		list = json_array_with(list, counters_to_json(name, n->strategies[i]));
	}
	return list;
}

void strategy_from_json(const json_t *list, struct canvas_counts *n)
{
	memset(n->strategies, 0, sizeof n->strategies);
	for (size_t i = 0; i < json_array_size(list) && i < BATCH_STRATEGIES; i++) {
		const json_t *o = json_array_get(list, i), *failures = json_object_get(o, "failures");
		for (int k = 0; k < STRATEGY_COUNTERS; k++) {
			json_int_t value =
				json_integer_value(json_object_get(k < STRATEGY_FAIL_FIRST ? o : failures,
								   strategy_counter_name((enum strategy_counter)k)));
			n->strategies[i][k] = value > 0 ? (uint64_t)value : 0;
		}
	}
}
