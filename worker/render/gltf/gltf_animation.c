/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Exporters write figures in the position in which their skin was bound, with arms stretched out, and their poses as
 * animations. Therefore the scene is shown as the first animation begins: the first value of each channel (glTF 2.0,
 * section 3.11; for cubic splines, the one between its tangents) replaces the node's own translation, rotation, scale
 * or weights. Only these values are read, however long the animation is.
 *
 * Failures: missing samplers, nodes or accessors, and fewer values than a node needs. Channels for other properties
 * than these four, and values in sparse accessors, are left out with a note.
 */
#include "worker/render/gltf/gltf_animation.h"

#include "worker/render/gltf/gltf_numbers.h"

#include <stdio.h>
#include <string.h>

enum { VALUES_MAX = 1 << 22 }; /* for all channels together */

struct animation {
	struct gltf *g;
	const json_t *samplers;
	uint64_t values; /* number of values read so far */
};

/* What a channel changes: `count` numbers of a node. They follow `skip` others in the first `vectors` vectors of the
 * accessor. */
struct channel {
	struct gltf_at node, output;
	const char *path;
	uint64_t count, skip, vectors;
	unsigned components;
};

/* Returns the number of morph targets of a node's mesh. */
static uint64_t targets_of(struct gltf *g, const struct gltf_at *node)
{
	struct gltf_at mesh;
	if (gltf_follow(g, node, node->json, "mesh", GLTF_MESHES, &mesh) <= 0)
		return 0;
	return json_array_size(json_object_get(json_array_get(json_object_get(mesh.json, "primitives"), 0), "targets"));
}

/* Returns false if the channel is left out, or after a failure. */
static bool read_channel(struct animation *a, const json_t *json, struct channel *c)
{
	struct gltf *g = a->g;
	const json_t *target = gltf_object(g, NULL, json, "target"),
		     *sampler = json_array_get(a->samplers, gltf_whole(g, NULL, json, "sampler", SIZE_MAX));
	c->path = gltf_text(g, NULL, target, "path", "");
	bool turn = strcmp(c->path, "rotation") == 0, weights = strcmp(c->path, "weights") == 0,
	     place = strcmp(c->path, "translation") == 0 || strcmp(c->path, "scale") == 0,
	     known = target && json_object_get(target, "node") && (turn || weights || place);
	if (known && !json_is_object(sampler))
		gltf_fail(g, NULL, EINVAL, "animations[0]: a channel without a sampler");
	if (!known || g->failed || gltf_follow(g, NULL, target, "node", GLTF_NODES, &c->node) <= 0 ||
	    gltf_follow(g, NULL, sampler, "output", GLTF_ACCESSORS, &c->output) <= 0 ||
	    json_object_get(c->output.json, "sparse")) {
		gltf_note(
			g,
			"animations of anything but the placement and weights of nodes, and those in sparse accessors, are ignored");
		return false;
	}
	bool cubic = strcmp(gltf_text(g, NULL, sampler, "interpolation", ""), "CUBICSPLINE") == 0;
	c->count = weights ? targets_of(g, &c->node) : turn ? 4 : 3;
	c->components = weights ? 1 : (unsigned)c->count;
	c->vectors = (weights ? c->count : 1) * (cubic ? 3 : 1);
	c->skip = cubic ? c->count : 0;
	a->values += c->skip + c->count;
	if (a->values > VALUES_MAX)
		gltf_fail(g, NULL, E2BIG, "more than %d values at the beginning of the animation", VALUES_MAX);
	return c->count > 0 && !g->failed;
}

/* Reads the values, from a copy of the accessor that is shortened to the vectors needed. NULL after a failure. */
static json_t *first_values(struct gltf *g, const struct channel *c)
{
	struct gltf_vectors v;
	struct gltf_at part = c->output;
	json_t *copy = json_copy(json_array_get(json_object_get(g->root, "accessors"), c->output.index)),
	       *values = json_array();
	part.json = copy;
	if (!copy || !values || json_object_set_new(copy, "count", json_integer((json_int_t)c->vectors)))
		gltf_fail(g, &c->output, ENOMEM, "out of memory");
	else if (gltf_whole(g, &c->output, c->output.json, "count", 0) < c->vectors)
		gltf_fail(g, &c->output, EINVAL, "fewer values than the animation needs");
	else if (gltf_vectors_read(g, &part, "animation", c->components, &v)) {
		for (uint64_t i = 0; i < c->count; i++)
			if (json_array_append_new(values, json_real(v.x[c->skip + i])))
				gltf_fail(g, &c->output, EINVAL, "a value that is not finite");
		gltf_vectors_fini(&v);
	}
	json_decref(copy);
	if (!g->failed)
		return values;
	json_decref(values);
	return NULL;
}

void gltf_animation_begin(struct gltf *g)
{
	const json_t *first = json_array_get(json_object_get(g->root, "animations"), 0),
		     *channels = json_object_get(first, "channels");
	struct animation a = {g, json_object_get(first, "samplers"), 0};
	json_t *nodes = json_object_get(g->root, "nodes");
	char text[160];
	for (size_t i = 0; i < json_array_size(channels) && !g->failed; i++) {
		struct channel c;
		json_t *values = read_channel(&a, json_array_get(channels, i), &c) ? first_values(g, &c) : NULL;
		if (values && json_object_set_new(json_array_get(nodes, c.node.index), c.path, values))
			gltf_fail(g, &c.node, ENOMEM, "out of memory");
	}
	const char *name = json_string_value(json_object_get(first, "name"));
	snprintf(text, sizeof text, "nothing moves: everything is where it is when the first animation%s%.64s%s begins",
		 name ? ", `" : "", name ? name : "", name ? "`," : "");
	if (json_array_size(channels))
		gltf_note(g, text);
}
