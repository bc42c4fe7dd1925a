#include "worker/chain/path_chain.h"

/* What technique s contributes to paths of that many edges; 0 where the sub-paths are too short for it. */
static double contribution(struct path_context *c, unsigned s, unsigned edges, unsigned camera, unsigned light)
{
	unsigned t = edges + 1 - s;
	if (t > camera || s > (light > 1 ? light : 1) || (t == 1 && s < 2))
		return 0;
	double film[2];
	struct path_sample one = {.count = 0, .intensity = 0};
	spectrum l = path_connect(c, s, t, PATH_MAX_EDGES, film);
	if (!spectrum_is_zero(l))
		path_splat(c, &one, 0, 0, l);
	return one.intensity;
}

bool path_start(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct whole_path *x)
{
	struct sampler_random s;
	double film[2], choice[SAMPLER_BLOCK], total = 0;
	sampler_random_init(&s, seed, RNG_BOOTSTRAP, bootstrap_index, 0);
	sampler_fill(seed, RNG_BOOTSTRAP, bootstrap_index, 0, SIDE_CAMERA, PATH_MAX_EDGES + 2, choice);
	c->one_way = false;
	unsigned camera = path_walk_camera(c, &s.base, c->max_depth + 1, film);
	unsigned light = path_walk_light(c, &s.base, c->max_depth);
	struct {
		double intensity;
		unsigned s, edges;
	} of[WHOLE_MAX_VERTICES * WHOLE_MAX_VERTICES];
	unsigned count = 0;
	for (unsigned edges = c->min_depth; edges <= c->max_depth; edges++)
		for (unsigned j = 0; j <= edges; j++) {
			double i = contribution(c, j, edges, camera, light);
			if (!(i > 0))
				continue;
			of[count].intensity = i;
			of[count].s = j;
			of[count++].edges = edges;
			total += i;
		}
	if (count == 0)
		return false;
	double rest = choice[0] * total;
	unsigned chosen = 0;
	while (chosen + 1 < count && rest >= of[chosen].intensity)
		rest -= of[chosen++].intensity;
	return whole_from_subpaths(c, of[chosen].s, of[chosen].edges, x);
}
