/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light that leaves a surface along its normal, with `radiance` as the power per area. An exactly parallel beam could
 * only be traced from the light; this beam diverges by SPREAD, like that of a laser pointer, so that every integrator
 * and mutation can treat it like other emitters. Its edge is blurred by a thousandth of the distance.
 *
 * At a point x with normal n, with rho = sin(angle between w and n) / sin(SPREAD) < 1:
 *
 *   L(x, w) = M 2 (1 - rho^2) / (pi sin^2 SPREAD),   the integral of L cos over w is M,
 *
 * and directions are sampled in proportion to L cos. L falls to 0 at the edge, so that the rounding of a direction that
 * is computed again from two points changes the light only slightly.
 *
 * Next event estimation from a point needs the part of the surface that shines at it: on a plane, a disc around the
 * point's projection, of radius distance times tan SPREAD; on a sphere, a cap around the nearest point. On other
 * surfaces this part is not searched for, and paths have to start at the light.
 *
 * Sampling fails for a point behind the plane or inside the sphere, and if the sampled position is not on the shape.
 */
#include "worker/render/emitter/surface_light.h"

/* Half the opening angle of the beam, in radians. */
#define SPREAD 1e-3

/* The distance by which corners may be off a plane because of rounding, as a share of its extent. All triangles shine
 * along the normal of the plane, since the normal of a thin triangle with rounded corners may differ by more than
 * SPREAD. */
#define PLANE_OFFSET 1e-5

/* The searched part of a surface is larger than the shining part by this factor, because of rounding. */
#define MARGIN 1.02

enum { PLANE_TRIANGLES = 256 };

struct beam {
	struct surface_light light;
	bool is_plane;
	vec3 origin, n; /* a point of the plane, and its unit normal */
	double offset;	/* largest distance of a corner from the plane */
	vec3 own[3];	/* of a mesh that moves, in its own coordinates: a frame around n, right-handed when the shutter
			   opens */
};

/* Sets is_plane if all triangles lie in one plane, perpendicular to the sum of their normals, and face the same
 * side. */
static void find_plane(struct beam *b)
{
	const struct surface_light *l = &b->light;
	uint32_t count = l->surface.triangle_count;
	if (l->surface.is_sphere || count > PLANE_TRIANGLES)
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
			b->offset = fmax(b->offset, fabs(vec3_dot(d, b->n)));
			extent = fmax(extent, vec3_length(d));
		}
	}
	b->is_plane = b->offset <= PLANE_OFFSET * extent;
}

/* Stores the frame of the plane in the mesh's own coordinates; if to_world has no inverse, the mesh counts as not
 * plane. */
static void keep_own(struct beam *b)
{
	const struct frame f = frame_around(b->n);
	mat4 back;
	b->is_plane = mat4_invert(b->light.to_world, &back);
	if (!b->is_plane)
		return;
	b->own[0] = mat4_vector(&back, f.s);
	b->own[1] = mat4_vector(&back, f.t);
	b->own[2] = mat4_vector(&back, f.n);
}

/* Moves the plane with the emitter. Its normal is the cross product of two transformed vectors of the plane; heights
 * above it scale like the normal component of the transformed third axis. */
static void place(struct emitter *em, const mat4 *to_world)
{
	struct beam *b = em->data;
	surface_light_place(em, to_world);
	if (!b->is_plane)
		return;
	vec3 n = vec3_cross(mat4_vector(to_world, b->own[0]), mat4_vector(to_world, b->own[1]));
	b->n = vec3_normalize(n);
	b->offset *= vec3_dot(b->n, mat4_vector(to_world, b->own[2]));
	b->origin = surface_light_corner(&b->light, 0, 0);
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct beam *b = em->data;
	int rc = surface_light_create(em, n, build, e);
	if (rc)
		return rc;
	find_plane(b);
	if (b->is_plane && b->light.placed)
		keep_own(b);
	em->power = b->light.area * em->brightest;
	em->brightest *= 2 / (M_PI * sin(SPREAD) * sin(SPREAD));
	return 0;
}

/* Returns L / M, a density per projected solid angle; 0 outside the beam. */
static double profile(vec3 n, vec3 w)
{
	double cosine = vec3_dot(n, w), edge = sin(SPREAD);
	if (!(cosine > 0))
		return 0;
	vec3 c = vec3_cross(n, w);
	double rho2 = vec3_dot(c, c) / (edge * edge);
	return rho2 < 1 ? 2 * (1 - rho2) / (M_PI * edge * edge) : 0;
}

/* Returns the central direction of the beam at x. */
static vec3 beam_axis(const struct beam *b, const struct emitter_point *x)
{
	return b->is_plane ? b->n : x->n;
}

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	const struct beam *b = em->data;
	double share = profile(beam_axis(b, x), w);
	return share > 0 ? spectrum_scale(share, texture_eval(&b->light.radiance, &x->where, wl)) : spectrum_of(0);
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
	double rho = sample_rho(u[0]), s = rho * sin(SPREAD), phi = 2 * M_PI * u[1];
	*w = frame_to_world(&f, (vec3){s * cos(phi), s * sin(phi), sqrt(1 - s * s)});
	*pdf = profile(axis, *w) * vec3_dot(axis, *w);
	return *pdf > 0;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	vec3 axis = beam_axis(em->data, x);
	return profile(axis, w) * fmax(vec3_dot(axis, w), 0);
}

/* A disc or cap of the surface that contains everything that shines at a point. */
struct spot_around {
	vec3 axis; /* unit; the normal of the plane, or the direction from the sphere's centre to the middle of the cap
		    */
	vec3 center;   /* of the disc; unused for a cap */
	double radius; /* of the disc, or the angle of the cap at the sphere's centre */
};

static bool spot_of_plane(const struct beam *b, vec3 ref, struct spot_around *s)
{
	double t = vec3_dot(vec3_sub(ref, b->origin), b->n);
	if (!(t > -b->offset))
		return false;
	double reach = (t + b->offset) * tan(SPREAD) * MARGIN;
	*s = (struct spot_around){b->n, vec3_madd(ref, -t, b->n), reach};
	return reach > 0;
}

/* Finds the cap. If the normal at a point and the direction to ref differ by SPREAD, the angle between the point and
 * the axis at the sphere's centre is SPREAD - asin(r / d sin SPREAD), or SPREAD (1 - r / d) up to terms of SPREAD^3. */
static bool spot_of_sphere(const struct surface_light *l, vec3 ref, struct spot_around *s)
{
	vec3 to = vec3_sub(ref, l->surface.center);
	double d = vec3_length(to), r = l->surface.radius;
	if (!(d > r * (1 + 0x1p-40)))
		return false;
	*s = (struct spot_around){.axis = vec3_scale(1 / d, to), .radius = MARGIN * SPREAD * ((d - r) / d)};
	return true;
}

static bool is_outward_sphere(const struct surface_light *l)
{
	return l->surface.is_sphere && l->surface.normal_sign > 0;
}

static double disc_pdf(const struct spot_around *s, double rho2)
{
	return rho2 < 1 ? 2 * (1 - rho2) / (M_PI * s->radius * s->radius) : 0;
}

static bool sample_plane(const struct beam *b, vec3 ref, const double u[2], struct emitter_point *x, double *pdf)
{
	struct spot_around s;
	if (!spot_of_plane(b, ref, &s))
		return false;
	struct frame f = frame_around(s.axis);
	double rho = sample_rho(u[0]), phi = 2 * M_PI * u[1], r = rho * s.radius;
	vec3 p = vec3_add(s.center, frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), 0}));
	for (uint32_t i = 0; i < b->light.surface.triangle_count; i++) {
		double w[2];
		surface_light_weights(&b->light, i, p, w);
		if (!(w[0] >= 0 && w[1] >= 0 && w[0] + w[1] <= 1))
			continue;
		surface_light_on_triangle(&b->light, i, w[0], w[1], x);
		*pdf = disc_pdf(&s, rho * rho);
		return *pdf > 0;
	}
	return false;
}

/* Returns the density per area of the sphere. rho2: height from the top of the cap over that of the whole cap. */
static double cap_pdf(const struct surface_light *l, const struct spot_around *s, double rho2)
{
	double half = sin(0.5 * s->radius);
	return rho2 < 1 ? (1 - rho2) / (2 * M_PI * l->surface.radius * l->surface.radius * half * half) : 0;
}

static bool sample_sphere(const struct surface_light *l, vec3 ref, const double u[2], struct emitter_point *x,
			  double *pdf)
{
	struct spot_around s;
	if (!spot_of_sphere(l, ref, &s))
		return false;
	struct frame f = frame_around(s.axis);
	double rho = sample_rho(u[0]), half = rho * sin(0.5 * s.radius), q = 2 * half * half, r = sqrt(q * (2 - q)),
	       phi = 2 * M_PI * u[1];
	surface_light_on_sphere(l, frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), 1 - q}), x);
	*pdf = cap_pdf(l, &s, rho * rho);
	return *pdf > 0;
}

static bool sample_toward(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x, double *pdf)
{
	const struct beam *b = em->data;
	x->infinite = false;
	if (b->is_plane)
		return sample_plane(b, ref, u, x, pdf);
	if (is_outward_sphere(&b->light))
		return sample_sphere(&b->light, ref, u, x, pdf);
	return surface_light_sample_point(em, u, x, pdf);
}

static double pdf_toward(const struct emitter *em, vec3 ref, const struct emitter_point *x)
{
	const struct beam *b = em->data;
	struct spot_around s;
	if (b->is_plane) {
		if (!spot_of_plane(b, ref, &s))
			return 0;
		vec3 c = vec3_cross(s.axis, vec3_sub(x->p, s.center));
		return disc_pdf(&s, vec3_dot(c, c) / (s.radius * s.radius));
	}
	if (!is_outward_sphere(&b->light))
		return surface_light_pdf_point(em, x);
	if (!spot_of_sphere(&b->light, ref, &s))
		return 0;
	/* Computed from the chord, without cancellation. */
	vec3 off = vec3_sub(vec3_normalize(vec3_sub(x->p, b->light.surface.center)), s.axis);
	double half = sin(0.5 * s.radius);
	return cap_pdf(&b->light, &s, vec3_dot(off, off) / (4 * half * half));
}

const struct emitter_ops emitter_ops_directionalarea = {
	.decl = PLUGIN(EMITTER, "directionalarea", {.name = "radiance", .types = VALUE_TEXTURE, .max = PARAM_LIGHT_MAX},
		       {.name = "sampling_weight", .types = VALUE_FLOAT, .status = PARAM_IGNORED}),
	SURFACE_LIGHT_OPS,
	.data_size = sizeof(struct beam),
	.create = create,
	.radiance = radiance,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.sample_toward = sample_toward,
	.pdf_toward = pdf_toward,
	.place = place,
};
