/* SPDX-License-Identifier: Apache-2.0 */
/* Makes the medium inside its shape emit light: worker/render/medium/emission.h. */
#include "worker/render/emitter/emitter.h"

const struct emitter_ops emitter_ops_volumelight = {
	.decl = PLUGIN(EMITTER, "volumelight", {"radiance", VALUE_VOLUME, PARAM_UNDERSTOOD, 0, PARAM_LIGHT_MAX, NULL},
		       {"sampling_weight", IGNORED}),
	.needs_surface = true,
	.is_volumetric = true,
};
