/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The path tracer: at each vertex of a camera sub-path, next event estimation and the emitter that the sub-path
 * hits are weighted against each other by the balance heuristic (Veach 1997, sec. 9.2.4). It is the reference
 * for all other integrators.
 */
#include "worker/render/path/integrate_path.h"

#include "worker/render/path/classes.h"
#include "worker/render/path/connect.h"
#include "worker/render/path/volume_emission.h"
#include "worker/render/path/integrator.h"

void path_trace(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	double film[2];
	struct path_classes classes;
	out->splat_count = 0;
	out->class_mask = 0;
	out->intensity = 0;
	c->is_unidirectional = true;
	unsigned n = path_walk_camera(c, s, c->max_depth + 1, film);
	spectrum sum = spectrum_constant(0);
	if (!c->skips_classes)
		path_classes_begin(&classes, c, n, 0, out);
	if (EFFECT_IS_ON(c->w, medium_light))
		sum = volume_emission(c, c->min_depth, c->max_depth, c->skips_classes ? NULL : &classes);
	for (unsigned t = 2; t <= n; t++) {
		for (unsigned j = 0; j <= 1; j++) {
			if (!path_may_connect(c, j, t))
				continue;
			spectrum l = path_connect(c, j, t, 1, film);
			if (!path_accept(c, l))
				continue;
			sum = spectrum_add(sum, l);
			if (!c->skips_classes)
				path_classes_add(&classes, c, j, t, l);
		}
	}
	if (!path_sample_add_splat(c, out, film[0], film[1], sum) && out->class_mask)
		path_classes_clear(out);
}

const struct integrator integrator_path = {
	.properties = {.name = "path", .kind = PLAN_SAMPLES, .max_depth = PATH_EDGES_MAX, .is_camera_only = true},
	.stream = RNG_PATH,
	.evaluate = path_trace,
};
