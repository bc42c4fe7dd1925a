/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A BSDF in a shading frame that is rotated relative to that of the surface. With wo' and wi' the directions in that
 * frame, light is scattered by f(wo', wi') |wi'.z|, as if the surface had the frame's normal; in the surface's frame f
 * is this value over |wi.z|. It is not reciprocal. Importance is radiance with the directions exchanged, so its cosines
 * are those of wo. f is 0 if a direction is on different sides in the two frames. Densities are per solid angle, which
 * rotation preserves. There is no eval_halfvec, since the lobe is not centred on half vectors of the surface.
 */
#include "worker/render/bsdf/tilted.h"

#include "worker/render/bsdf/create.h"

/* The point and the frame that a part with its own relief sees. */
struct view {
	struct frame frame;
	struct bsdf_point p;
	struct relief_place outer;
};

/* Returns the shading frame of a part nested in this part, in the coordinates of `frame`. */
static struct frame frame_inside(const void *point, const struct relief *r)
{
	const struct view *v = point;
	struct frame f = v->outer.frame(v->outer.point, r);
	return frame_within(&v->frame, &f);
}

static void find_view(const struct bsdf *inner, const struct bsdf_point *p, struct view *v)
{
	static const struct frame same = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
	bool surface = p->place.frame != NULL;
	v->outer = p->place;
	v->frame = surface ? p->place.frame(p->place.point, inner->relief) : same;
	v->p = *p;
	if (surface && inner->uses_place)
		v->p.place = (struct relief_place){v, frame_inside};
}

static bool same_side(vec3 a, vec3 b)
{
	return a.z * b.z > 0;
}

/* Returns the factor that converts f from the inner frame to the outer one; 0 if f is 0. */
static double factor(const struct bsdf_point *p, vec3 wo, vec3 wi, vec3 wo_in, vec3 wi_in)
{
	if (!same_side(wo, wo_in) || !same_side(wi, wi_in))
		return 0;
	double ratio = p->transport == TRANSPORT_RADIANCE ? wi_in.z / wi.z : wo_in.z / wo.z;
	return isfinite(ratio) ? ratio : 0;
}

static spectrum tilted_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	struct view v;
	find_view(inner, p, &v);
	vec3 wo_in = frame_to_local(&v.frame, wo), wi_in = frame_to_local(&v.frame, wi);
	double k = factor(p, wo, wi, wo_in, wi_in);
	return k > 0 ? spectrum_scale(k, inner->ops->eval(inner, &v.p, wo_in, wi_in)) : spectrum_of(0);
}

static double tilted_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	struct view v;
	find_view(inner, p, &v);
	vec3 wo_in = frame_to_local(&v.frame, wo), wi_in = frame_to_local(&v.frame, wi);
	return same_side(wo, wo_in) && same_side(wi, wi_in) ? inner->ops->pdf_solid(inner, &v.p, wo_in, wi_in) : 0;
}

static bool tilted_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			  struct bsdf_sample *out)
{
	const struct bsdf *inner = b->data;
	struct view v;
	find_view(inner, p, &v);
	vec3 wo_in = frame_to_local(&v.frame, wo);
	if (!same_side(wo, wo_in) || !inner->ops->sample(inner, &v.p, wo_in, u, out))
		return false;
	vec3 wi_in = out->wi;
	out->wi = frame_to_world(&v.frame, wi_in);
	double k = factor(p, wo, out->wi, wo_in, wi_in);
	out->f = spectrum_scale(k, out->f);
	return k > 0;
}

static const struct bsdf_ops tilted_ops = {
	.decl.type = "tilted",
	.eval = tilted_eval,
	.pdf_solid = tilted_pdf,
	.sample = tilted_sample,
};

/* Returns whether a part depends on the shading normal: light that passes straight through does not. */
static bool needs_normal(const struct bsdf *part)
{
	return part->has_smooth || (part->has_delta && !(part->only_straight && !(part->modes & BSDF_REFLECT)));
}

static const struct bsdf *narrowest_part(const struct bsdf *part, uint32_t count)
{
	const struct bsdf *found = NULL;
	for (uint32_t k = 0; k < count; k++) {
		double width = part[k].has_delta ? 0 : part[k].alpha;
		if (needs_normal(&part[k]) && (!found || width < (found->has_delta ? 0 : found->alpha)))
			found = &part[k];
	}
	return found;
}

int bsdf_share_relief(struct bsdf *b, struct bsdf *part, uint32_t count, const struct scene_node *n,
		      const struct bsdf_build *build, struct error *e)
{
	const struct bsdf *first = narrowest_part(part, count);
	b->relief = first ? first->relief : NULL;
	for (uint32_t k = 0; k < count; k++) {
		b->uses_place |= part[k].uses_place;
		if (part[k].relief == b->relief || !needs_normal(&part[k]))
			continue;
		if (part[k].has_delta)
			return node_error(n, e, ENOTSUP,
					  "two of its BSDFs, with specular lobes or masked, bend normals "
					  "differently");
		int code = bsdf_wrap(&part[k], &tilted_ops, n, build, e);
		if (code)
			return code;
		b->uses_place = true;
	}
	return 0;
}
