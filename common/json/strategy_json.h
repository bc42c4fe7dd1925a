/* SPDX-License-Identifier: Apache-2.0 */
/* Counters of strategies as JSON: in the statistics of hslt-render, the coordinator's status and its spool. Any thread.
 */
#ifndef COMMON_JSON_STRATEGY_JSON_H
#define COMMON_JSON_STRATEGY_JSON_H

#include "common/film/canvas.h"

#include <jansson.h>

/* [{"name":"hslt","proposed":900,...,"failures":{"outside":90,...}},...], one object an entry of the mixture; NULL when
 * memory is out. Numbers above 2^63-1 become that. */
json_t *strategy_to_json(const char *mixture, const struct canvas_counts *n);
/* What strategy_to_json wrote. Whatever is missing, negative or of another kind is 0. */
void strategy_from_json(const json_t *list, struct canvas_counts *n);

#endif
