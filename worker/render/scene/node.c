/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/node.h"

#include "common/base/arena.h"
#include "common/base/text.h"
#include "worker/render/plugin/plugin.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const struct property *node_find_property(const struct scene_node *n, const char *name)
{
	for (uint32_t i = 0; i < n->property_count; i++)
		if (strcmp(n->properties[i].name, name) == 0)
			return &n->properties[i];
	return NULL;
}

const struct scene_node *node_copy_with_property(const struct scene_node *n, const char *name, struct value v,
						 struct arena *arena)
{
	struct scene_node *copy = arena_alloc(arena, 1, sizeof *copy);
	struct property *p = arena_alloc(arena, (size_t)n->property_count + 1, sizeof *p);
	if (!copy || !p)
		return NULL;
	*copy = *n;
	copy->properties = p;
	copy->property_count = 0;
	for (uint32_t i = 0; i < n->property_count; i++)
		if (strcmp(n->properties[i].name, name) != 0)
			p[copy->property_count++] = n->properties[i];
	p[copy->property_count++] = (struct property){name, n->line, v};
	return copy;
}

double node_float(const struct scene_node *n, const char *name, double fallback)
{
	const struct property *p = node_find_property(n, name);
	if (p && p->value.type == VALUE_FLOAT)
		return p->value.as.number;
	return p && p->value.type == VALUE_INT ? (double)p->value.as.integer : fallback;
}

int64_t node_int(const struct scene_node *n, const char *name, int64_t fallback)
{
	const struct property *p = node_find_property(n, name);
	return p && p->value.type == VALUE_INT ? p->value.as.integer : fallback;
}

bool node_bool(const struct scene_node *n, const char *name, bool fallback)
{
	const struct property *p = node_find_property(n, name);
	return p && p->value.type == VALUE_BOOL ? p->value.as.boolean : fallback;
}

const char *node_string(const struct scene_node *n, const char *name, const char *fallback)
{
	const struct property *p = node_find_property(n, name);
	return p && p->value.type == VALUE_STRING ? p->value.as.string : fallback;
}

mat4 node_transform(const struct scene_node *n, const char *name)
{
	const struct property *p = node_find_property(n, name);
	return p && p->value.type == VALUE_TRANSFORM ? p->value.as.transform : mat4_identity();
}

const struct scene_node *node_child(const struct scene_node *n, enum plugin_class cls, uint32_t index)
{
	for (uint32_t i = 0; i < n->child_count; i++)
		if (n->children[i]->cls == cls && index-- == 0)
			return n->children[i];
	return NULL;
}

const struct scene_node *node_ref(const struct scene_node *n, const char *name)
{
	const struct property *p = node_find_property(n, name);
	return p && p->value.type == VALUE_NODE ? p->value.as.node : NULL;
}

const struct animation *node_animation(const struct scene_node *n)
{
	const struct property *p = node_find_property(n, "to_world");
	return p ? p->value.animation : NULL;
}

static bool animations_equal(const struct animation *a, const struct animation *b)
{
	return a == b || (a && b && a->count == b->count && memcmp(a->key, b->key, a->count * sizeof *a->key) == 0);
}

static bool nodes_equal(const struct scene_node *a, const struct scene_node *b, uint32_t *remaining);

static bool values_equal(const struct value *a, const struct value *b, uint32_t *remaining)
{
	if (a->type != b->type)
		return false;
	switch (a->type) {
	case VALUE_BOOL:
		return a->as.boolean == b->as.boolean;
	case VALUE_INT:
		return a->as.integer == b->as.integer;
	case VALUE_FLOAT:
		return a->as.number == b->as.number;
	case VALUE_STRING:
		return strcmp(a->as.string, b->as.string) == 0;
	case VALUE_POINT:
		return memcmp(&a->as.point, &b->as.point, sizeof a->as.point) == 0;
	case VALUE_RGB:
		return memcmp(a->as.rgb, b->as.rgb, sizeof a->as.rgb) == 0;
	case VALUE_SPECTRUM:
		return a->as.spectrum.count == b->as.spectrum.count &&
		       memcmp(a->as.spectrum.value, b->as.spectrum.value, a->as.spectrum.count * sizeof(double)) == 0 &&
		       (a->as.spectrum.count == 1 ||
			memcmp(a->as.spectrum.nm, b->as.spectrum.nm, a->as.spectrum.count * sizeof(double)) == 0);
	case VALUE_TRANSFORM:
		return memcmp(&a->as.transform, &b->as.transform, sizeof a->as.transform) == 0 &&
		       animations_equal(a->animation, b->animation);
	case VALUE_NODE:
		return nodes_equal(a->as.node, b->as.node, remaining);
	}
	return false;
}

/* remaining: how many more objects may be compared; limited, because a few lines can nest objects in each other many
 * times over. */
static bool nodes_equal(const struct scene_node *a, const struct scene_node *b, uint32_t *remaining)
{
	if (a == b)
		return true;
	if (*remaining == 0 || a->cls != b->cls || strcmp(a->type, b->type) != 0 ||
	    a->property_count != b->property_count || a->child_count != b->child_count)
		return false;
	--*remaining;
	for (uint32_t i = 0; i < a->property_count; i++) {
		const struct property *other = node_find_property(b, a->properties[i].name);
		if (!other || !values_equal(&a->properties[i].value, &other->value, remaining))
			return false;
	}
	for (uint32_t i = 0; i < a->child_count; i++)
		if (!nodes_equal(a->children[i], b->children[i], remaining))
			return false;
	return true;
}

bool node_equals(const struct scene_node *a, const struct scene_node *b)
{
	uint32_t remaining = NODE_EQUALS_OBJECTS_MAX;
	return nodes_equal(a, b, &remaining);
}

int node_error(const struct scene_node *n, struct error *e, int errno_value, const char *format, ...)
{
	char text[768];
	va_list ap;
	va_start(ap, format);
	vsnprintf(text, sizeof text, format, ap);
	va_end(ap);
	return error_set(e, errno_value, "%s:%d: <%s type=\"%.64s\">: %s", n->file, n->line, plugin_class_name(n->cls),
			 n->type, text);
}

const char *node_place(const struct scene_node *n, char text[NODE_PLACE_MAX])
{
	/* Leaves room for "...", ":", a line number and the terminating 0. */
	enum { NAME_LENGTH_MAX = NODE_PLACE_MAX - 16 };
	size_t length = strlen(n->file);
	const char *end = n->file + (length > NAME_LENGTH_MAX ? length - NAME_LENGTH_MAX : 0);
	while (end > n->file && ((unsigned char)*end & 0xC0) == 0x80) /* in the middle of a UTF-8 character */
		end++;
	snprintf(text, NODE_PLACE_MAX, "%s%s:%d", length > NAME_LENGTH_MAX ? "..." : "", end, n->line);
	return text;
}

const char *node_title(const struct scene_node *n, char text[NODE_TITLE_MAX])
{
	const char *material = node_string(n, "material", NULL);
	char place[NODE_PLACE_MAX], name[41];
	node_place(n, place);
	text_copy(name, sizeof name, n->id ? n->id : material ? material : "");
	if (n->id)
		snprintf(text, NODE_TITLE_MAX, "`%s` (%s)", name, place);
	else if (material && n->cls == PLUGIN_SHAPE)
		snprintf(text, NODE_TITLE_MAX, "the %.24s in %s (`%s`)", n->type, place, name);
	else
		snprintf(text, NODE_TITLE_MAX, "the %.24s in %s", n->type, place);
	return text;
}
