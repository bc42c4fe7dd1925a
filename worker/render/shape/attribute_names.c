/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/attribute_names.h"

#include <stdio.h>
#include <string.h>

static const char *const schemes[] = {"xyzw", "rgba", "0123", "1234"};
enum { SCHEMES = sizeof schemes / sizeof *schemes };

static const char *const colours[][ATTRIBUTE_CHANNELS_MAX] = {
	{"r", "g", "b", "a"},
	{"red", "green", "blue", "alpha"},
	{"diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"},
};

struct attribute_groups attribute_groups_none(const char *kind)
{
	return (struct attribute_groups){.kind = kind, .scheme = -1};
}

static void name_group(const struct attribute_groups *g, const char *base, size_t length, char name[ATTRIBUTE_NAME_MAX])
{
	bool named = strncmp(base, g->kind, strlen(g->kind)) == 0;
	snprintf(name, ATTRIBUTE_NAME_MAX, "%s%.*s", named ? "" : g->kind, (int)length, base);
}

static bool add_group(struct attribute_groups *g, const char *name, uint32_t *group)
{
	if (g->count == ATTRIBUTE_GROUPS_MAX)
		return false;
	*group = g->count++;
	g->of[*group] = (struct attribute_group){.channels = 0};
	memcpy(g->of[*group].name, name, ATTRIBUTE_NAME_MAX);
	return true;
}

static bool is_colour(const char *property, uint32_t *channel)
{
	for (size_t i = 0; i < sizeof colours / sizeof *colours; i++)
		for (*channel = 0; *channel < ATTRIBUTE_CHANNELS_MAX; ++*channel)
			if (strcmp(property, colours[i][*channel]) == 0)
				return true;
	return false;
}

/* Finds or adds the attribute of a colour: its channels belong together even if other properties are between them. */
static bool add_colour(struct attribute_groups *g, uint32_t *group)
{
	char name[ATTRIBUTE_NAME_MAX];
	name_group(g, "color", strlen("color"), name);
	g->scheme = -1;
	for (*group = 0; *group < g->count; ++*group)
		if (strcmp(g->of[*group].name, name) == 0)
			return true;
	return add_group(g, name, group);
}

bool attribute_groups_add(struct attribute_groups *g, const char *property, uint32_t *group, uint32_t *channel)
{
	char name[ATTRIBUTE_NAME_MAX];
	size_t n = strlen(property);
	bool ok = true;
	if (is_colour(property, channel)) {
		ok = add_colour(g, group);
		if (ok)
			g->of[*group].channels |= 1u << *channel;
		return ok;
	}
	const char *ending = n > 2 && property[n - 2] == '_' ? property + n - 1 : NULL;
	if (ending && g->scheme >= 0 && g->count > 0) {
		const char *at = strchr(schemes[g->scheme], *ending);
		*group = g->count - 1;
		*channel = at ? (uint32_t)(at - schemes[g->scheme]) : 0;
		name_group(g, property, n - 2, name);
		if (at && g->of[*group].channels == (1u << *channel) - 1 && strcmp(g->of[*group].name, name) == 0) {
			g->of[*group].channels |= 1u << *channel;
			return true;
		}
	}
	g->scheme = -1;
	for (int s = 0; ending && s < SCHEMES && g->scheme < 0; s++)
		if (schemes[s][0] == *ending)
			g->scheme = s;
	*channel = 0;
	name_group(g, property, g->scheme >= 0 ? n - 2 : n, name);
	if (!add_group(g, name, group))
		return false;
	g->of[*group].channels = 1;
	return true;
}

uint32_t attribute_group_channels(const struct attribute_group *g)
{
	uint32_t n = 0;
	while (n < ATTRIBUTE_CHANNELS_MAX && g->channels >> n & 1)
		n++;
	bool colour = strcmp(g->name, "vertex_color") == 0 || strcmp(g->name, "face_color") == 0;
	return colour && n < 3 && g->channels != 1 ? 0 : n;
}
