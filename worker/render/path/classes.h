/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The class of a path (common/film/path_class.h), which is the same whichever technique makes the path. An
 * inner vertex is smooth if it scatters by a delta lobe, or by a BSDF whose mean roughness is below
 * PATH_CLASS_ALPHA. Nothing allocates.
 */
#ifndef WORKER_RENDER_PATH_CLASSES_H
#define WORKER_RENDER_PATH_CLASSES_H

#include "worker/render/path/full_path.h"

#include <string.h>

unsigned full_path_class(const struct full_path *x);

/* Collects the classes of all paths that one pair of sub-paths makes, and the light in each class. */
struct path_classes {
	/* Kinds of the two parts that meet in a connection, each including the joined vertex: camera_kind[t] for the
	 * camera's first t vertices, light_kind[s] for the light's first s. A joined vertex scatters by a lobe that is
	 * not delta. emitter_kind[t] is for camera sub-paths that end at an emitter they hit, or in a medium that
	 * emits; that last vertex does not scatter. */
	unsigned char camera_kind[PATH_EDGES_MAX + 3], emitter_kind[PATH_EDGES_MAX + 3], light_kind[PATH_EDGES_MAX + 3];
	spectrum weights; /* weights that turn a contribution into X + Y + Z */
	struct path_sample *out;
};

/* Starts with c's sub-paths, which have these numbers of vertices. Clears out's classes. */
void path_classes_begin(struct path_classes *k, const struct path_context *c, unsigned camera, unsigned light,
			struct path_sample *out);

/* Returns the class of the path that path_connect made of s vertices of c->light and t of c->camera. passed:
 * the number of surfaces that their joint passes. */
static inline unsigned path_classes_of_joint(const struct path_classes *k, unsigned s, unsigned t, unsigned passed)
{
	enum path_class_kind kind = (enum path_class_kind)(s > 0 ? k->camera_kind[t] : k->emitter_kind[t]);
	for (unsigned i = 0; i < passed; i++)
		kind = path_class_kind_next(kind, true);
	return path_class(s + t - 1 + passed, path_class_kind_join(kind, (enum path_class_kind)k->light_kind[s]));
}

/* Discards all classes that were added, because the sample did not reach the film. */
static inline void path_classes_clear(struct path_sample *out)
{
	out->class_mask = 0;
	memset(out->class_intensity, 0, sizeof out->class_intensity);
}

/* Adds the contribution l of technique s. Call it right after path_connect, which leaves the number
 * of passed surfaces in c. */
static inline void path_classes_add(struct path_classes *k, const struct path_context *c, unsigned s, unsigned t,
				    spectrum l)
{
	unsigned class = path_classes_of_joint(k, s, t, c->passed_count);
	double sum = 0;
	for (int i = 0; i < SPECTRUM_LANES; i++)
		sum += l.v[i] * k->weights.v[i];
	k->out->class_mask |= UINT32_C(1) << class;
	k->out->class_intensity[class] += sum;
}

#endif
