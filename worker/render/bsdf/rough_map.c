/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/rough_map.h"

/* Returns the mean over the lanes, which differ only for colours that are not images. */
static double eval_alpha(const struct texture *t, const struct bsdf_point *p)
{
	return t->ops ? spectrum_mean(texture_eval(t, &p->texture_point, p->wavelengths)) : t->color.scale;
}

struct microfacet rough_map_eval(const struct rough_map *r, const struct bsdf_point *p)
{
	struct microfacet m;
	double u = eval_alpha(&r->alpha_u, p), v = eval_alpha(&r->alpha_v, p), larger = fmax(u, v);
	microfacet_init(&m, r->narrowest_facets.is_ggx, fmax(u, larger / MICROFACET_RATIO_MAX),
			fmax(v, larger / MICROFACET_RATIO_MAX));
	return m;
}

static int read_alpha(struct texture *t, struct bsdf *b, const struct scene_node *n, const char *name,
		      const struct bsdf_build *build, struct error *e)
{
	const char *source = node_find_property(n, name) ? name : "alpha";
	if (node_ref(n, source))
		return bsdf_read_number(b, t, n, source, 0.1, build, e);
	*t = (struct texture){.color = color_constant(node_float(n, source, 0.1))};
	return 0;
}

static void find_narrowest(struct rough_map *r, const struct bsdf_build *build)
{
	const struct bsdf_probes probes = bsdf_probes_make(build);
	struct microfacet narrowest = {.alpha = INFINITY, .ratio = 1};
	r->max_alpha = 0;
	for (uint32_t i = 0; i < probes.count; i++) {
		const struct bsdf_point probe = bsdf_probe_point(&probes, i);
		struct microfacet m = rough_map_eval(r, &probe);
		if (microfacet_min_alpha(&m) < microfacet_min_alpha(&narrowest))
			narrowest = m;
		r->max_alpha = fmax(r->max_alpha, m.alpha);
	}
	r->narrowest_facets = narrowest;
}

int rough_map_read(struct rough_map *r, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		   struct error *e)
{
	int code = microfacet_read(&r->narrowest_facets, n, e);
	r->is_textured = node_ref(n, "alpha") || node_ref(n, "alpha_u") || node_ref(n, "alpha_v");
	if (!code && r->is_textured)
		code = read_alpha(&r->alpha_u, b, n, "alpha_u", build, e);
	if (!code && r->is_textured)
		code = read_alpha(&r->alpha_v, b, n, "alpha_v", build, e);
	if (code)
		return code;
	if (r->is_textured)
		find_narrowest(r, build);
	b->uses_tangents = r->narrowest_facets.ratio != 1 || node_ref(n, "alpha_u") || node_ref(n, "alpha_v");
	b->min_alpha = microfacet_min_alpha(&r->narrowest_facets);
	b->mean_alpha = microfacet_mean_alpha(&r->narrowest_facets);
	return 0;
}
