/* SPDX-License-Identifier: Apache-2.0 */
/* Estimates of the error ("looks") and forecasts as JSON, for the status, the spool and statistics. Pure except for
 * memory; any thread. */
#ifndef COMMON_JSON_FORECAST_JSON_H
#define COMMON_JSON_FORECAST_JSON_H

#include "common/estimate/forecast.h"

#include <jansson.h>

json_t *forecast_real(double x);				/* null if it is not finite */
json_t *forecast_range_to_json(const struct forecast_range *r); /* {low, expected, high} */
json_t *forecast_looks_to_json(const struct forecast_history *h);
/* Ignores elements that are not looks. */
void forecast_looks_from_json(const json_t *list, struct forecast_history *h);

#endif
