/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths as bytes. A vertex on a surface is written as the data from which its point was computed (the primitive,
 * and barycentrics, the direction from a sphere's centre, or a curve's coordinates). So reading produces the same
 * point bit by bit, however small the primitive is relative to the scene, and untrusted bytes cannot name a point
 * that is not on its primitive. The bytes include log f as computed after reading them back; a path that was
 * tampered with has another one.
 *
 * Reading refuses numbers that are not finite, indices of objects that the scene does not have, points outside their
 * primitives, vertices that do not scatter as they state, paths that leave the window or carry no light, and a
 * contribution other than the one stated. Nothing is allocated. Unless media scatter, no ray is traced, so it is not
 * checked whether anything lies between two vertices.
 */
#include "worker/render/chain/path_bytes.h"

#include "common/base/bytes.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/path/full_path_density.h"

enum { PATH_EDGES_BYTES = 8, PATH_HEADER_BYTES = PATH_EDGES_BYTES + 8, VERTEX_BYTES = 40 };

/* Returns the size of the head. Fields that the scene does not need are omitted: the wavelength without colour, the
 * time without motion; likewise the camera's vertex without an aperture. */
static size_t path_header_size(const struct world *w)
{
	size_t colour = EFFECT_IS_ON(w, colour) ? 8 : 0, motion = EFFECT_IS_ON(w, motion) ? 8 : 0;
	return PATH_HEADER_BYTES + colour + motion;
}

static unsigned vertex_count(const struct world *w, unsigned edges)
{
	return EFFECT_IS_ON(w, aperture) ? edges + 1 : edges;
}

/* Tolerances: how far a point may be from the aperture, in units of the world's radius or of the aperture's if that is
 * larger, and the square of a direction from 1. */
#define POSITION_TOLERANCE 1e-9
/* Rounding errors of a sum of barycentrics, or of a unit vector's square, after a few operations. */
#define ROUNDING 0x1p-48
/* Limit on full_path_specular_error; walks are far more exact. */
#define SPECULAR_TOLERANCE 1e-3
/* Tolerance of log f: workers with other numeric fingerprints round differently. */
#define CONTRIBUTION_TOLERANCE 1e-6

/* ---- writing */

/* Returns the coordinates from which read_surface computes the point again. An emitter's point that was
 * drawn only has a position. */
static vec3 surface_coordinates(const struct world *w, const struct path_vertex *v)
{
	const struct geom_shape *s = &w->shapes[v->x.prim.shape];
	struct surface_point x = v->x;
	if (s->is_sphere)
		return vec3_scale(s->normal_sign, x.ng);
	if (v->kind == VERTEX_EMITTER)
		surface_nearest(s, x.prim, x.p, &x);
	return (vec3){x.b1, x.b2, 0};
}

static void write_vertex(const struct world *w, const struct path_vertex *v, uint8_t *at)
{
	bool on_surface = v->x.prim.shape < w->shape_count && v->kind != VERTEX_CAMERA && v->kind != VERTEX_INFINITE;
	vec3 coordinates = on_surface ? surface_coordinates(w, v) : v->x.p;
	at[0] = (uint8_t)v->kind;
	at[1] = (uint8_t)v->mode;
	at[2] = v->is_delta;
	at[3] = 0;
	put32(at + 4, (uint32_t)v->emitter);
	put32(at + 8, v->x.prim.shape);
	put32(at + 12, v->x.prim.prim);
	put_double(at + 16, coordinates.x);
	put_double(at + 24, coordinates.y);
	put_double(at + 32, coordinates.z);
}

/* ---- reading */

static bool is_within_tolerance(vec3 a, vec3 b, double size)
{
	vec3 d = vec3_sub(a, b);
	return vec3_dot(d, d) <= POSITION_TOLERANCE * POSITION_TOLERANCE * size * size;
}

static bool read_surface(const struct world *w, struct prim_ref prim, vec3 coordinates, struct surface_point *x)
{
	if (prim.shape >= w->shape_count)
		return false;
	const struct geom_shape *s = &w->shapes[prim.shape];
	if (s->is_sphere) {
		if (prim.prim != 0 || !(fabs(vec3_dot(coordinates, coordinates) - 1) <= ROUNDING))
			return false;
		surface_on_sphere(s, prim, coordinates, x);
		return true;
	}
	if (s->curves)
		return surface_on_curve(s, prim, coordinates.x, coordinates.y, x);
	if (prim.prim >= s->triangle_count || !(coordinates.x >= 0) || !(coordinates.y >= 0) ||
	    !(coordinates.x + coordinates.y <= 1 + ROUNDING))
		return false;
	surface_on_triangle(s, prim, coordinates.x, coordinates.y, x);
	return vec3_is_finite(x->ng);
}

/* Reads a point of an emitter without a surface. */
static bool read_emitter_point(const struct world *w, int32_t emitter, vec3 p, double time, struct path_vertex *v)
{
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(w, emitter, time, &storage);
	const double half[2] = {0.5, 0.5};
	struct emitter_point point = {.is_infinite = em->is_infinite};
	double pdf;
	if (em->is_delta) {
		if (!em->ops->sample_point(em, half, &point, &pdf) || !is_within_tolerance(point.p, p, w->radius))
			return false;
	} else {
		if (!em->is_infinite || !(fabs(vec3_dot(p, p) - 1) <= POSITION_TOLERANCE))
			return false;
		point.p = vec3_normalize(p);
	}
	*v = path_emitter_vertex(w, emitter, &point, time);
	return true;
}

static struct path_vertex pinhole(const struct world *w, double time)
{
	const double middle[2] = {0.5, 0.5};
	struct path_vertex v = {.kind = VERTEX_CAMERA, .emitter = -1};
	v.x.prim = prim_none_at(time);
	struct camera storage;
	v.x.p = camera_sample_point(world_camera_at(w, &v.x, &storage), middle);
	return v;
}

/* Whether p is far beyond everything in the scene, so that squares of its coordinates could overflow. */
static bool is_out_of_range(const struct world *w, vec3 p, double time)
{
	double max_coordinate = 4 * (w->radius + 1) + vec3_length(pinhole(w, time).x.p) + w->camera.aperture_radius;
	return !(fabs(p.x) <= max_coordinate && fabs(p.y) <= max_coordinate && fabs(p.z) <= max_coordinate);
}

static bool read_vertex(const struct world *w, const uint8_t *at, unsigned i, unsigned edges, double time,
			struct path_vertex *v)
{
	int32_t emitter = (int32_t)get32(at + 4);
	struct prim_ref prim = {get32(at + 8), get32(at + 12), time};
	vec3 coordinates = {get_double(at + 16), get_double(at + 24), get_double(at + 32)};
	*v = (struct path_vertex){.kind = at[0], .mode = at[1], .is_delta = at[2] != 0, .emitter = emitter};
	if (is_out_of_range(w, coordinates, time) || at[0] > VERTEX_MEDIUM || at[2] > 1 || at[3] != 0 ||
	    (v->kind == VERTEX_CAMERA) != (i == edges) ||
	    (v->kind == VERTEX_SURFACE || v->kind == VERTEX_MEDIUM) != (i > 0 && i < edges) ||
	    (v->mode & ~(unsigned)(BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT)))
		return false;
	if (v->kind == VERTEX_MEDIUM) {
		v->x = (struct surface_point){.p = coordinates, .prim = prim_none_at(time)};
		return EFFECT_IS_ON(w, scattering) && emitter == -1 && !v->is_delta;
	}
	if (v->kind == VERTEX_CAMERA) {
		double u[2];
		struct camera storage;
		v->x.prim = prim_none_at(time);
		const struct camera *camera = world_camera_at(w, &v->x, &storage);
		camera_point_inverse(camera, coordinates, u);
		v->x.p = camera_sample_point(camera, u);
		return is_within_tolerance(v->x.p, coordinates, fmax(w->radius, w->camera.aperture_radius));
	}
	if (i == 0 && (emitter < 0 || (uint32_t)emitter >= w->emitter_count))
		return false;
	if (i == 0 && w->emitter_shapes[emitter] == UINT32_MAX)
		return read_emitter_point(w, emitter, coordinates, time, v) && v->kind == (enum vertex_kind)at[0];
	if (!read_surface(w, prim, coordinates, &v->x))
		return false;
	v->bsdf = &w->bsdfs[w->shape_bindings[prim.shape].bsdf];
	v->emitter = w->shape_bindings[prim.shape].emitter;
	return i > 0 || (v->emitter == emitter && v->kind == VERTEX_EMITTER);
}

/* Reads a path without checking its contribution. */
static bool read_path(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path *x)
{
	if (size < PATH_EDGES_BYTES)
		return false;
	uint64_t edges = get64(bytes);
	x->edges = 0;
	if (edges == 0)
		return size == PATH_EDGES_BYTES;
	size_t head = path_header_size(c->w);
	if (edges > c->max_depth || edges > FULL_PATH_EDGES_MAX)
		return false;
	x->edges = (unsigned)edges;
	unsigned vertices = vertex_count(c->w, x->edges);
	if (size != head + (size_t)vertices * VERTEX_BYTES)
		return false;
	double u = EFFECT_IS_ON(c->w, colour) ? get_double(bytes + PATH_HEADER_BYTES) : 0;
	double time = EFFECT_IS_ON(c->w, motion) ? get_double(bytes + head - 8) : 0;
	if (!(u >= 0 && u < 1 && time >= 0 && time < 1))
		return false;
	for (unsigned i = 0; i < vertices; i++)
		if (!read_vertex(c->w, bytes + head + i * VERTEX_BYTES, i, x->edges, time, &x->v[i]))
			return false;
	if (vertices == x->edges)
		x->v[x->edges] = pinhole(c->w, time);
	full_path_set_wavelength(c, x, u);
	if (!full_path_finish(c, x))
		return false;
	for (unsigned j = 1; j < x->edges; j++)
		if (x->v[j].is_delta && !(full_path_specular_error(x, j) <= SPECULAR_TOLERANCE))
			return false;
	return true;
}

/* Reads a path and computes its contribution; if `check_contribution`, compares it with the one that the bytes state.
 * The code is ours, but the bytes are not trusted: an invalid operation that they cause (a signalling NaN, infinity
 * minus infinity) is refused and is not a fault. Not inline, so that no part is computed before or after the
 * floating-point flags are saved and restored. */
__attribute__((noinline)) static bool read_contribution(struct path_context *c, const uint8_t *bytes, size_t size,
							bool check_contribution, struct full_path *x,
							double *contribution)
{
	bool ok = read_path(c, bytes, size, x);
	*contribution = ok && x->edges ? full_path_log_f(c, x) : 0;
	if (ok && check_contribution && x->edges)
		ok = fabs(*contribution - get_double(bytes + PATH_EDGES_BYTES)) <= CONTRIBUTION_TOLERANCE;
	return ok && isfinite(*contribution);
}

static bool read_guarded(struct path_context *c, const uint8_t *bytes, size_t size, bool check_contribution,
			 struct full_path *x, double *contribution)
{
	unsigned flags = fptrap_enter_library();
	bool ok = read_contribution(c, bytes, size, check_contribution, x, contribution);
	fptrap_leave_library(flags);
	return ok;
}

bool path_read_contribution(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path *x,
			    double *contribution)
{
	return read_guarded(c, bytes, size, false, x, contribution);
}

bool path_read(struct path_context *c, const uint8_t *bytes, size_t size, struct full_path *x)
{
	double contribution;
	return read_guarded(c, bytes, size, true, x, &contribution);
}

size_t path_write(struct path_context *c, const struct full_path *x, struct full_path *reread, uint8_t *bytes)
{
	put64(bytes, x->edges);
	if (x->edges == 0)
		return PATH_EDGES_BYTES;
	if (EFFECT_IS_ON(c->w, colour))
		put_double(bytes + PATH_HEADER_BYTES, x->wavelength_u);
	uint8_t *at = bytes + path_header_size(c->w);
	if (EFFECT_IS_ON(c->w, motion))
		put_double(at - 8, full_path_time(x));
	for (unsigned i = 0; i < vertex_count(c->w, x->edges); i++, at += VERTEX_BYTES)
		write_vertex(c->w, &x->v[i], at);
	double contribution;
	if (!path_read_contribution(c, bytes, (size_t)(at - bytes), reread, &contribution))
		return 0;
	put_double(bytes + PATH_EDGES_BYTES, contribution);
	return (size_t)(at - bytes);
}
