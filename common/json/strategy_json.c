/* SPDX-License-Identifier: Apache-2.0 */
#include "common/json/strategy_json.h"

#include "common/estimate/strategy.h"

#include <string.h>

static json_t *integer(uint64_t n)
{
	return json_integer(n > INT64_MAX ? INT64_MAX : (json_int_t)n);
}

json_t *strategy_to_json(const char *mixture, const struct canvas_counts *n)
{
	json_t *list = json_array();
	int count = plan_strategy_count(mixture);
	for (int i = 0; i < count; i++) {
		char name[PLAN_MUTATIONS_MAX];
		json_t *o = json_object(), *failures = json_object();
		plan_strategy_name(mixture, (uint32_t)i, name, sizeof name);
		json_object_set_new(o, "name", json_string(name));
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			json_object_set_new(k < STRATEGY_FAIL_FIRST ? o : failures,
					    strategy_counter_name((enum strategy_counter)k),
					    integer(n->strategy[i][k]));
		json_object_set_new(o, "failures", failures);
		json_array_append_new(list, o);
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
