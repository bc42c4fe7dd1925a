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

struct animation_reader {
	struct gltf *g;
	const json_t *samplers;
	uint64_t value_count; /* read so far */
};

/* What a channel changes: `value_count` numbers of a node. They follow `skip_count` others in the first `vector_count`
 * vectors of the accessor. */
struct animation_channel {
	struct gltf_entry node, output;
	const char *path;
	uint64_t value_count, skip_count, vector_count;
	unsigned components;
};

/* Returns the number of morph targets of a node's mesh. */
static uint64_t morph_target_count(struct gltf *g, const struct gltf_entry *node)
{
	struct gltf_entry mesh;
	if (gltf_resolve(g, node, node->json, "mesh", GLTF_MESHES, &mesh) <= 0)
		return 0;
	return json_array_size(json_object_get(json_array_get(json_object_get(mesh.json, "primitives"), 0), "targets"));
}

/* Returns false if the channel is left out, or after a failure. */
static bool read_channel(struct animation_reader *a, const json_t *json, struct animation_channel *c)
{
	struct gltf *g = a->g;
	const json_t *target = gltf_object(g, NULL, json, "target"),
		     *sampler = json_array_get(a->samplers, gltf_integer(g, NULL, json, "sampler", SIZE_MAX));
	c->path = gltf_string(g, NULL, target, "path", "");
	bool is_rotation = strcmp(c->path, "rotation") == 0, is_weights = strcmp(c->path, "weights") == 0,
	     is_translation_or_scale = strcmp(c->path, "translation") == 0 || strcmp(c->path, "scale") == 0,
	     is_supported = target && json_object_get(target, "node") &&
			    (is_rotation || is_weights || is_translation_or_scale);
	if (is_supported && !json_is_object(sampler))
		gltf_fail(g, NULL, EINVAL, "animations[0]: a channel without a sampler");
	if (!is_supported || g->error_code || gltf_resolve(g, NULL, target, "node", GLTF_NODES, &c->node) <= 0 ||
	    gltf_resolve(g, NULL, sampler, "output", GLTF_ACCESSORS, &c->output) <= 0 ||
	    json_object_get(c->output.json, "sparse")) {
		gltf_note(
			g,
			"animations of anything but the placement and weights of nodes, and those in sparse accessors, are ignored");
		return false;
	}
	bool is_cubic = strcmp(gltf_string(g, NULL, sampler, "interpolation", ""), "CUBICSPLINE") == 0;
	c->value_count = is_weights ? morph_target_count(g, &c->node) : is_rotation ? 4 : 3;
	c->components = is_weights ? 1 : (unsigned)c->value_count;
	c->vector_count = (is_weights ? c->value_count : 1) * (is_cubic ? 3 : 1);
	c->skip_count = is_cubic ? c->value_count : 0;
	a->value_count += c->skip_count + c->value_count;
	if (a->value_count > VALUES_MAX)
		gltf_fail(g, NULL, E2BIG, "more than %d values at the beginning of the animation", VALUES_MAX);
	return c->value_count > 0 && !g->error_code;
}

/* Reads the values, from a copy of the accessor that is shortened to the vectors needed. NULL after a failure. */
static json_t *read_first_values(struct gltf *g, const struct animation_channel *c)
{
	struct gltf_vectors v;
	struct gltf_entry shortened = c->output;
	json_t *copy = json_copy(json_array_get(json_object_get(g->root, "accessors"), c->output.index)),
	       *values = json_array();
	shortened.json = copy;
	if (!copy || !values || json_object_set_new(copy, "count", json_integer((json_int_t)c->vector_count)))
		gltf_fail(g, &c->output, ENOMEM, "out of memory");
	else if (gltf_integer(g, &c->output, c->output.json, "count", 0) < c->vector_count)
		gltf_fail(g, &c->output, EINVAL, "fewer values than the animation needs");
	else if (gltf_vectors_read(g, &shortened, "animation", c->components, &v)) {
		for (uint64_t i = 0; i < c->value_count; i++)
			if (json_array_append_new(values, json_real(v.values[c->skip_count + i])))
				gltf_fail(g, &c->output, EINVAL, "a value that is not finite");
		gltf_vectors_fini(&v);
	}
	json_decref(copy);
	if (!g->error_code)
		return values;
	json_decref(values);
	return NULL;
}

void gltf_apply_animation_start(struct gltf *g)
{
	const json_t *first = json_array_get(json_object_get(g->root, "animations"), 0),
		     *channels = json_object_get(first, "channels");
	struct animation_reader a = {g, json_object_get(first, "samplers"), 0};
	json_t *nodes = json_object_get(g->root, "nodes");
	char text[160];
	for (size_t i = 0; i < json_array_size(channels) && !g->error_code; i++) {
		struct animation_channel c;
		json_t *values = read_channel(&a, json_array_get(channels, i), &c) ? read_first_values(g, &c) : NULL;
		if (values && json_object_set_new(json_array_get(nodes, c.node.index), c.path, values))
			gltf_fail(g, &c.node, ENOMEM, "out of memory");
	}
	const char *name = json_string_value(json_object_get(first, "name"));
	snprintf(text, sizeof text, "nothing moves: everything is where it is when the first animation%s%.64s%s begins",
		 name ? ", `" : "", name ? name : "", name ? "`," : "");
	if (json_array_size(channels))
		gltf_note(g, text);
}
