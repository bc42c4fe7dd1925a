/* SPDX-License-Identifier: Apache-2.0 */
/* Agreement of chains and energies of classes as JSON: in the statistics of hslt-render, the status, the spool. Any
 * thread. */
#ifndef COMMON_JSON_CONVERGENCE_JSON_H
#define COMMON_JSON_CONVERGENCE_JSON_H

#include "common/estimate/convergence.h"

#include <jansson.h>

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

#endif
