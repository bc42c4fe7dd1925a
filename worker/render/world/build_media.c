/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/build_media.h"

#include "worker/render/world/node_table.h"

/* Gives the shape's medium of that name its number, 1 + its index in the order of first use; 0: it has none. */
static uint32_t number_medium(const struct scene_node *shape, const char *name, struct node_table *numbers)
{
	const struct scene_node *n = node_ref(shape, name);
	uint32_t number = 0;
	if (n && !node_table_find(numbers, n, NULL, &number)) {
		number = (uint32_t)numbers->count + 1;
		node_table_add(numbers, n, NULL, number);
	}
	return number;
}

static int create_medium(struct builder *b, const struct scene_node *shape, const char *name, uint32_t number)
{
	struct world *w = b->w;
	if (number <= w->media_count) /* none, or one that is made */
		return 0;
	int rc = medium_create(&w->media[w->media_count++], node_ref(shape, name), w->scale, &w->arena, b->e);
	return rc ? build_go_on(b, rc) : 0;
}

int build_media(struct builder *b)
{
	struct world *w = b->w;
	struct node_table numbers;
	uint32_t uses = 0;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		uses += node_ref(b->shape_nodes[i], "interior") ? 1 : 0;
		uses += node_ref(b->shape_nodes[i], "exterior") ? 1 : 0;
	}
	if (!uses)
		return 0;
	if (node_table_init(&numbers, uses, &b->scratch))
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		w->parts[i].interior = number_medium(b->shape_nodes[i], "interior", &numbers);
		w->parts[i].exterior = number_medium(b->shape_nodes[i], "exterior", &numbers);
	}
	w->media = arena_alloc(&w->arena, numbers.count, sizeof *w->media);
	if (!w->media)
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		int rc = create_medium(b, b->shape_nodes[i], "interior", w->parts[i].interior);
		if (!rc)
			rc = create_medium(b, b->shape_nodes[i], "exterior", w->parts[i].exterior);
		if (rc)
			return rc;
	}
	return 0;
}
