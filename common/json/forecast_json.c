/* SPDX-License-Identifier: Apache-2.0 */
#include "common/json/forecast_json.h"

#include "common/json/whole.h"

#include <math.h>

json_t *forecast_real(double x)
{
	return isfinite(x) ? json_real(x) : json_null();
}

json_t *forecast_range_to_json(const struct forecast_range *r)
{
	return json_pack("{s:o s:o s:o}", "low", forecast_real(r->low), "expected", forecast_real(r->middle), "high",
			 forecast_real(r->high));
}

json_t *forecast_looks_to_json(const struct forecast_history *h)
{
	json_t *list = json_array();
	for (uint32_t i = 0; i < h->count; i++) {
		const struct forecast_look *l = &h->looks[i];
		if (!isfinite(l->work + l->cpu_seconds + l->seconds + l->rel_mse + l->rel_mse_upper))
			continue; /* JSON has no such numbers */
		list = json_and(list, json_pack("{s:f s:f s:f s:f s:f s:o s:b}", "mutations", l->work, "cpuSeconds",
						l->cpu_seconds, "wallSeconds", l->seconds, "relMSE", l->rel_mse,
						"relMSEUpper", l->rel_mse_upper, "degrees", forecast_real(l->degrees),
						"doubtful", l->doubtful != 0));
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
					  .doubtful = json_is_true(json_object_get(o, "doubtful"))};
		forecast_add_look(h, &l);
	}
}
