/* SPDX-License-Identifier: Apache-2.0 */
/*
 * rare_light traces light sub-paths, then camera sub-paths, each of which is merged with the photons around it.
 * Contributions count as far as they exceed RENDER_RARE times the brightness of their place.
 *
 * The map of brightness is made from few samples: where they found no light it is too dark. A bright spot in a dark
 * corner would then be called rare however easily it is found, so its photons correct the map (merging_scale). Light
 * that no photon brings to a rough surface visible to the camera is not detected: light through a keyhole, or light
 * from a mirror that is seen in a mirror.
 */
#include "worker/render/rare_light.h"

#include "worker/render/path/merging.h"

struct sums {
	double scale;	     /* 1 / the brightness of the place */
	double here, beyond; /* light of its photons, and the rare part of it */
};

static void add_beyond(void *user, const struct merged *m)
{
	struct sums *s = user;
	s->beyond += s->scale * m->brings * fmax(1 - RENDER_RARE / (s->scale * m->bdpt), 0);
}

int rare_light(struct path_context *c, const struct brightness *map, uint64_t seed, uint64_t step, uint64_t samples,
	       struct rare_light *out)
{
	struct merging m;
	*out = (struct rare_light){0, 0};
	int rc = merging_photons(&m, c, seed, step, samples);
	for (uint64_t i = 0; i < m.paths && m.count && !rc; i++) {
		struct merging_place place;
		struct sums s = {0};
		if (!merging_walk(&m, c, seed, step + 1, i, &place))
			continue;
		s.scale = merging_scale(&m, c, &place, map, &s.here);
		if (!(s.scale > 0))
			continue;
		merging_each(&m, c, &place, add_beyond, &s);
		out->share += s.beyond / (double)m.paths;
		out->seen += s.scale * s.here / (double)m.paths;
	}
	merging_fini(&m);
	return rc;
}
