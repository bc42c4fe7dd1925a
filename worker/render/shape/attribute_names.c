/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/attribute_names.h"

#include <stdio.h>
#include <string.h>

static const char *const suffix_schemes[] = {"xyzw", "rgba", "0123", "1234"};
enum { SUFFIX_SCHEMES = sizeof suffix_schemes / sizeof *suffix_schemes };

static const char *const colour_names[][ATTRIBUTE_CHANNELS_MAX] = {
	{"r", "g", "b", "a"},
	{"red", "green", "blue", "alpha"},
	{"diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"},
};

struct attribute_groups attribute_groups_make(const char *prefix)
{
	return (struct attribute_groups){.prefix = prefix, .suffix_scheme = -1};
}

static void format_group_name(const struct attribute_groups *g, const char *base, size_t length,
			      char name[ATTRIBUTE_NAME_MAX])
{
	bool has_prefix = strncmp(base, g->prefix, strlen(g->prefix)) == 0;
	snprintf(name, ATTRIBUTE_NAME_MAX, "%s%.*s", has_prefix ? "" : g->prefix, (int)length, base);
}

static bool add_group(struct attribute_groups *g, const char *name, uint32_t *group)
{
	if (g->count == ATTRIBUTE_GROUPS_MAX)
		return false;
	*group = g->count++;
	g->groups[*group] = (struct attribute_group){.channel_mask = 0};
	memcpy(g->groups[*group].name, name, ATTRIBUTE_NAME_MAX);
	return true;
}

static bool find_colour_channel(const char *property, uint32_t *channel)
{
	for (size_t i = 0; i < sizeof colour_names / sizeof *colour_names; i++)
		for (*channel = 0; *channel < ATTRIBUTE_CHANNELS_MAX; ++*channel)
			if (strcmp(property, colour_names[i][*channel]) == 0)
				return true;
	return false;
}

/* Finds or adds the attribute of a colour: its channels belong together even if other properties are between them. */
static bool find_or_add_colour(struct attribute_groups *g, uint32_t *group)
{
	char name[ATTRIBUTE_NAME_MAX];
	format_group_name(g, "color", strlen("color"), name);
	g->suffix_scheme = -1;
	for (*group = 0; *group < g->count; ++*group)
		if (strcmp(g->groups[*group].name, name) == 0)
			return true;
	return add_group(g, name, group);
}

bool attribute_groups_add(struct attribute_groups *g, const char *property, uint32_t *group, uint32_t *channel)
{
	char name[ATTRIBUTE_NAME_MAX];
	size_t n = strlen(property);
	bool ok = true;
	if (find_colour_channel(property, channel)) {
		ok = find_or_add_colour(g, group);
		if (ok)
			g->groups[*group].channel_mask |= 1u << *channel;
		return ok;
	}
	const char *suffix = n > 2 && property[n - 2] == '_' ? property + n - 1 : NULL;
	if (suffix && g->suffix_scheme >= 0 && g->count > 0) {
		const char *match = strchr(suffix_schemes[g->suffix_scheme], *suffix);
		*group = g->count - 1;
		*channel = match ? (uint32_t)(match - suffix_schemes[g->suffix_scheme]) : 0;
		format_group_name(g, property, n - 2, name);
		if (match && g->groups[*group].channel_mask == (1u << *channel) - 1 &&
		    strcmp(g->groups[*group].name, name) == 0) {
			g->groups[*group].channel_mask |= 1u << *channel;
			return true;
		}
	}
	g->suffix_scheme = -1;
	for (int s = 0; suffix && s < SUFFIX_SCHEMES && g->suffix_scheme < 0; s++)
		if (suffix_schemes[s][0] == *suffix)
			g->suffix_scheme = s;
	*channel = 0;
	format_group_name(g, property, g->suffix_scheme >= 0 ? n - 2 : n, name);
	if (!add_group(g, name, group))
		return false;
	g->groups[*group].channel_mask = 1;
	return true;
}

uint32_t attribute_group_channel_count(const struct attribute_group *g)
{
	uint32_t n = 0;
	while (n < ATTRIBUTE_CHANNELS_MAX && g->channel_mask >> n & 1)
		n++;
	bool colour = strcmp(g->name, "vertex_color") == 0 || strcmp(g->name, "face_color") == 0;
	return colour && n < 3 && g->channel_mask != 1 ? 0 : n;
}
