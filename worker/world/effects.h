/*
 * What can happen at all in a scene, read off its description before Embree is built. Each effect decides what is built
 * and run; each is reported on or off, and why.
 */
#ifndef WORKER_WORLD_EFFECTS_H
#define WORKER_WORLD_EFFECTS_H

#include "worker/bsdf/bsdf.h"
#include "worker/emitter/emitter.h"
#include "worker/render/render.h"

struct effects {
	bool displacement;
	bool colour;      /* off: no wavelengths are drawn, one grey value stands for the common illuminant's shape */
	bool dispersion, aperture, specular, glossy, diffuse, transmission, textures, environment, area_light, delta_light;
	enum color_shape illuminant; /* of all emitters, when colour is off */
	uint32_t max_depth;
	struct effect_line lines[RENDER_EFFECTS_MAX];
	size_t line_count;
};

/* Materials and emitters that shapes use (one that no shape uses calls for nothing). */
void effects_analyse(struct effects *fx, const struct scene_settings *settings, const struct bsdf *bsdfs, size_t bsdf_count,
		     const struct emitter *emitters, size_t emitter_count);

/* How many shapes are displaced, and into how many triangles. */
void effects_add_displacement(struct effects *fx, size_t shapes, uint64_t triangles);

#endif
