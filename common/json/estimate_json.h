/* SPDX-License-Identifier: Apache-2.0 */
/* What is estimated of a render as JSON: errors and forecasts, agreement of chains, energies of classes, counters of
 * strategies; in the statistics of hslt-render, the status and the spool. Pure except for memory; any thread. */
#ifndef COMMON_JSON_ESTIMATE_JSON_H
#define COMMON_JSON_ESTIMATE_JSON_H

#include "common/estimate/convergence.h"
#include "common/estimate/forecast.h"
#include "common/film/canvas.h"

#include <jansson.h>

json_t *forecast_real(double x);				/* null if it is not finite */
json_t *forecast_range_to_json(const struct forecast_range *r); /* {low, expected, high} */
json_t *forecast_looks_to_json(const struct forecast_history *h);
/* Ignores elements that are not looks. */
void forecast_looks_from_json(const json_t *list, struct forecast_history *h);

/* {"verdict":"disagree","text":...,"rHatMedian":1.01,"rHatWorst":2.4,"worst":[64,0],"tiles":12,"tilesFlagged":3,
 * "energyFlagged":0.04,"stuckShare":0,"classesFlagged":["caustic, 3-4 edges"],"classesApart":[]}; unknown values are
 * null. NULL: out of memory. */
json_t *convergence_to_json(const struct convergence *a);
/* A value that is missing or of another type becomes 0, or unknown. */
void convergence_from_json(const json_t *o, struct convergence *a);

/* [{"class":"caustic, 3-4 edges","bootstrap":0.2,"bootstrapError":...,"chains":...,"chainsError":...,"t":-1.2},...]:
 * the classes that have energy, in units of b. */
json_t *classes_to_json(const struct path_class_energy classes[PATH_CLASSES]);
void classes_from_json(const json_t *list, struct path_class_energy classes[PATH_CLASSES]);

/* [{"name":"hslt","proposed":900,...,"failures":{"outside":90,...}},...], one object per entry of the mixture; NULL:
 * out of memory. Numbers above 2^63-1 become that. */
json_t *strategy_to_json(const char *mixture, const struct canvas_counts *n);
/* Reads what strategy_to_json wrote. Values that are missing, negative or of another type become 0. */
void strategy_from_json(const json_t *list, struct canvas_counts *n);

#endif
