#include "worker/path/classes.h"

_Static_assert(PATH_CLASSES <= 32, "a bit a class");

static bool is_smooth(const struct path_vertex *v, bool delta)
{
	return delta || v->bsdf->alpha_mean < PATH_CLASS_ALPHA;
}

unsigned path_class_joined(const struct path_context *c, unsigned s, unsigned t)
{
	enum path_class_kind kind = PATH_NO_VERTEX;
	/* The two ends that are joined scatter by what is not delta. An emitter that was hit does not scatter. */
	for (unsigned i = 1; i + 1 < t; i++)
		kind = path_class_kind_next(kind, is_smooth(&c->camera[i], c->camera[i].delta));
	if (s > 0 && t > 1)
		kind = path_class_kind_next(kind, is_smooth(&c->camera[t - 1], false));
	if (s > 1)
		kind = path_class_kind_next(kind, is_smooth(&c->light[s - 1], false));
	for (unsigned i = s > 2 ? s - 2 : 0; i > 0; i--)
		kind = path_class_kind_next(kind, is_smooth(&c->light[i], c->light[i].delta));
	return path_class(s + t - 1, kind);
}

unsigned path_class_whole(const struct whole_path *x)
{
	enum path_class_kind kind = PATH_NO_VERTEX;
	for (unsigned j = x->edges - 1; j > 0; j--)
		kind = path_class_kind_next(kind, is_smooth(&x->v[j], x->v[j].delta));
	return path_class(x->edges, kind);
}

void class_sums_take(const struct path_context *c, const struct class_sums *s, struct path_sample *out)
{
	out->classes = s->present;
	for (unsigned k = 0; s->present >> k; k++)
		if (s->present >> k & 1)
			out->of_class[k] = path_intensity(c, s->sum[k]);
}
