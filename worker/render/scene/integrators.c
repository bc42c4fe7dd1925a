/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/integrators.h"

#include "worker/render/scene/depth.h"

/* The integrators of both dialects, and this program's own. */
static const struct {
	const char *type;
	bool shows_other; /* Mitsuba's image shows something other than all light */
	/* Mitsuba's image has no media */
	bool lacks_media;
} types[] = {
	{"path", false, true},
	{"volpath", false, false},
	{"volpath_simple", false, false},
	{"volpathmis", false, false},
	{"prbvolpath", false, false},
	{"ptracer", false, false},
	{"bdpt", false, false},
	{"mlt", false, false},
	{"pssmlt", false, false},
	{"erpt", false, false},
	{"hslt", false, false},
	{"adaptive", false, false},
	{"motion", false, false},
	{"direct", false, true},
	{"direct_projective", false, true},
	{"direct_reparam", false, false},
	{"prb", false, true},
	{"prb_basic", false, true},
	{"prb_projective", false, true},
	{"prb_reparam", false, false},
	{"emission_reparam", true, false},
	{"volprim_rf_basic", true, false},
	{"aov", true, false},
	{"multichannel", true, false},
	{"stokes", true, false},
	{"moment", true, false},
	{"depth", true, false},
	{"field", true, false},
	{"ao", true, false},
	{"vpl", true, false},
	{"irrcache", true, false},
	{"sppm", true, false},
	{"ppm", true, false},
	{"photonmapper", true, false},
};
enum { TYPES = sizeof types / sizeof *types };

/* Returns the index of the type, or TYPES if it is unknown. */
static size_t find_type(const char *type)
{
	size_t i = 0;
	while (i < TYPES && strcmp(types[i].type, type) != 0)
		i++;
	return i;
}

const char *integrator_type_at(size_t i, struct integrator_image *out)
{
	if (i >= TYPES)
		return NULL;
	*out = (struct integrator_image){.shows_other = types[i].shows_other,
					 .is_direct = depth_is_direct(types[i].type),
					 .is_prb = depth_is_prb(types[i].type),
					 .lacks_media = types[i].lacks_media};
	return types[i].type;
}

bool integrator_shows_other(const struct scene_node *n)
{
	size_t i = find_type(n->type);
	return i < TYPES && types[i].shows_other;
}

bool integrator_is_known(const struct scene_node *n)
{
	return find_type(n->type) < TYPES || depth_is_direct(n->type);
}

const struct scene_node *integrator_inner(const struct scene_node *n)
{
	const struct scene_node *inner;
	for (uint32_t i = 0; (inner = node_child(n, PLUGIN_INTEGRATOR, i)); i++)
		if (!integrator_shows_other(inner))
			return inner;
	return node_child(n, PLUGIN_INTEGRATOR, 0);
}

/* Returns the maximum depth of n; -1: no limit. `inherited_depth` is the depth of the enclosing integrator, which
 * applies if n states none. In Mitsuba `direct` has no such parameter, so a stated depth can only shorten its paths.
 */
static int64_t effective_depth(const struct scene_node *n, int64_t inherited_depth)
{
	int64_t depth = node_int(n, "max_depth", depth_is_prb(n->type) ? SCENE_PRB_DEPTH : inherited_depth);
	if (depth_is_direct(n->type) && (depth < 0 || depth > SCENE_DIRECT_DEPTH))
		return SCENE_DIRECT_DEPTH;
	return depth;
}

int64_t integrator_depth(const struct scene_node *n)
{
	int64_t depth = -1;
	for (; n; n = integrator_inner(n))
		depth = effective_depth(n, depth);
	return depth;
}

const struct scene_node *integrator_find_without_media(const struct scene_node *n)
{
	for (; n; n = integrator_inner(n)) {
		size_t i = find_type(n->type);
		if (i < TYPES && types[i].lacks_media)
			return n;
	}
	return NULL;
}

void integrator_offer_types(struct spelling *s)
{
	for (size_t i = 0; i < TYPES; i++)
		spelling_offer(s, types[i].type);
}
