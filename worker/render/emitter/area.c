/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A surface with the same radiance in all directions on the side of its normal, or on both sides (two_sided). Points on
 * meshes are sampled uniformly per area. So are points on spheres for light sub-paths; next event estimation from
 * outside a sphere samples uniformly over the cone that it subtends (Shirley, Wang, Zimmerman 1996, sec. 4.1.1), whose
 * angle is computed from its sine to keep its precision for distant spheres.
 *
 * If both sides emit, the side of a light sub-path is random. A closed surface is mostly seen from outside, so few
 * sub-paths start on its inside, unless it is so large that it may be a dome around the scene. The probability only
 * affects the variance.
 */
#include "worker/render/emitter/surface_light.h"

struct area_light {
	struct surface_light light; /* first: surface_light.h */
	double back_probability;    /* probability that a sub-path leaves against the normal; 0: one-sided */
};

/* Returns whether the surface encloses a body: the normals of its triangles, weighted by area, then add up to 0. */
static bool is_closed(const struct surface_light *l)
{
	vec3 sum = {0, 0, 0};
	if (l->surface.is_sphere)
		return true;
	for (uint32_t i = 0; i < l->surface.triangle_count; i++)
		sum = vec3_add(sum, surface_light_normal(l, i));
	return vec3_length(sum) < 1e-3 * l->area;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct area_light *l = em->data;
	int rc = surface_light_create(em, n, build, e);
	if (rc)
		return rc;
	bool is_two_sided = node_bool(n, "two_sided", node_bool(n, "twosided", false));
	/* The scene's radius is 1; a sphere of half that radius has an area of pi. */
	l->back_probability = !is_two_sided ? 0 : is_closed(&l->light) && l->light.area < M_PI ? 0.0625 : 0.5;
	em->power = l->light.area * M_PI * em->brightness_bound * (is_two_sided ? 2 : 1);
	return 0;
}

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	const struct area_light *l = em->data;
	double cosine = vec3_dot(x->n, w);
	if (!(cosine > 0 || (l->back_probability > 0 && cosine < 0)))
		return spectrum_constant(0);
	return texture_eval(&l->light.radiance, &x->texture_point, wl);
}

static bool sample_direction(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
			     double *pdf)
{
	const struct area_light *l = em->data;
	struct frame f = frame_around(x->n);
	bool behind = u[0] < l->back_probability;
	double share = behind ? l->back_probability : 1 - l->back_probability,
	       rest = behind ? u[0] / share : (u[0] - l->back_probability) / share;
	double r = sqrt(rest), phi = 2 * M_PI * u[1], z = sqrt(1 - rest);
	*w = frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), behind ? -z : z});
	*pdf = share * z / M_PI;
	return z > 0;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	const struct area_light *l = em->data;
	double cosine = vec3_dot(x->n, w);
	return (cosine > 0 ? (1 - l->back_probability) * cosine : -l->back_probability * cosine) / M_PI;
}

/* Computes the cone that the sphere subtends at ref: its axis, the distance of the centre, and the squared sine of its
 * half angle. Returns false if the light is not a sphere that emits outwards, or ref is inside it. */
static bool find_sphere_cone(const struct surface_light *l, vec3 ref, vec3 *axis, double *distance, double *sin2)
{
	vec3 to_center = vec3_sub(l->surface.center, ref);
	double d = vec3_length(to_center), r = l->surface.radius;
	if (!l->surface.is_sphere || l->surface.normal_sign < 0 || !(d > r * (1 + 0x1p-40)))
		return false;
	*axis = vec3_scale(1 / d, to_center);
	*distance = d;
	*sin2 = (r / d) * (r / d);
	return true;
}

static double cone_solid_angle(double sin2)
{
	return 2 * M_PI * sin2 / (1 + sqrt(1 - sin2)); /* 2 pi (1 - cos) without cancellation */
}

static double sphere_pdf_area(vec3 ref, double sin2, const struct emitter_point *x)
{
	vec3 d = vec3_sub(x->p, ref);
	double l2 = vec3_dot(d, d);
	if (!(l2 > 0))
		return 0;
	double cosine = -vec3_dot(d, x->n) / sqrt(l2);
	return cosine > 0 ? cosine / (l2 * cone_solid_angle(sin2)) : 0;
}

static bool sample_toward(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x, double *pdf)
{
	const struct surface_light *l = em->data;
	vec3 axis;
	double distance, sin2;
	if (!find_sphere_cone(l, ref, &axis, &distance, &sin2))
		return surface_light_sample_point(em, u, x, pdf);
	/* q = 1 - cos(theta), with theta the angle of the direction to the axis; t: distance of the nearer
	 * intersection. */
	double q = u[0] * sin2 / (1 + sqrt(1 - sin2)), s2 = q * (2 - q), c = 1 - q, r = l->surface.radius;
	double t = distance * c - sqrt(fmax(r * r - distance * distance * s2, 0));
	double phi = 2 * M_PI * u[1], s = sqrt(s2);
	struct frame f = frame_around(axis);
	vec3 w = frame_to_world(&f, (vec3){s * cos(phi), s * sin(phi), c});
	vec3 p = vec3_madd(ref, t, w);
	x->is_infinite = false;
	vec3 from_center = vec3_sub(p, l->surface.center);
	/* A sphere so distant that it rounds to a point: use the point nearest to ref. */
	surface_light_set_sphere_point(l, vec3_length(from_center) > 0 ? vec3_normalize(from_center) : vec3_neg(axis),
				       x);
	*pdf = sphere_pdf_area(ref, sin2, x);
	return *pdf > 0;
}

static double pdf_toward(const struct emitter *em, vec3 ref, const struct emitter_point *x)
{
	const struct surface_light *l = em->data;
	vec3 axis;
	double distance, sin2;
	if (!find_sphere_cone(l, ref, &axis, &distance, &sin2))
		return surface_light_pdf_point(em, x);
	return sphere_pdf_area(ref, sin2, x);
}

const struct emitter_ops emitter_ops_area = {
	.decl = PLUGIN(EMITTER, "area", {.name = "radiance", .types = VALUE_TEXTURE, .max = PARAM_LIGHT_MAX},
		       {.name = "two_sided", .types = VALUE_BOOL},
		       {.name = "twosided", .types = VALUE_BOOL}, /* Mitsuba 3's name of two_sided */
		       {.name = "sampling_weight", .types = VALUE_FLOAT, .status = PARAM_IGNORED}),
	SURFACE_LIGHT_OPS,
	.data_size = sizeof(struct area_light),
	.create = create,
	.radiance = radiance,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.sample_toward = sample_toward,
	.pdf_toward = pdf_toward,
	.set_transform = surface_light_set_transform,
};
