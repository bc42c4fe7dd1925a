#include "worker/chain/path_chain.h"

#include "worker/chain/bytes.h"

enum { PATH_HEAD = 8, VERTEX_BYTES = 40 };

/* What a scene does not call for is not there: the wavelength's number without colour, the camera's vertex without aperture. */
static size_t head_bytes(const struct world *w)
{
	return PATH_HEAD + (EFFECT_IS_ON(w, colour) ? 8 : 0);
}

static unsigned vertex_count(const struct world *w, unsigned edges)
{
	return EFFECT_IS_ON(w, aperture) ? edges + 1 : edges;
}

/* Where a position and the surface that it names differ more than that, in units of the world's radius, they do not belong
 * together. */
#define BELONGS 1e-9
/* Walks meet specular directions far more exactly. */
#define SPECULAR 1e-3

size_t path_write(const struct world *w, const struct whole_path *x, uint8_t *bytes)
{
	put64(bytes, x->edges);
	if (x->edges == 0)
		return PATH_HEAD;
	if (EFFECT_IS_ON(w, colour))
		put_double(bytes + PATH_HEAD, x->wavelength);
	uint8_t *at = bytes + head_bytes(w);
	for (unsigned i = 0; i < vertex_count(w, x->edges); i++, at += VERTEX_BYTES) {
		const struct path_vertex *v = &x->v[i];
		at[0] = (uint8_t)v->kind;
		at[1] = (uint8_t)v->mode;
		at[2] = v->delta;
		at[3] = 0;
		put32(at + 4, (uint32_t)v->emitter);
		put32(at + 8, v->x.prim.shape);
		put32(at + 12, v->x.prim.prim);
		put_double(at + 16, v->x.p.x);
		put_double(at + 24, v->x.p.y);
		put_double(at + 32, v->x.p.z);
	}
	return (size_t)(at - bytes);
}

static bool near(const struct world *w, vec3 a, vec3 b)
{
	vec3 d = vec3_sub(a, b);
	return vec3_dot(d, d) <= BELONGS * BELONGS * w->radius * w->radius;
}

/* The surface at p. */
static bool read_surface(const struct world *w, struct prim_ref prim, vec3 p, struct surface_point *x)
{
	if (prim.shape >= w->shape_count)
		return false;
	return surface_near(&w->shapes[prim.shape], prim, p, w->radius, x) && near(w, x->p, p);
}

/* An emitter that has no surface. */
static bool read_far_emitter(const struct world *w, int32_t emitter, vec3 p, struct path_vertex *v)
{
	const struct emitter *em = &w->emitters[emitter];
	const double half[2] = {0.5, 0.5};
	struct emitter_point point = {.infinite = em->infinite};
	double pdf;
	if (em->delta) {
		if (!em->ops->sample_point(em, half, &point, &pdf) || !near(w, point.p, p))
			return false;
	} else {
		if (!em->infinite || !(fabs(vec3_dot(p, p) - 1) <= BELONGS))
			return false;
		point.p = vec3_normalize(p);
	}
	*v = path_emitter_vertex(w, emitter, &point);
	return true;
}

static struct path_vertex pinhole(const struct world *w)
{
	const double middle[2] = {0.5, 0.5};
	struct path_vertex v = {.kind = VERTEX_CAMERA, .emitter = -1};
	v.x.prim = PRIM_NONE;
	v.x.p = camera_point(&w->camera, middle);
	return v;
}

static bool read_vertex(const struct world *w, const uint8_t *at, unsigned i, unsigned edges, struct path_vertex *v)
{
	int32_t emitter = (int32_t)get32(at + 4);
	struct prim_ref prim = {get32(at + 8), get32(at + 12)};
	vec3 p = {get_double(at + 16), get_double(at + 24), get_double(at + 32)};
	*v = (struct path_vertex){.kind = at[0], .mode = at[1], .delta = at[2] != 0, .emitter = emitter};
	if (!vec3_is_finite(p) || at[0] > VERTEX_INFINITE || (v->kind == VERTEX_CAMERA) != (i == edges) ||
	    (v->kind == VERTEX_SURFACE) != (i > 0 && i < edges))
		return false;
	if (v->kind == VERTEX_CAMERA) {
		double u[2];
		v->x.prim = PRIM_NONE;
		camera_point_inverse(&w->camera, p, u);
		v->x.p = camera_point(&w->camera, u);
		return near(w, v->x.p, p);
	}
	if (i == 0 && (emitter < 0 || (uint32_t)emitter >= w->emitter_count))
		return false;
	if (i == 0 && w->emitter_shape[emitter] == UINT32_MAX)
		return read_far_emitter(w, emitter, p, v) && v->kind == (enum vertex_kind)at[0];
	if (!read_surface(w, prim, p, &v->x))
		return false;
	v->bsdf = &w->bsdfs[w->parts[prim.shape].bsdf];
	v->emitter = w->parts[prim.shape].emitter;
	return i > 0 || v->emitter == emitter;
}

bool path_read(struct path_context *c, const uint8_t *bytes, size_t size, struct whole_path *x)
{
	if (size < PATH_HEAD)
		return false;
	uint64_t edges = get64(bytes);
	x->edges = 0;
	if (edges == 0)
		return size == PATH_HEAD;
	size_t head = head_bytes(c->w);
	if (edges > c->max_depth || edges > WHOLE_MAX_EDGES)
		return false;
	x->edges = (unsigned)edges;
	unsigned vertices = vertex_count(c->w, x->edges);
	if (size != head + (size_t)vertices * VERTEX_BYTES)
		return false;
	double u = EFFECT_IS_ON(c->w, colour) ? get_double(bytes + PATH_HEAD) : 0;
	if (!(u >= 0 && u < 1))
		return false;
	for (unsigned i = 0; i < vertices; i++)
		if (!read_vertex(c->w, bytes + head + i * VERTEX_BYTES, i, x->edges, &x->v[i]))
			return false;
	if (vertices == x->edges)
		x->v[x->edges] = pinhole(c->w);
	whole_set_wavelength(c, x, u);
	if (!whole_finish(c, x))
		return false;
	for (unsigned j = 1; j < x->edges; j++)
		if (x->v[j].delta && !(whole_specular_miss(x, j) <= SPECULAR))
			return false;
	return true;
}
