/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/nodes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *alloc_or_abort(struct arena *a, size_t count, size_t size)
{
	void *p = arena_alloc(a, count, size);
	if (!p)
		abort();
	return p;
}

static void add_property(struct arena *a, struct scene_node *n, const char *name, struct value v)
{
	struct property *grown = alloc_or_abort(a, n->property_count + 1, sizeof *grown);
	if (n->property_count)
		memcpy(grown, n->properties, n->property_count * sizeof *grown);
	grown[n->property_count] = (struct property){.name = arena_strdup(a, name), .line = 1, .value = v};
	n->properties = grown;
	n->property_count++;
}

static struct value parse_value(struct arena *a, const char *text)
{
	struct value v = {.type = VALUE_RGB};
	char *end;
	if (sscanf(text, "rgb(%lf,%lf,%lf)", &v.as.rgb[0], &v.as.rgb[1], &v.as.rgb[2]) == 3)
		return v;
	double x = strtod(text, &end);
	if (end != text && *end == 0)
		return (struct value){.type = VALUE_FLOAT, .as.number = x};
	if (strcmp(text, "true") == 0 || strcmp(text, "false") == 0)
		return (struct value){.type = VALUE_BOOL, .as.boolean = *text == 't'};
	char *s = arena_strdup(a, text);
	for (char *p = s; *p; p++)
		if (*p == '_')
			*p = ' ';
	return (struct value){.type = VALUE_STRING, .as.string = s};
}

struct scene_node *node_make(struct arena *a, enum plugin_class cls, const char *text)
{
	struct scene_node *n = alloc_or_abort(a, 1, sizeof *n);
	char *copy = arena_strdup(a, text), *rest = copy;
	*n = (struct scene_node){.cls = cls, .type = strtok_r(copy, " ", &rest), .file = "test", .line = 1};
	for (char *word; (word = strtok_r(NULL, " ", &rest));) {
		char *equals = strchr(word, '=');
		if (!equals)
			abort();
		*equals = 0;
		add_property(a, n, word, parse_value(a, equals + 1));
	}
	return n;
}

void node_add_child(struct arena *a, struct scene_node *n, const struct scene_node *child)
{
	const struct scene_node **grown = alloc_or_abort(a, n->child_count + 1, sizeof *grown);
	for (uint32_t i = 0; i < n->child_count; i++)
		grown[i] = n->children[i];
	grown[n->child_count++] = child;
	n->children = grown;
}

void node_add_ref(struct arena *a, struct scene_node *n, const char *name, const struct scene_node *child)
{
	add_property(a, n, name, (struct value){.type = VALUE_NODE, .as.node = child});
}

void node_add_transform(struct arena *a, struct scene_node *n, const char *name, mat4 transform)
{
	add_property(a, n, name, (struct value){.type = VALUE_TRANSFORM, .as.transform = transform});
}

/* Makes a BSDF and its parts, which are separated by the first of these characters; their parts are separated by the
 * next. */
static struct scene_node *make_nested_node(struct arena *a, char *text, const char *separators);

/* Parses " diffuse", " texture checkerboard", " texture scale texture checkerboard", " phase hg", or a BSDF with
 * parts. */
static struct scene_node *make_part_node(struct arena *a, char *text, const char *separators)
{
	if (*separators && strchr(text, *separators))
		return make_nested_node(a, text, separators);
	char *phase = strstr(text, "phase ");
	if (phase)
		return node_make(a, PLUGIN_PHASE, phase + strlen("phase "));
	char *first = strstr(text, "texture "), *second = first ? strstr(first + 1, " texture ") : NULL;
	if (!first)
		return node_make(a, PLUGIN_BSDF, text);
	if (second)
		*second = 0;
	struct scene_node *n = node_make(a, PLUGIN_TEXTURE, first + strlen("texture "));
	if (second)
		node_add_child(a, n, node_make(a, PLUGIN_TEXTURE, second + strlen(" texture ")));
	return n;
}

/* Adds " @alpha checkerboard" as a texture of that name, and any other part as an unnamed child. */
static void add_part(struct arena *a, struct scene_node *n, char *text, const char *separators)
{
	char *at = strchr(text, '@'), *space = at ? strchr(at, ' ') : NULL;
	if (!space || (*separators && strchr(text, *separators))) {
		node_add_child(a, n, make_part_node(a, text, separators));
		return;
	}
	*space = 0;
	node_add_ref(a, n, at + 1, node_make(a, PLUGIN_TEXTURE, space + 1));
}

static struct scene_node *make_nested_node(struct arena *a, char *text, const char *separators)
{
	const char separator[] = {*separators, 0};
	char *rest = text;
	struct scene_node *n = node_make(a, PLUGIN_BSDF, strtok_r(text, separator, &rest));
	for (char *child; (child = strtok_r(NULL, separator, &rest));)
		add_part(a, n, child, separators + 1);
	return n;
}

struct scene_node *node_make_bsdf(struct arena *a, const char *text)
{
	char copy[512];
	snprintf(copy, sizeof copy, "%s", text);
	return make_nested_node(a, copy, "|/;");
}
