/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light that leaves a surface along its normal, with `radiance` as the power per area. An exactly parallel beam could
 * only be traced from the light; this beam diverges by BEAM_HALF_ANGLE, like that of a laser pointer, so that every
 * integrator and mutation can treat it like other emitters. Its edge is blurred by a thousandth of the distance.
 *
 * At a point x with normal n, with rho = sin(angle between w and n) / sin(BEAM_HALF_ANGLE) < 1:
 *
 *   L(x, w) = M 2 (1 - rho^2) / (pi sin^2 BEAM_HALF_ANGLE),   the integral of L cos over w is M,
 *
 * and directions are sampled in proportion to L cos. L falls to 0 at the edge, so that the rounding of a direction that
 * is computed again from two points changes the light only slightly.
 *
 * Next event estimation from a point needs the part of the surface that shines at it: on a plane, a disc around the
 * point's projection, of radius distance times tan BEAM_HALF_ANGLE; on a sphere, a cap around the nearest point. On
 * other surfaces this part is not searched for, and paths have to start at the light.
 *
 * Sampling fails for a point behind the plane or inside the sphere, and if the sampled position is not on the shape.
 */
#include "worker/render/emitter/surface_light.h"

/* Half the opening angle of the beam, in radians. */
#define BEAM_HALF_ANGLE 1e-3

/* The distance by which corners may be off a plane because of rounding, as a share of its extent. All triangles shine
 * along the normal of the plane, since the normal of a thin triangle with rounded corners may differ by more than
 * BEAM_HALF_ANGLE. */
#define PLANE_TOLERANCE 1e-5

/* The searched part of a surface is larger than the shining part by this factor, because of rounding. */
#define SEARCH_MARGIN 1.02

enum { PLANE_TRIANGLES_MAX = 256 };

struct directional_area {
	struct surface_light light;
	bool is_plane;
	vec3 origin, n;	     /* a point of the plane, and its unit normal */
	double plane_offset; /* largest distance of a corner from the plane */
	vec3 local_axes[3];  /* of a mesh that moves, in its own coordinates: a frame around n, right-handed when the
			shutter opens */
};

/* Sets is_plane if all triangles lie in one plane, perpendicular to the sum of their normals, and face the same
 * side. */
static void find_plane(struct directional_area *b)
{
	const struct surface_light *l = &b->light;
	uint32_t count = l->surface.triangle_count;
	if (l->surface.is_sphere || count > PLANE_TRIANGLES_MAX)
		return;
	vec3 sum = {0, 0, 0};
	for (uint32_t i = 0; i < count; i++)
		sum = vec3_add(sum, surface_light_normal(l, i));
	if (!(vec3_length(sum) > 0))
		return;
	b->n = vec3_normalize(sum);
	b->origin = surface_light_corner(l, 0, 0);
	double extent = 0;
	for (uint32_t i = 0; i < count; i++) {
		if (!(vec3_dot(surface_light_normal(l, i), b->n) >= 0))
			return;
		for (int k = 0; k < 3; k++) {
			vec3 d = vec3_sub(surface_light_corner(l, i, k), b->origin);
			b->plane_offset = fmax(b->plane_offset, fabs(vec3_dot(d, b->n)));
			extent = fmax(extent, vec3_length(d));
		}
	}
	b->is_plane = b->plane_offset <= PLANE_TOLERANCE * extent;
}

/* Stores the frame of the plane in the mesh's own coordinates; if to_world has no inverse, the mesh counts as not
 * plane. */
static void store_local_axes(struct directional_area *b)
{
	const struct frame f = frame_around(b->n);
	mat4 from_world;
	b->is_plane = mat4_invert(b->light.to_world, &from_world);
	if (!b->is_plane)
		return;
	b->local_axes[0] = mat4_vector(&from_world, f.s);
	b->local_axes[1] = mat4_vector(&from_world, f.t);
	b->local_axes[2] = mat4_vector(&from_world, f.n);
}

/* Moves the plane with the emitter. Its normal is the cross product of two transformed vectors of the plane; heights
 * above it scale like the normal component of the transformed third axis. */
static void set_transform(struct emitter *em, const mat4 *to_world)
{
	struct directional_area *b = em->data;
	surface_light_set_transform(em, to_world);
	if (!b->is_plane)
		return;
	vec3 n = vec3_cross(mat4_vector(to_world, b->local_axes[0]), mat4_vector(to_world, b->local_axes[1]));
	b->n = vec3_normalize(n);
	b->plane_offset *= vec3_dot(b->n, mat4_vector(to_world, b->local_axes[2]));
	b->origin = surface_light_corner(&b->light, 0, 0);
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct directional_area *b = em->data;
	int rc = surface_light_create(em, n, build, e);
	if (rc)
		return rc;
	find_plane(b);
	if (b->is_plane && b->light.is_moving_mesh)
		store_local_axes(b);
	em->power = b->light.area * em->brightness_bound;
	em->brightness_bound *= 2 / (M_PI * sin(BEAM_HALF_ANGLE) * sin(BEAM_HALF_ANGLE));
	return 0;
}

/* Returns L / M, a density per projected solid angle; 0 outside the beam. */
static double beam_profile(vec3 n, vec3 w)
{
	double cosine = vec3_dot(n, w), edge = sin(BEAM_HALF_ANGLE);
	if (!(cosine > 0))
		return 0;
	vec3 c = vec3_cross(n, w);
	double rho2 = vec3_dot(c, c) / (edge * edge);
	return rho2 < 1 ? 2 * (1 - rho2) / (M_PI * edge * edge) : 0;
}

/* Returns the central direction of the beam at x. */
static vec3 beam_axis(const struct directional_area *b, const struct emitter_point *x)
{
	return b->is_plane ? b->n : x->n;
}

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	const struct directional_area *b = em->data;
	double share = beam_profile(beam_axis(b, x), w);
	return share > 0 ? spectrum_scale(share, texture_eval(&b->light.radiance, &x->texture_point, wl))
			 : spectrum_constant(0);
}

/* Samples rho of the profile from a number in [0,1). */
static double sample_rho(double u)
{
	return sqrt(u / (1 + sqrt(1 - u))); /* rho^2 = 1 - sqrt(1 - u) */
}

static bool sample_direction(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
			     double *pdf)
{
	vec3 axis = beam_axis(em->data, x);
	struct frame f = frame_around(axis);
	double rho = sample_rho(u[0]), s = rho * sin(BEAM_HALF_ANGLE), phi = 2 * M_PI * u[1];
	*w = frame_to_world(&f, (vec3){s * cos(phi), s * sin(phi), sqrt(1 - s * s)});
	*pdf = beam_profile(axis, *w) * vec3_dot(axis, *w);
	return *pdf > 0;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	vec3 axis = beam_axis(em->data, x);
	return beam_profile(axis, w) * fmax(vec3_dot(axis, w), 0);
}

/* A disc or cap of the surface that contains everything that shines at a point. */
struct lit_spot {
	vec3 axis; /* unit; the normal of the plane, or the direction from the sphere's centre to the middle of the cap
		    */
	vec3 center;   /* of the disc; unused for a cap */
	double radius; /* of the disc, or the angle of the cap at the sphere's centre */
};

static bool find_plane_spot(const struct directional_area *b, vec3 ref, struct lit_spot *s)
{
	double t = vec3_dot(vec3_sub(ref, b->origin), b->n);
	if (!(t > -b->plane_offset))
		return false;
	double radius = (t + b->plane_offset) * tan(BEAM_HALF_ANGLE) * SEARCH_MARGIN;
	*s = (struct lit_spot){b->n, vec3_madd(ref, -t, b->n), radius};
	return radius > 0;
}

/* Finds the cap. If the normal at a point and the direction to ref differ by BEAM_HALF_ANGLE, the angle between the
 * point and the axis at the sphere's centre is BEAM_HALF_ANGLE - asin(r / d sin BEAM_HALF_ANGLE), or BEAM_HALF_ANGLE (1
 * - r / d) up to terms of BEAM_HALF_ANGLE^3. */
static bool find_sphere_spot(const struct surface_light *l, vec3 ref, struct lit_spot *s)
{
	vec3 from_center = vec3_sub(ref, l->surface.center);
	double d = vec3_length(from_center), r = l->surface.radius;
	if (!(d > r * (1 + 0x1p-40)))
		return false;
	*s = (struct lit_spot){.axis = vec3_scale(1 / d, from_center),
			       .radius = SEARCH_MARGIN * BEAM_HALF_ANGLE * ((d - r) / d)};
	return true;
}

static bool is_outward_sphere(const struct surface_light *l)
{
	return l->surface.is_sphere && l->surface.normal_sign > 0;
}

static double disc_pdf(const struct lit_spot *s, double rho2)
{
	return rho2 < 1 ? 2 * (1 - rho2) / (M_PI * s->radius * s->radius) : 0;
}

static bool sample_plane(const struct directional_area *b, vec3 ref, const double u[2], struct emitter_point *x,
			 double *pdf)
{
	struct lit_spot s;
	if (!find_plane_spot(b, ref, &s))
		return false;
	struct frame f = frame_around(s.axis);
	double rho = sample_rho(u[0]), phi = 2 * M_PI * u[1], r = rho * s.radius;
	vec3 p = vec3_add(s.center, frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), 0}));
	for (uint32_t i = 0; i < b->light.surface.triangle_count; i++) {
		double w[2];
		surface_light_barycentrics(&b->light, i, p, w);
		if (!(w[0] >= 0 && w[1] >= 0 && w[0] + w[1] <= 1))
			continue;
		surface_light_set_triangle_point(&b->light, i, w[0], w[1], x);
		*pdf = disc_pdf(&s, rho * rho);
		return *pdf > 0;
	}
	return false;
}

/* Returns the density per area of the sphere. rho2: height from the top of the cap over that of the whole cap. */
static double cap_pdf(const struct surface_light *l, const struct lit_spot *s, double rho2)
{
	double half = sin(0.5 * s->radius);
	return rho2 < 1 ? (1 - rho2) / (2 * M_PI * l->surface.radius * l->surface.radius * half * half) : 0;
}

static bool sample_sphere(const struct surface_light *l, vec3 ref, const double u[2], struct emitter_point *x,
			  double *pdf)
{
	struct lit_spot s;
	if (!find_sphere_spot(l, ref, &s))
		return false;
	struct frame f = frame_around(s.axis);
	double rho = sample_rho(u[0]), half = rho * sin(0.5 * s.radius), q = 2 * half * half, r = sqrt(q * (2 - q)),
	       phi = 2 * M_PI * u[1];
	surface_light_set_sphere_point(l, frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), 1 - q}), x);
	*pdf = cap_pdf(l, &s, rho * rho);
	return *pdf > 0;
}

static bool sample_toward(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x, double *pdf)
{
	const struct directional_area *b = em->data;
	x->is_infinite = false;
	if (b->is_plane)
		return sample_plane(b, ref, u, x, pdf);
	if (is_outward_sphere(&b->light))
		return sample_sphere(&b->light, ref, u, x, pdf);
	return surface_light_sample_point(em, u, x, pdf);
}

static double pdf_toward(const struct emitter *em, vec3 ref, const struct emitter_point *x)
{
	const struct directional_area *b = em->data;
	struct lit_spot s;
	if (b->is_plane) {
		if (!find_plane_spot(b, ref, &s))
			return 0;
		vec3 c = vec3_cross(s.axis, vec3_sub(x->p, s.center));
		return disc_pdf(&s, vec3_dot(c, c) / (s.radius * s.radius));
	}
	if (!is_outward_sphere(&b->light))
		return surface_light_pdf_point(em, x);
	if (!find_sphere_spot(&b->light, ref, &s))
		return 0;
	/* Computed from the chord, without cancellation. */
	vec3 chord = vec3_sub(vec3_normalize(vec3_sub(x->p, b->light.surface.center)), s.axis);
	double half = sin(0.5 * s.radius);
	return cap_pdf(&b->light, &s, vec3_dot(chord, chord) / (4 * half * half));
}

const struct emitter_ops emitter_ops_directionalarea = {
	.decl = PLUGIN(EMITTER, "directionalarea", {.name = "radiance", .types = VALUE_TEXTURE, .max = PARAM_LIGHT_MAX},
		       {.name = "sampling_weight", .types = VALUE_FLOAT, .status = PARAM_IGNORED}),
	SURFACE_LIGHT_OPS,
	.data_size = sizeof(struct directional_area),
	.create = create,
	.radiance = radiance,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.sample_toward = sample_toward,
	.pdf_toward = pdf_toward,
	.set_transform = set_transform,
};
