/* SPDX-License-Identifier: Apache-2.0 */
/*
 * trace_multichain moves the film point, then goes from the camera along the old path: perturb_direction gives the
 * direction that leaves each vertex, by the perturbed half vector on surfaces and by a perturbed direction in media,
 * and trace_edge finds the next vertex. Each step that is symmetric in x and y is part of move->log_symmetric.
 *
 * Failures: the proposal is rejected with its reason if the new point is outside the film or the aperture
 * (PROPOSAL_OUTSIDE), a ray meets nothing or a vertex of another kind (PROPOSAL_MISSED), a vertex cannot scatter like
 * the old one (PROPOSAL_MODE_CHANGED), or the last one emits no light (PROPOSAL_EMITTER).
 */
#include "worker/render/mutation/trace.h"

#include "worker/render/path/media.h"

/* Standard deviation of the steps of half vectors, in lobe widths. */
#define HALFVEC_STEP 0.01
/* Step of x_k, in the random numbers that produce it. */
#define APERTURE_STEP 0.1
/* Steps of the logarithm of the distance to an event in a medium, and of the direction in which the path leaves it. */
#define DISTANCE_STEP 0.02
#define DIRECTION_STEP 0.02
/* Minimum sine of the angle between the line and each of the normals for which frames are aligned by the line. */
#define PROJECTION_MIN 1e-3

bool trace_move_aperture(struct mutation_ctx *m, const struct full_path *x, struct full_path *y)
{
	struct camera storage;
	const struct camera *camera = world_camera_at(m->path->w, &x->v[x->edges].x, &storage);
	double u[2], r[4];
	mutation_draw_uniforms(m, BLOCK_ENDS, r);
	camera_point_inverse(camera, x->v[x->edges].x.p, u);
	if (!mutation_step_in_square(u, r + 1, APERTURE_STEP))
		return false;
	y->v[y->edges].x.p = camera_sample_point(camera, u);
	return true;
}

static bool move_film_point(struct mutation_ctx *m, const struct full_path *x, struct full_path *y,
			    struct proposal_move *move)
{
	double r[4], g[2], sigma = halfvec_film_sigma(&m->path->w->camera);
	mutation_draw_uniforms(m, BLOCK_FILM, r);
	mutation_normals_from_uniform(r, g);
	for (int i = 0; i < 2; i++)
		y->film[i] = x->film[i] + sigma * g[i];
	move->log_symmetric -= 0.5 * (g[0] * g[0] + g[1] * g[1]) + log(2 * M_PI * sigma * sigma);
	return film_window_contains(&m->path->window, y->film) &&
	       camera_film_point_is_valid(&m->path->w->camera, y->film[0], y->film[1]);
}

/* Rotates a half vector from x_j's frame into y_j's, using the line between the two vertices as seen in both frames
 * (sec. 4). The rotation is reversible: from y to x, both angles gain pi. */
static void rotate_half_vector(const struct path_vertex *from, const struct path_vertex *to, vec2 *h)
{
	vec3 d = vec3_sub(to->x.p, from->x.p);
	vec3 a = frame_to_local(&from->x.sh, d), b = frame_to_local(&to->x.sh, d);
	double la = hypot(a.x, a.y), lb = hypot(b.x, b.y), min_length = PROJECTION_MIN * vec3_length(d);
	if (!(la > min_length && lb > min_length))
		return;
	double c = (a.x * b.x + a.y * b.y) / (la * lb), s = (a.x * b.y - a.y * b.x) / (la * lb);
	*h = (vec2){c * h->x - s * h->y, s * h->x + c * h->y};
}

/* Computes the direction to the light for light that leaves along o with half vector h; eta = n_o / n_i. Returns
 * false for total reflection. */
static bool direction_of_halfvec(vec3 o, vec2 h, bool transmit, double eta, vec3 *i)
{
	if (transmit && eta == 1) { /* index-matched: h is (i + o)_xy */
		double x = h.x - o.x, y = h.y - o.y, z2 = 1 - x * x - y * y;
		*i = (vec3){x, y, copysign(sqrt(fmax(z2, 0)), -o.z)};
		return z2 > 0;
	}
	vec3 n = vec3_scale(1 / sqrt(1 + vec2_dot(h, h)), (vec3){h.x, h.y, 1});
	double c = vec3_dot(o, n);
	if (!transmit) {
		*i = vec3_sub(vec3_scale(2 * c, n), o);
		return o.z * i->z > 0;
	}
	if (c < 0) {
		n = vec3_neg(n);
		c = -c;
	}
	double k2 = 1 - eta * eta * (1 - c) * (1 + c);
	if (!(k2 > 0))
		return false;
	*i = vec3_madd(vec3_scale(-eta, o), eta * c - sqrt(k2), n);
	return o.z * i->z < 0;
}

/* Returns the direction in which the path leaves an event: the old direction, turned with the one from which the path
 * comes, plus a symmetric step. */
static vec3 perturb_direction_in_medium(struct mutation_ctx *m, unsigned j, const struct full_path *x,
					const struct full_path *y, struct proposal_move *move)
{
	double r[4], g[2];
	mutation_draw_uniforms(m, BLOCK_VERTEX + j, r);
	mutation_normals_from_uniform(r, g);
	struct frame from = frame_around(x->edge[j].w), to = frame_around(y->edge[j].w);
	vec3 i = frame_to_world(&to, frame_to_local(&from, vec3_neg(x->edge[j - 1].w)));
	struct frame around = frame_around(i);
	double length2 = 1 + DIRECTION_STEP * DIRECTION_STEP * (g[0] * g[0] + g[1] * g[1]);
	move->log_symmetric -= 0.5 * (g[0] * g[0] + g[1] * g[1]) + log(2 * M_PI * DIRECTION_STEP * DIRECTION_STEP) -
			       1.5 * log(length2);
	return vec3_normalize(frame_to_world(&around, (vec3){DIRECTION_STEP * g[0], DIRECTION_STEP * g[1], 1}));
}

/* Computes the direction *d in which the path continues from y_j. Returns false if it cannot scatter like x_j. */
static bool perturb_direction(struct mutation_ctx *m, unsigned j, const struct full_path *x, struct full_path *y,
			      struct proposal_move *move, vec3 *d)
{
	const struct path_vertex *from = &x->v[j];
	struct path_vertex *v = &y->v[j];
	if (from->kind == VERTEX_MEDIUM) {
		*d = perturb_direction_in_medium(m, j, x, y, move);
		return true;
	}
	vec3 o = frame_to_local(&v->x.sh, y->edge[j].w), i;
	v->mode = from->mode;
	v->is_delta = from->is_delta;
	if (from->is_delta) {
		double probability;
		if (!v->bsdf->has_delta || spectrum_is_zero(full_path_specular_weight(y, j, &i, &probability)))
			return false;
	} else {
		if (!v->bsdf->has_smooth || !(v->bsdf->modes & v->mode))
			return false;
		double r[4], g[2], sigma = HALFVEC_STEP * 0.5 * (halfvec_lobe_width(from) + halfvec_lobe_width(v));
		mutation_draw_uniforms(m, BLOCK_VERTEX + j, r);
		mutation_normals_from_uniform(r, g);
		vec2 h = halfvec_of(x, j);
		rotate_half_vector(from, v, &h);
		h = vec2_add(h, (vec2){sigma * g[0], sigma * g[1]});
		move->log_symmetric -= 0.5 * (g[0] * g[0] + g[1] * g[1]) + log(2 * M_PI * sigma * sigma);
		if (!direction_of_halfvec(o, h, v->mode & BSDF_TRANSMIT, full_path_eta(y, j), &i))
			return false;
	}
	*d = vec3_normalize(frame_to_world(&v->x.sh, i));
	return true;
}

/* Makes y_b the end of the traced part. */
static enum proposal_result finish_trace(struct path_context *c, unsigned b, struct path_vertex *v)
{
	v->is_delta = false;
	v->mode = 0;
	if (b > 0)
		return v->kind != VERTEX_INFINITE && path_scatters_smoothly(v) ? PROPOSAL_MADE : PROPOSAL_MODE_CHANGED;
	if (v->emitter < 0)
		return PROPOSAL_EMITTER;
	if (v->kind == VERTEX_SURFACE)
		v->kind = VERTEX_EMITTER;
	return path_can_be_hit(c, v) ? PROPOSAL_MADE : PROPOSAL_EMITTER;
}

/* Goes to an event in a medium at about the distance of x's event. */
static bool move_to_event(struct mutation_ctx *m, unsigned j, vec3 d, double t_min, double t_max,
			  const struct full_path *x, struct full_path *y, struct proposal_move *move)
{
	double r[4], g[2];
	mutation_draw_uniforms(m, BLOCK_VERTEX + j, r);
	mutation_normals_from_uniform(r + 2, g);
	move->log_symmetric -= 0.5 * g[0] * g[0] + 0.5 * log(2 * M_PI * DISTANCE_STEP * DISTANCE_STEP);
	double distance = sqrt(x->edge[j - 1].distance2) * exp(DISTANCE_STEP * g[0]);
	if (!(distance > t_min && distance < t_max))
		return false;
	y->v[j - 1] = (struct path_vertex){.mode = BSDF_REFLECT};
	path_make_medium_vertex(&y->v[j - 1], &y->v[j], distance, d);
	return full_path_compute_edge(y, j - 1) && full_path_edge_is_visible(m->path, y, j - 1);
}

/* Goes from y_j along d to y_{j-1}, which is of the same kind as x_{j-1}, except at the end of the traced part. */
static bool trace_edge(struct mutation_ctx *m, unsigned j, vec3 d, const struct full_path *x, struct full_path *y,
		       struct proposal_move *move)
{
	struct path_context *c = m->path;
	struct path_vertex *to = &y->v[j - 1];
	double t_min = 0, t_max = INFINITY;
	struct camera storage;
	if (j == x->edges)
		camera_clip_range(world_camera_at(c->w, &y->v[j].x, &storage), d, &t_min, &t_max);
	if (!EFFECT_IS_ON(c->w, scattering))
		return path_extend(c, &y->v[j], d, t_min, t_max, to) && full_path_compute_edge(y, j - 1);
	if (x->v[j - 1].kind == VERTEX_MEDIUM)
		return move_to_event(m, j, d, t_min, t_max, x, y, move);
	c->wl = y->wl;
	return path_extend_without_events(c, &y->v[j], d, t_min, t_max, to, &y->edge[j - 1].transmittance) &&
	       full_path_compute_edge(y, j - 1);
}

enum proposal_result trace_multichain(struct mutation_ctx *m, unsigned b, bool aperture, struct full_path *x,
				      struct full_path *y, struct proposal_move *move)
{
	struct path_context *c = m->path;
	unsigned k = x->edges;
	if (aperture && !trace_move_aperture(m, x, y))
		return PROPOSAL_OUTSIDE;
	if (!move_film_point(m, x, y, move))
		return PROPOSAL_OUTSIDE;
	struct camera storage;
	vec3 d = camera_direction(world_camera_at(c->w, &y->v[k].x, &storage), y->v[k].x.p, y->film[0], y->film[1]);
	for (unsigned j = k; j > b; j--) {
		if (j < k && !perturb_direction(m, j, x, y, move, &d))
			return PROPOSAL_MODE_CHANGED;
		move->first = j - 1;
		if (!trace_edge(m, j, d, x, y, move) || (j - 1 > b && y->v[j - 1].kind != x->v[j - 1].kind))
			return PROPOSAL_MISSED;
		if (j < k && full_path_mode(y, j) != (y->v[j].mode & (BSDF_REFLECT | BSDF_TRANSMIT)))
			return PROPOSAL_MODE_CHANGED;
	}
	return finish_trace(c, b, &y->v[b]);
}
