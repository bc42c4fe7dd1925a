/* SPDX-License-Identifier: Apache-2.0 */
#include "common/json/strategy_json.h"

#include "common/estimate/strategy.h"
#include "common/json/whole.h"

#include <string.h>

static json_t *integer(uint64_t n)
{
	return json_integer(n > INT64_MAX ? INT64_MAX : (json_int_t)n);
}

static json_t *one_strategy(const char *name, const uint64_t counts[STRATEGY_COUNTERS])
{
	json_t *o = json_with(json_object(), "name", json_string(name)), *failures = json_object();
	for (int k = 0; k < STRATEGY_COUNTERS; k++) {
		json_t **at = k < STRATEGY_FAIL_FIRST ? &o : &failures;
		*at = json_with(*at, strategy_counter_name((enum strategy_counter)k), integer(counts[k]));
	}
	return json_with(o, "failures", failures);
}

json_t *strategy_to_json(const char *mixture, const struct canvas_counts *n)
{
	json_t *list = json_array();
	int count = plan_strategy_count(mixture);
	for (int i = 0; i < count; i++) {
		char name[PLAN_MUTATIONS_MAX];
		plan_strategy_name(mixture, (uint32_t)i, name, sizeof name);
		list = json_and(list, one_strategy(name, n->strategy[i]));
	}
	return list;
}

void strategy_from_json(const json_t *list, struct canvas_counts *n)
{
	memset(n->strategy, 0, sizeof n->strategy);
	for (size_t i = 0; i < json_array_size(list) && i < BATCH_STRATEGIES; i++) {
		const json_t *o = json_array_get(list, i), *failures = json_object_get(o, "failures");
		for (int k = 0; k < STRATEGY_COUNTERS; k++) {
			json_int_t value =
				json_integer_value(json_object_get(k < STRATEGY_FAIL_FIRST ? o : failures,
								   strategy_counter_name((enum strategy_counter)k)));
			n->strategy[i][k] = value > 0 ? (uint64_t)value : 0;
		}
	}
}
