/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/batch.h"

#include "worker/render/scene/film.h"

#include <string.h>

bool node_is_batch(const struct scene_node *n)
{
	return n->cls == PLUGIN_SENSOR && strcmp(n->type, "batch") == 0;
}

static uint32_t count_sensors(const struct scene_node *batch)
{
	uint32_t n = 0;
	while (node_child(batch, PLUGIN_SENSOR, n))
		n++;
	return n;
}

static int check_batch(const struct scene_node *batch, const struct scene_node *film, uint32_t sensors, struct error *e)
{
	static const char *const crop[] = {"crop_offset_x", "crop_offset_y", "crop_width", "crop_height"};
	if (sensors == 0)
		return node_error(batch, e, EINVAL, "needs at least one sensor inside");
	for (uint32_t i = 0; i < sensors; i++)
		if (node_is_batch(node_child(batch, PLUGIN_SENSOR, i)))
			return node_error(batch, e, EINVAL, "a batch may not hold another batch");
	for (size_t i = 0; i < sizeof crop / sizeof *crop; i++)
		if (node_find_property(film, crop[i]))
			return node_error(film, e, ENOTSUP, "a crop window of a batch is not supported");
	int64_t width = node_int(film, "width", SCENE_FILM_WIDTH);
	if (width % sensors != 0)
		return node_error(film, e, EINVAL, "a width of %lld is not a multiple of the batch's %u sensors",
				  (long long)width, sensors);
	return 0;
}

int batch_expand(const struct scene_node *batch, struct arena *arena, const struct scene_node **out, uint32_t *count,
		 struct error *e)
{
	const struct scene_node default_film = {
		.cls = PLUGIN_FILM, .type = "hdrfilm", .file = batch->file, .line = batch->line};
	const struct scene_node *film = node_child(batch, PLUGIN_FILM, 0),
				*sampler = node_child(batch, PLUGIN_SAMPLER, 0);
	uint32_t n = count_sensors(batch);
	film = film ? film : &default_film;
	int r = check_batch(batch, film, n, e);
	if (r)
		return r;
	const struct scene_node **children = arena_alloc(arena, 2, sizeof *children);
	struct scene_node *sensors = arena_alloc(arena, n, sizeof *sensors);
	const struct value width = {.type = VALUE_INT, .as.integer = node_int(film, "width", SCENE_FILM_WIDTH) / n};
	if (!children || !sensors || !(children[0] = node_copy_with_property(film, "width", width, arena)))
		return node_error(batch, e, ENOMEM, "out of memory");
	children[1] = sampler;
	for (uint32_t i = 0; i < n; i++) {
		sensors[i] = *node_child(batch, PLUGIN_SENSOR, i);
		sensors[i].children = children;
		sensors[i].child_count = sampler ? 2 : 1;
		out[i] = &sensors[i];
	}
	*count = n;
	return 0;
}
