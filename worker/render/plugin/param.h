/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Parameter tables: which parameters a plug-in understands. Each table is declared where the plug-in is implemented and
 * is used by the scene reader. Names are those of Mitsuba 3 (to_world, int_ior, max_depth); the camelCase names of
 * 0.5/0.6 (toWorld, intIOR, maxDepth) are converted on reading. The name or type "*" stands for everything that the
 * table does not list.
 */
#ifndef WORKER_RENDER_PLUGIN_PARAM_H
#define WORKER_RENDER_PLUGIN_PARAM_H

enum value_type {
	VALUE_BOOL = 1 << 0,
	VALUE_INT = 1 << 1,
	VALUE_FLOAT = 1 << 2,
	VALUE_STRING = 1 << 3,
	VALUE_POINT = 1 << 4, /* point or vector */
	VALUE_RGB = 1 << 5,   /* also 0.6's <srgb> "#rrggbb", made linear on reading */
	VALUE_SPECTRUM = 1 << 6,
	VALUE_TRANSFORM = 1 << 7,
	VALUE_NODE = 1 << 8, /* a nested or referenced object, such as a texture or a BSDF, given by name */
};
/* A colour: a number, rgb or a spectrum. */
#define VALUE_COLOR (VALUE_FLOAT | VALUE_INT | VALUE_RGB | VALUE_SPECTRUM)
/* A colour or a texture. */
#define VALUE_TEXTURE (VALUE_COLOR | VALUE_NODE)
/* Combined with VALUE_NODE: the object is a volume, not a texture. */
#define VALUE_IS_VOLUME (1 << 10)
#define VALUE_VOLUME (VALUE_TEXTURE | VALUE_IS_VOLUME)
/* Combined with types: only Mitsuba 3's plug-in has the parameter. In scenes of 0.5/0.6 it is ignored with a note,
 * as Mitsuba 0.6 ignores it. */
#define VALUE_DIALECT_3_ONLY (1 << 11)
/* Combined with types: a number outside the range is not refused but clamped to it, with a note. */
#define VALUE_CLAMPED (1 << 12)
/* Combined with VALUE_TRANSFORM: the transform may be an <animation>. */
#define VALUE_ANIMATION (1 << 9)
#define VALUE_TRANSFORM_OR_ANIMATION (VALUE_TRANSFORM | VALUE_ANIMATION)

/* Common ranges. PARAM_LENGTH_MAX bounds lengths and entries of matrices so that squares of areas can be
 * represented. Distances relative to the scene's size are checked later, when that size is known (PARAM_DISTANCE_MAX).
 */
#define PARAM_LENGTH_MAX 1e60
#define PARAM_LIGHT_MAX 1e30	/* radiance, irradiance, intensity: their sums fit into a film of floats */
#define PARAM_DISTANCE_MAX 1e12 /* distance of cameras and lights from the centre of the scene, in scene radii */
#define PARAM_UV_MAX 1e6	/* factors and offsets of texture coordinates: leaves enough digits to select a pixel */
#define PARAM_IOR_MIN 1e-3
#define PARAM_IOR_MAX 1e3
#define PARAM_METAL_MAX 1e9 /* eta and k of conductors */

enum param_status {
	PARAM_UNDERSTOOD,
	PARAM_IGNORED, /* has no effect on light: reported once, with file and line */
	PARAM_DIFFERS, /* changes light a little and is not modelled: a warning, unless its value is `false` or 0 */
	PARAM_REFUSED, /* would change light: the scene is refused, and the error says what is supported */
};

struct param {
	const char *name;
	unsigned types; /* of enum value_type */
	enum param_status status;
	double min, max; /* Range of every number in the value, including those in points, colours and spectra; a number
			    outside it is an error. min < max for all types with numbers, which a test checks for all
			    tables. Textures have ranges of their own. */
	const char *choices; /* the values allowed for VALUE_STRING, as in "beckmann|ggx"; NULL: any */
};

/* What follows the name in a row that has no range. */
#define UNDERSTOOD(types) types, PARAM_UNDERSTOOD, 0, 0, NULL
#define IGNORED 0, PARAM_IGNORED, 0, 0, NULL
#define REFUSED 0, PARAM_REFUSED, 0, 0, NULL

enum plugin_class {
	PLUGIN_SHAPE,
	PLUGIN_BSDF,
	PLUGIN_TEXTURE,
	PLUGIN_EMITTER,
	PLUGIN_SENSOR,
	PLUGIN_FILM,
	PLUGIN_RFILTER,
	PLUGIN_SAMPLER,
	PLUGIN_INTEGRATOR,
	PLUGIN_MEDIUM,
	PLUGIN_PHASE,
	PLUGIN_VOLUME,
	PLUGIN_CLASSES,
};

/* nested_classes are the classes of objects that may be nested without a name, such as a BSDF in a shape or a film
 * in a sensor. */
struct plugin_decl {
	enum plugin_class cls;
	const char *type;	    /* as written in type="..." */
	const struct param *params; /* ends with a row whose name is NULL; NULL: no parameters */
	unsigned nested_classes;    /* bits 1 << enum plugin_class */
	enum param_status status;   /* PARAM_IGNORED: only the parameters that it understands have an effect, as for
				      samplers. Never PARAM_REFUSED: a plug-in that is not listed is refused. */
};

/* A list of parameters, terminated. */
#define PARAMS(...) ((const struct param[]){__VA_ARGS__, {.name = NULL}})
/* A plug-in that is understood and accepts no nested objects other than those its parameters name. */
#define PLUGIN(class, name, ...)                                                   \
	{                                                                          \
		.cls = PLUGIN_##class, .type = name, .params = PARAMS(__VA_ARGS__) \
	}

#endif
