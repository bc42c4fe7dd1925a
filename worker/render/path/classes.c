/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/classes.h"

_Static_assert(PATH_CLASSES <= 32, "a bit a class");

static bool is_smooth(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->bsdf->mean_alpha < PATH_CLASS_ALPHA;
}

unsigned full_path_class(const struct full_path *x)
{
	enum path_class_kind kind = PATH_NO_VERTEX;
	for (unsigned j = x->edges - 1; j > 0; j--)
		kind = path_class_kind_next(kind, x->v[j].is_delta || is_smooth(&x->v[j]));
	return path_class(x->edges, kind);
}

void path_classes_begin(struct path_classes *k, const struct path_context *c, unsigned camera, unsigned light,
			struct path_sample *out)
{
	k->out = out;
	path_classes_clear(out);
	if (c->wl.is_grey)
		k->weights = (spectrum){{c->w->grey_xyz[0] + c->w->grey_xyz[1] + c->w->grey_xyz[2]}};
	else
		k->weights = spectrum_intensity_weights(&c->wl);
	enum path_class_kind kind = PATH_NO_VERTEX;
	k->camera_kind[1] = k->emitter_kind[1] = k->light_kind[0] = k->light_kind[1] = PATH_NO_VERTEX;
	for (unsigned i = 1; i < camera; i++) {
		const struct path_vertex *v = &c->camera[i];
		k->emitter_kind[i + 1] = (unsigned char)kind;
		if (v->kind == VERTEX_INFINITE)
			break;
		bool smooth = is_smooth(v);
		k->camera_kind[i + 1] = (unsigned char)path_class_kind_next(kind, smooth);
		kind = path_class_kind_next(kind, v->is_delta || smooth);
	}
	k->emitter_kind[camera + 1] = (unsigned char)kind;
	kind = PATH_NO_VERTEX;
	for (unsigned i = 1; i < light; i++) {
		const struct path_vertex *v = &c->light[i];
		bool smooth = is_smooth(v);
		k->light_kind[i + 1] = (unsigned char)path_class_kind_join(smooth ? PATH_SMOOTH : PATH_ROUGH, kind);
		kind = path_class_kind_join(v->is_delta || smooth ? PATH_SMOOTH : PATH_ROUGH, kind);
	}
}
