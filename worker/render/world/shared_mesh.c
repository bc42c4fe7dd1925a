/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/shared_mesh.h"

#include "worker/render/world/build_motion.h"
#include "worker/render/world/place_mesh.h"

/* Matrices in files have six digits. */
#define RIGID_TOLERANCE 1e-5

/* Whether m consists only of translation, rotation and reflection. */
static bool is_rigid(const mat4 *m)
{
	for (int i = 0; i < 3; i++)
		for (int k = 0; k <= i; k++)
			if (!(fabs(vec3_dot(mat4_column(m, i), mat4_column(m, k)) - (i == k)) <= RIGID_TOLERANCE))
				return false;
	return true;
}

bool shared_mesh_is_allowed(const struct builder *b, const struct listed_shape *s)
{
	if (s->animation)
		return true;
	if (!s->instance || s->use_count < 2 || node_child(s->node, PLUGIN_EMITTER, 0))
		return false;
	mat4 m = node_transform(s->instance, "to_world");
	return placement_is_even(&m) && (!build_is_displaced(b, s->node) || is_rigid(&m));
}

void shared_mesh_decide(struct shared_mesh *m, bool moves)
{
	m->is_shared =
		m->geometry.kind == SHAPE_MESH && m->geometry.mesh.triangle_count >= (moves ? 1 : SHARED_TRIANGLES_MIN);
	if (m->is_shared)
		m->box = build_bounding_box(&m->geometry);
}

int shared_mesh_box(const struct shared_mesh *m, const struct scene_node *instance, struct box *box, struct error *e)
{
	mat4 transform = node_transform(instance, "to_world");
	vec3 half = vec3_scale(0.5, vec3_sub(m->box.max, m->box.min)),
	     center = mat4_point(&transform, vec3_add(m->box.min, half)), size;
	double *out[3] = {&size.x, &size.y, &size.z};
	for (int i = 0; i < 3; i++)
		*out[i] = fabs(transform.m[i][0]) * half.x + fabs(transform.m[i][1]) * half.y +
			  fabs(transform.m[i][2]) * half.z;
	*box = (struct box){vec3_sub(center, size), vec3_add(center, size)};
	double max_norm = fmax(triangle_norm_max(box->min), triangle_norm_max(box->max));
	return max_norm <= MESH_COORDINATE_MAX
		       ? 0
		       : node_error(instance, e, ERANGE, "a vertex lies beyond %g", MESH_COORDINATE_MAX);
}

/* Converts the mesh to floats, in the unit sphere around the middle of its box. */
static int place_in_own_frame(struct builder *b, struct shared_mesh *m, const struct scene_node *node)
{
	vec3 half = vec3_scale(0.5, vec3_sub(m->box.max, m->box.min));
	int exponent = 0;
	frexp(vec3_length(half), &exponent);
	m->center = vec3_add(m->box.min, half);
	m->scale = ldexp(1, -exponent);
	m->is_placed = true;
	int rc = build_place_mesh(b, &m->shape, &m->geometry.mesh, node, m->center, m->scale);
	return rc || m->shape.triangle_count > 0
		       ? rc
		       : node_error(node, b->e, EINVAL, "no triangle of this shape has an area at its own scale");
}

static bool make_mirrored_index(struct shared_mesh *m, struct arena *arena)
{
	if (m->mirrored_index)
		return true;
	m->mirrored_index = arena_alloc(arena, m->shape.triangle_count, sizeof *m->mirrored_index);
	for (uint32_t i = 0; m->mirrored_index && i < m->shape.triangle_count; i++) {
		const uint32_t *t = m->shape.index[i];
		memcpy(m->mirrored_index[i], (uint32_t[3]){t[0], t[2], t[1]}, sizeof m->mirrored_index[i]);
	}
	return m->mirrored_index != NULL;
}

/* Returns the matrix from the mesh's frame to the world. */
static mat4 mesh_to_world(const struct world *w, const struct shared_mesh *m, const mat4 *transform)
{
	mat4 r = *transform;
	vec3 translation = vec3_scale(w->scale, vec3_sub(mat4_point(transform, m->center), w->center));
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			r.m[i][k] *= w->scale / m->scale;
	r.m[0][3] = translation.x;
	r.m[1][3] = translation.y;
	r.m[2][3] = translation.z;
	return r;
}

/* Returns the bounding box of the mesh after rounding to float. */
static struct box float_box(const struct geom_shape *g)
{
	struct box b = box_empty();
	for (uint32_t i = 0; i < g->vertex_count; i++)
		box_grow(&b, triangle_vertex((const float(*)[3])g->position, i));
	return b;
}

static int place_unmoving(const struct builder *b, const struct shared_mesh *m, const struct scene_node *instance,
			  struct placement *p)
{
	mat4 transform = node_transform(instance, "to_world"), matrix = mesh_to_world(b->w, m, &transform);
	return placement_make(p, &matrix, m->box.min, m->box.max) ? 0 : -EINVAL;
}

int shared_mesh_place(struct builder *b, struct shared_mesh *m, const struct scene_node *instance, uint32_t id)
{
	struct world *w = b->w;
	if (!m->is_placed) {
		int rc = place_in_own_frame(b, m, b->shape_nodes[id]);
		if (rc)
			return rc;
		m->box = float_box(&m->shape);
		m->first_shape = id;
		w->shared_mesh_count++;
	}
	struct placement *p = arena_alloc(&w->arena, 1, sizeof *p);
	if (!p)
		return build_out_of_memory(b->e);
	int rc = b->motions[id] ? build_motion_place(b, id, m->center, m->scale, &m->box, p)
				: place_unmoving(b, m, instance, p);
	char place[NODE_PLACE_MAX];
	if (rc == -EINVAL)
		return node_error(instance ? instance : b->shape_nodes[id], b->e, EINVAL,
				  "no triangle of the %.24s in %s has an area there", b->shape_nodes[id]->type,
				  node_place(b->shape_nodes[id], place));
	if (rc)
		return build_out_of_memory(b->e);
	p->first_shape = m->first_shape;
	w->sharing_shape_count++;
	if (p->is_mirrored && !make_mirrored_index(m, &w->arena))
		return build_out_of_memory(b->e);
	struct geom_shape *g = &w->shapes[id];
	*g = m->shape;
	g->placement = p;
	g->unit = w->scale;
	if (p->is_mirrored)
		g->index = m->mirrored_index;
	return 0;
}
