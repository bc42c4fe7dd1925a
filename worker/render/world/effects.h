/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Effects: the features that a scene can use, determined from its description before Embree's tree is built. Each
 * effect decides what is built and run; each is reported as on or off, with the reason and what omitting it saves. The
 * user's choice takes precedence.
 *
 * To add an effect: its name and texts go into effects.c, its rule into effects_analyse.c.
 */
#ifndef WORKER_RENDER_WORLD_EFFECTS_H
#define WORKER_RENDER_WORLD_EFFECTS_H

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/emitter/emitter.h"
#include "worker/render/world/summary.h"

enum effect {
	EFFECT_COLOUR,
	EFFECT_WAVELENGTH, /* the wavelength mutation */
	EFFECT_DISPERSION,
	EFFECT_APERTURE,
	EFFECT_EMITTER_MOVE, /* mutations move x_0 on its emitter */
	EFFECT_HALF_VECTORS, /* half vector walks and derivatives */
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

/* How the user may override an effect. */
enum {
	EFFECT_MAY_FORCE_ON = 1,
	EFFECT_MAY_FORCE_OFF = 2,
	EFFECT_CHANGES_SCENE = 4 /* if it is forced off, the image shows a different scene */
};

struct effect_decl {
	const char *name;
	unsigned override_flags;
	const char *savings; /* what omitting it saves */
	const char *refusal; /* why it cannot be forced; NULL if it can */
};
extern const struct effect_decl effect_table[EFFECTS];

/* 1: forced on, -1: forced off, 0: determined by the scene. */
struct effects_override {
	signed char states[EFFECTS];
	bool forces_any_on;
};

struct effects {
	/* If off, no wavelengths are drawn, and a grey value scales the spectrum that all emitters share. */
	bool colour;
	bool dispersion, aperture, specular, glossy, emitter_move;
	bool absorption;	  /* some medium absorbs */
	bool scattering;	  /* some medium scatters or emits: edges are walked through all media */
	bool medium_light;	  /* some medium emits */
	bool transparent_shadows; /* connections look through surfaces that let light straight through */
	bool refracted_shadows;	  /* connections to emitters are refracted at exactly specular surfaces */
	bool media;		  /* absorption or scattering */
	/* Any effect that matters when sub-paths are joined: media, dispersion, transparent or refracted shadows. */
	bool has_joint_effects;
	bool motion;		    /* paths have a time */
	enum color_kind illuminant; /* spectrum shared by all emitters, if colour is off */
	/* Edges of the longest path that can carry light, at most the scene's max_depth. */
	uint32_t max_depth;
	struct effect_line effect_lines[RENDER_EFFECTS_MAX];
	size_t effect_line_count;
};
_Static_assert((int)EFFECTS <= (int)RENDER_EFFECTS_MAX, "each has its line");

/* Whether a path between camera and light can meet a shape, or why it cannot. */
enum visibility {
	VISIBILITY_VISIBLE,
	VISIBILITY_ENCLOSED,  /* inside a closed opaque shape while the camera is outside */
	VISIBILITY_DARK,      /* nothing in the scene emits, or all emitters are enclosed */
	VISIBILITY_TOO_SHORT, /* paths are too short to scatter */
};

#endif
