/* SPDX-License-Identifier: Apache-2.0 */
/* Chooses the settings to compare: a default, a reference, and others that differ from the default in one value. One
 * thread. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_DESIGN_H
#define WORKER_CLI_ACCURACY_ACCURACY_DESIGN_H

#include "common/base/error.h"
#include "common/plan/plan.h"
#include "worker/render/render.h"

enum { ACCURACY_SETTINGS_MAX = 96, ACCURACY_SWEEPS_MAX = 24, ACCURACY_VALUES_MAX = 12 };

/* How much longer the reference is rendered than each other setting. */
#define ACCURACY_REFERENCE_SHARE 4.0

struct accuracy_setting {
	char parameter[32], value[48]; /* what differs from the default; "default" or "reference", with no value */
	double time_share;	       /* of the time, relative to the others' shares */
	bool changes_image;	       /* the setting is known to change the image, if only by little */
	uint32_t max_depth;
	char accuracy[PLAN_ACCURACY_MAX], mixture[PLAN_MUTATIONS_MAX]; /* canonical, for the plan */
};

/* The values of one parameter in order, the default's among them. */
struct accuracy_sweep {
	char parameter[32];
	const char *summary;
	size_t count;
	size_t setting_indices[ACCURACY_VALUES_MAX]; /* [count]: index of the setting with this value */
	char values[ACCURACY_VALUES_MAX][48];	     /* [count] */
};

/* A parameter that is not varied, with the reason. */
struct accuracy_skipped {
	char parameter[32], reason[160];
};

struct accuracy_design {
	size_t count, sweep_count, skipped_count;
	struct accuracy_setting settings[ACCURACY_SETTINGS_MAX];
	struct accuracy_sweep sweeps[ACCURACY_SWEEPS_MAX];
	struct accuracy_skipped skipped[ACCURACY_SWEEPS_MAX];
};

/* Indices of the first two settings. The reference has accurate values and is rendered longer. */
enum { ACCURACY_DEFAULT, ACCURACY_REFERENCE };

/* Makes the design for a scene. base: complete; its settings are the default. parameters: those to vary, as
 * "NAME,NAME"; NULL: all. Returns -EINVAL with a sentence if one of them does not exist. */
int accuracy_make_design(struct accuracy_design *d, const struct plan_request *base, const struct render_summary *scene,
			 const char *parameters, struct error *e);

/* Writes the name of a setting, such as "tolerance 0.01" or "default". */
void accuracy_setting_name(const struct accuracy_setting *s, char *text, size_t size);

#endif
