/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/integrators.h"

#include "worker/render/scene/depth.h"

bool integrators_show_other(const struct scene_node *n)
{
	static const char *const others[] = {"emission_reparam",
					     "volprim_rf_basic",
					     "aov",
					     "multichannel",
					     "stokes",
					     "moment",
					     "depth",
					     "field",
					     "ao",
					     "vpl",
					     "irrcache",
					     "sppm",
					     "ppm",
					     "photonmapper"};
	return text_is_among(n->type, others, sizeof others / sizeof *others);
}

bool integrators_are_known(const struct scene_node *n)
{
	static const char *const lights[] = {"path", "volpath", "volpath_simple", "volpathmis", "prbvolpath", "ptracer",
					     "bdpt", "mlt",	"pssmlt",	  "erpt",	"adaptive",   "motion",
					     "hslt"};
	return text_is_among(n->type, lights, sizeof lights / sizeof *lights) || integrators_show_other(n) ||
	       depth_is_direct(n->type) || depth_is_prb(n->type);
}

const struct scene_node *integrators_inner(const struct scene_node *n)
{
	const struct scene_node *inner;
	for (uint32_t i = 0; (inner = node_child(n, PLUGIN_INTEGRATOR, i)); i++)
		if (!integrators_show_other(inner))
			return inner;
	return node_child(n, PLUGIN_INTEGRATOR, 0);
}

/* -1: no limit. around: of the integrator around it, which holds if it states none. `direct` has no such parameter in
 * Mitsuba: what is stated can only shorten its paths. */
static int64_t depth_of(const struct scene_node *n, int64_t around)
{
	int64_t depth = node_int(n, "max_depth", depth_is_prb(n->type) ? SCENE_PRB_DEPTH : around);
	if (depth_is_direct(n->type) && (depth < 0 || depth > SCENE_DIRECT_DEPTH))
		return SCENE_DIRECT_DEPTH;
	return depth;
}

int64_t integrators_depth(const struct scene_node *n)
{
	int64_t depth = -1;
	for (; n; n = integrators_inner(n))
		depth = depth_of(n, depth);
	return depth;
}

const struct scene_node *integrators_without_media(const struct scene_node *n)
{
	static const char *const without[] = {"path", "direct",	   "direct_projective",
					      "prb",  "prb_basic", "prb_projective"};
	for (; n; n = integrators_inner(n))
		if (text_is_among(n->type, without, sizeof without / sizeof *without))
			return n;
	return NULL;
}
