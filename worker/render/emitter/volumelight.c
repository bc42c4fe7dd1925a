/* SPDX-License-Identifier: Apache-2.0 */
/* The medium inside its shape shines: worker/render/medium/emission.h. */
#include "worker/render/emitter/emitter.h"

static const struct param params[] = {
	{"radiance", VALUE_VOLUME, PARAM_UNDERSTOOD, 0, PARAM_LIGHT_MAX, NULL},
	{"sampling_weight", IGNORED},
	{NULL, 0, 0, 0, 0, NULL},
};

const struct emitter_ops emitter_ops_volumelight = {
	.decl = {PLUGIN_EMITTER, "volumelight", params, 0, PARAM_UNDERSTOOD},
	.needs_surface = true,
	.in_medium = true,
};
