/*
 * The class of a path (common/film/path_class.h), the same whichever technique makes it: an inner vertex is smooth where it
 * scatters by a delta lobe, or by a BSDF whose mean roughness is below PATH_CLASS_ALPHA. Nothing allocates.
 */
#ifndef WORKER_PATH_CLASSES_H
#define WORKER_PATH_CLASSES_H

#include "worker/path/whole.h"

/* Of what path_connect makes of s vertices of c->light and t of c->camera. */
unsigned path_class_joined(const struct path_context *c, unsigned s, unsigned t);
unsigned path_class_whole(const struct whole_path *x);

/* What one sample carries, by class. */
struct class_sums {
	uint32_t present; /* bit: the class's sum is set */
	spectrum sum[PATH_CLASSES];
};

static inline void class_sums_add(struct class_sums *s, unsigned path_class, spectrum l)
{
	uint32_t bit = UINT32_C(1) << path_class;
	s->sum[path_class] = s->present & bit ? spectrum_add(s->sum[path_class], l) : l;
	s->present |= bit;
}

/* To the sample's classes. */
void class_sums_take(const struct path_context *c, const struct class_sums *s, struct path_sample *out);

#endif
