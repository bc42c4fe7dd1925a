/* SPDX-License-Identifier: Apache-2.0 */
/*
 * rare_light_estimate traces light sub-paths, then camera sub-paths, each of which is merged with the photons around
 * it. Contributions count as far as they exceed RENDER_RARE_FACTOR times the brightness of their place.
 *
 * The map of brightness is made from few samples: where they found no light it is too dark. A bright spot in a dark
 * corner would then be called rare however easily it is found, so its photons correct the map
 * (merging_inverse_brightness). Light that no photon brings to a rough surface visible to the camera is not detected:
 * light through a keyhole, or light from a mirror that is seen in a mirror.
 */
#include "worker/render/rare_light.h"

#include "worker/render/path/merging.h"

struct rare_light_sums {
	double scale;		  /* 1 / the brightness of the place */
	double light, rare_light; /* light of its photons, and the rare part of it */
};

static void add_rare_light(void *user, const struct merged_path *m)
{
	struct rare_light_sums *s = user;
	s->rare_light +=
		s->scale * m->contribution * fmax(1 - RENDER_RARE_FACTOR / (s->scale * m->bdpt_contribution), 0);
}

int rare_light_estimate(struct path_context *c, const struct brightness *map, uint64_t seed, uint64_t step,
			uint64_t samples, struct rare_light *out)
{
	struct merging m;
	*out = (struct rare_light){0, 0};
	int rc = merging_trace_photons(&m, c, seed, step, samples);
	for (uint64_t i = 0; i < m.path_count && m.photon_count && !rc; i++) {
		struct merging_point point;
		struct rare_light_sums s = {0};
		if (!merging_walk_camera(&m, c, seed, step + 1, i, &point))
			continue;
		s.scale = merging_inverse_brightness(&m, c, &point, map, &s.light);
		if (!(s.scale > 0))
			continue;
		merging_visit_paths(&m, c, &point, add_rare_light, &s);
		out->rare_share += s.rare_light / (double)m.path_count;
		out->seen_share += s.scale * s.light / (double)m.path_count;
	}
	merging_fini(&m);
	return rc;
}
