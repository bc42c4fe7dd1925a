/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What can happen at all in a scene, determined from its description before Embree is built. Each effect decides what
 * is built and run; each is reported as on or off, with the reason and what omitting it saves. The user's choice takes
 * precedence.
 *
 * Adding one: a name and its two texts in effects_text.c, its rule in effects_analyse.c.
 */
#ifndef WORKER_RENDER_WORLD_EFFECTS_H
#define WORKER_RENDER_WORLD_EFFECTS_H

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/emitter/emitter.h"
#include "worker/render/world/summary.h"

enum effect {
	EFFECT_COLOUR,
	EFFECT_WAVELENGTH, /* the mutation of that name */
	EFFECT_DISPERSION,
	EFFECT_APERTURE,
	EFFECT_EMITTER_MOVE, /* x_0 moves on its emitter */
	EFFECT_HALF_VECTORS, /* walks, with the derivatives of half vectors */
	EFFECT_SPECULAR,
	EFFECT_GLOSSY,
	EFFECT_DIFFUSE,
	EFFECT_TRANSMISSION,
	EFFECT_ABSORPTION,
	EFFECT_SCATTERING,
	EFFECT_TEXTURES,
	EFFECT_DISPLACEMENT,
	EFFECT_BUMP,
	EFFECT_ALPHA,
	EFFECT_INSTANCING,
	EFFECT_MOTION,
	EFFECT_COINCIDENCE,
	EFFECT_ENVIRONMENT,
	EFFECT_AREA_LIGHT,
	EFFECT_DELTA_LIGHT,
	EFFECT_MEDIUM_LIGHT,
	EFFECT_TRANSPARENT_SHADOWS,
	EFFECT_REFRACTED_SHADOWS,
	EFFECT_DEPTH,
	EFFECTS
};

/* How an effect may be overridden. */
enum {
	EFFECT_MAY_FORCE_ON = 1,
	EFFECT_MAY_FORCE_OFF = 2,
	EFFECT_OF_THE_SCENE = 4 /* forced off, the image is that of another scene */
};

struct effect_decl {
	const char *name;
	unsigned may;
	const char *saves;  /* what omitting it saves */
	const char *refuse; /* why it cannot be forced, if so */
};
extern const struct effect_decl effect_table[EFFECTS];

/* 1: forced on, -1: forced off, 0: determined by the scene. */
struct effects_choice {
	signed char of[EFFECTS];
	bool any_on;
};

struct effects {
	bool colour; /* if off, no wavelengths are drawn, and a grey value stands for the common illuminant's shape */
	bool dispersion, aperture, specular, glossy, emitter_move;
	bool absorption;	     /* some medium does */
	bool scattering;	     /* some medium scatters or shines: edges are walked through all of them */
	bool medium_light;	     /* some medium shines */
	bool transparent_shadows;    /* connections look through what lets light straight through */
	bool refracted_shadows;	     /* connections to emitters are refracted by what refracts exactly */
	bool media;		     /* absorption or scattering */
	bool joints;		     /* any that joining sub-paths asks about: media, dispersion, transparent and
					refracted shadows */
	bool motion;		     /* paths have a time */
	enum color_shape illuminant; /* of all emitters, if colour is off */
	uint32_t max_depth;	     /* edges of the longest path that can carry light, at most the scene's */
	struct effect_line lines[RENDER_EFFECTS_MAX];
	size_t line_count;
};
_Static_assert((int)EFFECTS <= (int)RENDER_EFFECTS_MAX, "each has its line");

/* Whether a path between camera and light can meet a shape, or why not. */
enum visibility {
	VISIBILITY_YES,
	VISIBILITY_ENCLOSED, /* inside a closed opaque shape that the camera is outside of */
	VISIBILITY_DARK,     /* nothing emits in the scene, or all emitters are enclosed */
	VISIBILITY_DEPTH,    /* paths are too short to scatter */
};

#endif
