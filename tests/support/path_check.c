/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/path_check.h"

#include <stdio.h>

/* Cached and fresh values may differ by rounding, which narrow lobes amplify. */
#define CHECK_TOLERANCE 1e-6

static bool is_close(double a, double b)
{
	return fabs(a - b) <= CHECK_TOLERANCE * fmax(fabs(a), fabs(b));
}

static bool is_same_spectrum(spectrum a, spectrum b)
{
	for (int i = 0; i < SPECTRUM_LANES; i++)
		if (!is_close(a.v[i], b.v[i]))
			return false;
	return true;
}

static bool is_same_vector(vec3 a, vec3 b)
{
	vec3 d = vec3_sub(a, b);
	return vec3_dot(d, d) <= CHECK_TOLERANCE * CHECK_TOLERANCE * fmax(vec3_dot(b, b), 1);
}

/* The checks change the path that they examine, so they work on a copy. A path is 64 kB, most of it unused: copying
 * all of it took 6 of 25 s in a test of detailed balance. */
static struct full_path *copy_path(const struct full_path *x)
{
	static _Thread_local struct full_path copy;
	full_path_copy(&copy, x, 0, x->edges);
	return &copy;
}

static bool check_media(const struct path_edge *a, const struct path_edge *b, spectrum cached, spectrum fresh)
{
	return a->medium == b->medium && a->previous_medium == b->previous_medium &&
	       a->has_matching_media == b->has_matching_media &&
	       is_same_spectrum(a->scattering_transmittance, b->scattering_transmittance) &&
	       is_same_spectrum(cached, fresh);
}

static bool check_edges(struct path_context *c, const struct full_path *x, char *text, size_t size)
{
	struct full_path *copy = copy_path(x);
	for (unsigned e = 0; e < x->edges; e++) {
		double distance2;
		vec3 w = path_direction(&x->v[e], &x->v[e + 1], &distance2);
		if (!(distance2 > 0) || !is_same_vector(w, x->edge[e].w) ||
		    !is_close(distance2, x->edge[e].distance2) || !is_same_vector(w, x->v[e].to_prev)) {
			snprintf(text, size, "edge %u of %u is not the one between its ends", e, x->edges);
			return false;
		}
		if (!full_path_edge_is_visible(c, copy, e)) {
			snprintf(text, size, "edge %u of %u is occluded", e, x->edges);
			return false;
		}
		if (EFFECT_IS_ON(c->w, scattering) &&
		    !check_media(&x->v[e].edge, &copy->v[e].edge, x->edge[e].transmittance,
				 copy->edge[e].transmittance)) {
			snprintf(text, size, "edge %u of %u does not know its media", e, x->edges);
			return false;
		}
	}
	return true;
}

/* The specular direction is met as accurately as by walks. */
#define SPECULAR_TOLERANCE 1e-6

static bool check_specular(const struct full_path *x, unsigned j, char *text, size_t size)
{
	double miss = full_path_specular_error(x, j);
	if (miss > SPECULAR_TOLERANCE)
		snprintf(text, size, "vertex %u of %u misses its specular direction by %g", j, x->edges, miss);
	return miss <= SPECULAR_TOLERANCE;
}

static bool check_vertices(const struct path_context *c, const struct full_path *x, char *text, size_t size)
{
	struct full_path *fresh = copy_path(x);
	fresh->cached_f = fresh->cached_fh = (struct vertex_set){{0}};
	for (unsigned j = 0; j < x->edges; j++) {
		const struct path_vertex *v = &x->v[j];
		if (j > 0 && (v->mode & (BSDF_REFLECT | BSDF_TRANSMIT)) != full_path_mode(x, j)) {
			snprintf(text, size, "vertex %u of %u does not scatter in its mode", j, x->edges);
			return false;
		}
		if (j > 0 && v->is_delta && !check_specular(x, j, text, size))
			return false;
		spectrum f = full_path_eval_f(c, fresh, j);
		if (spectrum_is_zero(f) || !spectrum_is_valid(f) ||
		    (vertex_set_has(&x->cached_f, j) && !is_same_spectrum(f, x->f[j]))) {
			snprintf(text, size, "f at vertex %u of %u is %g, cached %g", j, x->edges, f.v[0],
				 x->f[j].v[0]);
			return false;
		}
		if (j > 0 && vertex_set_has(&x->cached_fh, j) &&
		    !is_same_spectrum(full_path_eval_fh(c, fresh, j), x->fh[j])) {
			snprintf(text, size, "fh at vertex %u of %u is %g, cached %g", j, x->edges, fresh->fh[j].v[0],
				 x->fh[j].v[0]);
			return false;
		}
	}
	return true;
}

/* For vertices seen from the camera: a ray that hits a triangle in float and just misses it in double ends on its
 * edge. */
#define FILM_TOLERANCE 0x1p-22

bool path_check(struct path_context *c, const struct full_path *x, char *text, size_t size)
{
	if (x->edges < 1 || x->edges > FULL_PATH_EDGES_MAX) {
		snprintf(text, size, "%u edges", x->edges);
		return false;
	}
	struct full_path *projected = copy_path(x);
	double tolerance = fmax(1e-6, FILM_TOLERANCE * c->w->camera.pixels_per_slope);
	if (!full_path_project(c, projected) ||
	    hypot(projected->film[0] - x->film[0], projected->film[1] - x->film[1]) > tolerance) {
		snprintf(text, size, "the film point (%g, %g) is (%g, %g)", x->film[0], x->film[1], projected->film[0],
			 projected->film[1]);
		return false;
	}
	if (EFFECT_IS_ON(c->w, scattering) && !full_path_can_be_made(c, x)) {
		snprintf(text, size, "a path of %u edges that no technique makes", x->edges);
		return false;
	}
	return check_edges(c, x, text, size) && check_vertices(c, x, text, size);
}
