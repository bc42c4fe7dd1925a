/* SPDX-License-Identifier: Apache-2.0 */
/* Looks and forecasts as JSON, for the status, the spool and statistics. Pure but for memory; any thread. */
#ifndef COMMON_JSON_FORECAST_JSON_H
#define COMMON_JSON_FORECAST_JSON_H

#include "common/estimate/forecast.h"

#include <jansson.h>

json_t *forecast_real(double x);				/* null where it is not finite */
json_t *forecast_range_to_json(const struct forecast_range *r); /* {low, expected, high} */
json_t *forecast_looks_to_json(const struct forecast_history *h);
/* What is no look is passed over. */
void forecast_looks_from_json(const json_t *list, struct forecast_history *h);

#endif
