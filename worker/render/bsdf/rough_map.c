/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/rough_map.h"

/* Returns the mean over the lanes, which differ only for colours that are not images. */
static double alpha_of(const struct texture *t, const struct bsdf_point *p)
{
	return t->ops ? spectrum_mean(texture_eval(t, &p->where, p->w)) : t->color.scale;
}

struct microfacet rough_map_look_up(const struct rough_map *r, const struct bsdf_point *p)
{
	struct microfacet m;
	double u = alpha_of(&r->u, p), v = alpha_of(&r->v, p), larger = fmax(u, v);
	microfacet_set(&m, r->fixed.ggx, fmax(u, larger / MICROFACET_RATIO_MAX),
		       fmax(v, larger / MICROFACET_RATIO_MAX));
	return m;
}

static int read_one(struct texture *t, struct bsdf *b, const struct scene_node *n, const char *name,
		    const struct bsdf_build *build, struct error *e)
{
	const char *where = node_find(n, name) ? name : "alpha";
	if (node_ref(n, where))
		return bsdf_number(b, t, n, where, 0.1, build, e);
	*t = (struct texture){.color = color_constant(node_float(n, where, 0.1))};
	return 0;
}

static void find_least(struct rough_map *r, const struct bsdf_build *build)
{
	const struct bsdf_probes probes = bsdf_probes_of(build);
	struct microfacet least = {.alpha = INFINITY, .ratio = 1};
	r->most = 0;
	for (uint32_t i = 0; i < probes.count; i++) {
		const struct bsdf_point at = bsdf_probe(&probes, i);
		struct microfacet m = rough_map_look_up(r, &at);
		if (microfacet_least(&m) < microfacet_least(&least))
			least = m;
		r->most = fmax(r->most, m.alpha);
	}
	r->fixed = least;
}

int rough_map_read(struct rough_map *r, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		   struct error *e)
{
	int code = microfacet_read(&r->fixed, n, e);
	r->varies = node_ref(n, "alpha") || node_ref(n, "alpha_u") || node_ref(n, "alpha_v");
	if (!code && r->varies)
		code = read_one(&r->u, b, n, "alpha_u", build, e);
	if (!code && r->varies)
		code = read_one(&r->v, b, n, "alpha_v", build, e);
	if (code)
		return code;
	if (r->varies)
		find_least(r, build);
	b->uses_tangents = r->fixed.ratio != 1 || node_ref(n, "alpha_u") || node_ref(n, "alpha_v");
	b->alpha = microfacet_least(&r->fixed);
	b->alpha_mean = microfacet_mean(&r->fixed);
	return 0;
}
