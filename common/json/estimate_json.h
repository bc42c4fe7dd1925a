/* SPDX-License-Identifier: Apache-2.0 */
/* Estimates of a render as JSON: errors and forecasts, agreement of chains, energies of path classes, counters of
 * strategies. Used by the statistics of hslt-render, the status socket and the spool. Any thread. */
#ifndef COMMON_JSON_ESTIMATE_JSON_H
#define COMMON_JSON_ESTIMATE_JSON_H

#include "common/estimate/convergence.h"
#include "common/estimate/forecast.h"
#include "common/film/canvas.h"

#include <jansson.h>

json_t *json_real_or_null(double x);				/* JSON null if x is not finite */
json_t *forecast_range_to_json(const struct forecast_range *r); /* {"low":..., "expected":..., "high":...} */
/* [{"mutations":..., "cpuSeconds":..., "wallSeconds":..., "relMSE":..., "relMSEUpper":..., "degrees":...,
 * "doubtful":false}, ...] */
json_t *forecast_looks_to_json(const struct forecast_history *h);
/* Replaces the looks of h. Elements from which no valid look can be read are skipped. */
void forecast_looks_from_json(const json_t *list, struct forecast_history *h);

/* {"verdict":"disagree","text":...,"rHatMedian":1.01,"rHatWorst":2.4,"worst":[64,0],"tiles":12,"tilesFlagged":3,
 * "energyFlagged":0.04,"stuckShare":0,"classesFlagged":["caustic, 3-4 edges"],"classesApart":[]}; unknown values are
 * null. Returns NULL if memory is out. */
json_t *convergence_to_json(const struct convergence *a);
/* A value that is missing or of another type becomes 0 or unknown. */
void convergence_from_json(const json_t *o, struct convergence *a);

/* [{"class":"caustic, 3-4 edges","bootstrap":0.2,"bootstrapError":...,"chains":...,"chainsError":...,"t":-1.2},...] for
 * the classes that have energy; energies are shares of b. */
json_t *classes_to_json(const struct path_class_energy classes[PATH_CLASSES]);
void classes_from_json(const json_t *list, struct path_class_energy classes[PATH_CLASSES]);

/* [{"name":"hslt","proposed":900,...,"failures":{"outside":90,...}},...], one object per entry of the mixture. Numbers
 * above 2^63-1 become 2^63-1. Returns NULL if memory is out. */
json_t *strategy_to_json(const char *mixture, const struct canvas_counts *n);
/* Reads what strategy_to_json wrote. Values that are missing, negative or of another type become 0. */
void strategy_from_json(const json_t *list, struct canvas_counts *n);

#endif
