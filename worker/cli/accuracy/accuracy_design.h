/* SPDX-License-Identifier: Apache-2.0 */
/* Which settings are compared: a default, and others of which one value differs. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_DESIGN_H
#define WORKER_CLI_ACCURACY_ACCURACY_DESIGN_H

#include "common/base/error.h"
#include "common/plan/plan.h"
#include "worker/render/render.h"

enum { ACCURACY_SETTINGS = 96, ACCURACY_SWEEPS = 24, ACCURACY_VALUES = 12 };

/* How much longer the reference is rendered than each other setting. */
#define ACCURACY_REFERENCE_SHARE 4.0

struct accuracy_setting {
	char parameter[32], value[48]; /* "default" and "reference" are settings without a value */
	double share;		       /* share of the time, relative to the others' */
	bool other_image;	       /* known to make another image, however small the difference */
	uint32_t max_depth;
	char accuracy[PLAN_ACCURACY_MAX], mixture[PLAN_MUTATIONS_MAX];
};

struct accuracy_sweep { /* of one parameter, in order, with the default's value among them */
	char parameter[32];
	const char *summary;
	size_t count, setting[ACCURACY_VALUES];
	char value[ACCURACY_VALUES][48];
};

struct accuracy_left_out {
	char parameter[32], why[160];
};

struct accuracy_design {
	size_t count, sweep_count, left_out_count;
	struct accuracy_setting settings[ACCURACY_SETTINGS]; /* the first is the default, the second the reference:
								careful, and longer */
	struct accuracy_sweep sweeps[ACCURACY_SWEEPS];
	struct accuracy_left_out left_out[ACCURACY_SWEEPS];
};
enum { ACCURACY_DEFAULT, ACCURACY_REFERENCE };

/* Around the request's settings, as suits the scene. only: NAME,NAME: the sweeps to make; NULL: all. -EINVAL with a
 * sentence: unknown parameter. */
int accuracy_design(struct accuracy_design *d, const struct plan_request *base, const struct render_summary *scene,
		    const char *only, struct error *e);

/* "tolerance 0.01", "default". */
void accuracy_name(const struct accuracy_setting *s, char *text, size_t size);

#endif
