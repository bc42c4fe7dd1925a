/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The class of a path (common/film/path_class.h), the same whichever technique makes it: an inner vertex is smooth
 * where it scatters by a delta lobe, or by a BSDF whose mean roughness is below PATH_CLASS_ALPHA. Nothing allocates.
 */
#ifndef WORKER_RENDER_PATH_CLASSES_H
#define WORKER_RENDER_PATH_CLASSES_H

#include "worker/render/path/full_path.h"

#include <string.h>

unsigned path_class_whole(const struct full_path *x);

/* Classes of all paths that one pair of sub-paths makes, and what these carry. */
struct classes {
	/* Kinds of the parts that meet in a connection, the two that it joins included: the camera's first t vertices,
	 * the light's first s. Joined ends scatter there by what is not delta. emitter: the camera's, where the last of
	 * the t is an emitter that was hit and does not scatter, or in a medium that shines. */
	unsigned char camera[PATH_MAX_EDGES + 3], emitter[PATH_MAX_EDGES + 3], light[PATH_MAX_EDGES + 3];
	spectrum weights; /* X + Y + Z of a contribution */
	struct path_sample *out;
};

/* Begins with c's sub-paths of these numbers of vertices. Empties out's classes. */
void classes_begin(struct classes *k, const struct path_context *c, unsigned camera, unsigned light,
		   struct path_sample *out);

/* The class of the path that path_connect made of s vertices of c->light and t of c->camera. passed: how many surfaces
 * their joint passes. */
static inline unsigned classes_joined(const struct classes *k, unsigned s, unsigned t, unsigned passed)
{
	enum path_class_kind kind = (enum path_class_kind)(s > 0 ? k->camera[t] : k->emitter[t]);
	for (unsigned i = 0; i < passed; i++)
		kind = path_class_kind_next(kind, true);
	return path_class(s + t - 1 + passed, path_class_kind_join(kind, (enum path_class_kind)k->light[s]));
}

/* What was added until now did not reach the film. */
static inline void classes_clear(struct path_sample *out)
{
	out->classes = 0;
	memset(out->of_class, 0, sizeof out->of_class);
}

/* Technique s contributes l. Call right after path_connect, which leaves in c how many surfaces the joint passes. */
static inline void classes_add(struct classes *k, const struct path_context *c, unsigned s, unsigned t, spectrum l)
{
	unsigned class = classes_joined(k, s, t, c->passed_count);
	double sum = 0;
	for (int i = 0; i < SPECTRUM_LANES; i++)
		sum += l.v[i] * k->weights.v[i];
	k->out->classes |= UINT32_C(1) << class;
	k->out->of_class[class] += sum;
}

#endif
