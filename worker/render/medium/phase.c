/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/medium/phase.h"

#include "worker/render/math/frame.h"

#include <string.h>

#define PHASE(name) extern const struct phase_ops phase_ops_##name;
#include "worker/render/medium/phase_list.h"
#undef PHASE

const struct phase_ops *const phase_registry[] = {
#define PHASE(name) &phase_ops_##name,
#include "worker/render/medium/phase_list.h"
#undef PHASE
	NULL,
};

int phase_create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	*p = (struct phase){.ops = phase_registry[0]};
	for (size_t i = 0; n && phase_registry[i]; i++)
		if (strcmp(phase_registry[i]->decl.type, n->type) == 0)
			p->ops = phase_registry[i];
	return p->ops->create ? p->ops->create(p, n, build, e) : 0;
}

double phase_eval(const struct phase *p, vec3 position, vec3 wo, vec3 wi)
{
	return p->ops->eval_flakes ? p->ops->eval_flakes(p, position, wo, wi)
				   : p->ops->eval(p, position, -vec3_dot(wo, wi));
}

vec3 phase_sample(const struct phase *p, vec3 position, vec3 wo, const double u[2], double *pdf)
{
	if (p->ops->sample_flakes) {
		vec3 wi = p->ops->sample_flakes(p, position, wo, u);
		*pdf = p->ops->eval_flakes(p, position, wo, wi);
		return wi;
	}
	struct frame straight = frame_around(vec3_neg(wo));
	double cosine = fmin(fmax(p->ops->sample(p, position, u[0]), -1), 1), phi = 2 * M_PI * u[1];
	double sine = sqrt((1 - cosine) * (1 + cosine));
	*pdf = p->ops->eval(p, position, cosine);
	return frame_to_world(&straight, (vec3){sine * cos(phi), sine * sin(phi), cosine});
}
