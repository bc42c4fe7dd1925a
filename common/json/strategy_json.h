/* SPDX-License-Identifier: Apache-2.0 */
/* Counters of strategies as JSON: in the statistics of hslt-render, the coordinator's status and its spool. Any thread.
 */
#ifndef COMMON_JSON_STRATEGY_JSON_H
#define COMMON_JSON_STRATEGY_JSON_H

#include "common/film/canvas.h"

#include <jansson.h>

/* [{"name":"hslt","proposed":900,...,"failures":{"outside":90,...}},...], one object per entry of the mixture; NULL:
 * out of memory. Numbers above 2^63-1 become that. */
json_t *strategy_to_json(const char *mixture, const struct canvas_counts *n);
/* Reads what strategy_to_json wrote. Values that are missing, negative or of another type become 0. */
void strategy_from_json(const json_t *list, struct canvas_counts *n);

#endif
