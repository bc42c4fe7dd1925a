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
	struct bsdf_point point;
	struct relief_frames outer;
};

/* Returns the shading frame of a part nested in this part, in the coordinates of `frame`. */
static struct frame nested_frame(const void *point, const struct relief *r)
{
	const struct view *v = point;
	struct frame f = v->outer.get_frame(v->outer.context, r);
	return frame_relative_to(&v->frame, &f);
}

static void make_view(const struct bsdf *inner, const struct bsdf_point *p, struct view *v)
{
	static const struct frame identity = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
	bool is_on_surface = p->relief_frames.get_frame != NULL;
	v->outer = p->relief_frames;
	v->frame = is_on_surface ? p->relief_frames.get_frame(p->relief_frames.context, inner->relief) : identity;
	v->point = *p;
	if (is_on_surface && inner->uses_relief_frames)
		v->point.relief_frames = (struct relief_frames){v, nested_frame};
}

static bool is_same_side(vec3 a, vec3 b)
{
	return a.z * b.z > 0;
}

/* Returns the factor that converts f from the inner frame to the outer one; 0 if f is 0. */
static double frame_change_factor(const struct bsdf_point *p, vec3 wo, vec3 wi, vec3 wo_in, vec3 wi_in)
{
	if (!is_same_side(wo, wo_in) || !is_same_side(wi, wi_in))
		return 0;
	double ratio = p->transport == TRANSPORT_RADIANCE ? wi_in.z / wi.z : wo_in.z / wo.z;
	return isfinite(ratio) ? ratio : 0;
}

static spectrum tilted_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	struct view v;
	make_view(inner, p, &v);
	vec3 wo_in = frame_to_local(&v.frame, wo), wi_in = frame_to_local(&v.frame, wi);
	double k = frame_change_factor(p, wo, wi, wo_in, wi_in);
	return k > 0 ? spectrum_scale(k, inner->ops->eval(inner, &v.point, wo_in, wi_in)) : spectrum_constant(0);
}

static double tilted_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	struct view v;
	make_view(inner, p, &v);
	vec3 wo_in = frame_to_local(&v.frame, wo), wi_in = frame_to_local(&v.frame, wi);
	return is_same_side(wo, wo_in) && is_same_side(wi, wi_in) ? inner->ops->pdf_solid(inner, &v.point, wo_in, wi_in)
								  : 0;
}

static bool tilted_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			  struct bsdf_sample *out)
{
	const struct bsdf *inner = b->data;
	struct view v;
	make_view(inner, p, &v);
	vec3 wo_in = frame_to_local(&v.frame, wo);
	if (!is_same_side(wo, wo_in) || !inner->ops->sample(inner, &v.point, wo_in, u, out))
		return false;
	vec3 wi_in = out->wi;
	out->wi = frame_to_world(&v.frame, wi_in);
	double k = frame_change_factor(p, wo, out->wi, wo_in, wi_in);
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
	return part->has_smooth ||
	       (part->has_delta && !(part->is_straight_transmitter && !(part->modes & BSDF_REFLECT)));
}

static const struct bsdf *narrowest_part(const struct bsdf *part, uint32_t count)
{
	const struct bsdf *found = NULL;
	for (uint32_t k = 0; k < count; k++) {
		double width = part[k].has_delta ? 0 : part[k].min_alpha;
		if (needs_normal(&part[k]) && (!found || width < (found->has_delta ? 0 : found->min_alpha)))
			found = &part[k];
	}
	return found;
}

int bsdf_share_relief(struct bsdf *b, struct bsdf *part, uint32_t count, const struct scene_node *n,
		      const struct bsdf_build *build, struct error *e)
{
	for (uint32_t k = 0; k < count; k++)
		if (!part[k].relief)
			part[k].relief = build->base_relief;
	const struct bsdf *first = narrowest_part(part, count);
	b->relief = first ? first->relief : build->base_relief;
	for (uint32_t k = 0; k < count; k++) {
		b->uses_relief_frames |= part[k].uses_relief_frames;
		if (part[k].relief == b->relief || !needs_normal(&part[k]))
			continue;
		if (part[k].has_delta)
			return node_error(n, e, ENOTSUP,
					  "two of its BSDFs, with specular lobes or masked, bend normals "
					  "differently");
		int code = bsdf_wrap(&part[k], &tilted_ops, n, build, e);
		if (code)
			return code;
		b->uses_relief_frames = true;
	}
	return 0;
}
