/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Parameter tables: what a plug-in understands, declared where it is implemented and used by the scene reader. Names
 * are those of Mitsuba 3 (to_world, int_ior, max_depth); 0.5/0.6 has them in camelCase, which is converted on reading
 * (toWorld, intIOR, maxDepth). The name or type "*" stands for everything that the table does not list.
 */
#ifndef WORKER_RENDER_PLUGIN_PARAM_H
#define WORKER_RENDER_PLUGIN_PARAM_H

enum value_type {
	VALUE_BOOL = 1 << 0,
	VALUE_INT = 1 << 1,
	VALUE_FLOAT = 1 << 2,
	VALUE_STRING = 1 << 3,
	VALUE_POINT = 1 << 4, /* point and vector */
	VALUE_RGB = 1 << 5,   /* also sRGB "#rrggbb" of 0.6, made linear on reading */
	VALUE_SPECTRUM = 1 << 6,
	VALUE_TRANSFORM = 1 << 7,
	VALUE_NODE = 1 << 8, /* a nested or referenced object, by name: a texture, a BSDF */
};
/* The forms of a colour: a number, rgb, a spectrum, a texture. */
#define VALUE_COLOR (VALUE_FLOAT | VALUE_INT | VALUE_RGB | VALUE_SPECTRUM)
#define VALUE_TEXTURE (VALUE_COLOR | VALUE_NODE)
/* The same in space: a number, rgb, a spectrum, a volume. */
#define VALUE_IN_SPACE (1 << 10)
#define VALUE_VOLUME (VALUE_TEXTURE | VALUE_IN_SPACE)
/* The next two are combined with types. Only the plug-in of 3.x has the parameter: in scenes of 0.5/0.6 it is ignored
 * with a note, as in Mitsuba 0.6. */
#define VALUE_OF_3 (1 << 11)
/* Numbers outside of the range are not refused: each counts as the nearer end of the range, with a note. */
#define VALUE_CLIPPED (1 << 12)
/* A transform that may be an <animation>. */
#define VALUE_MOTION (1 << 9)
#define VALUE_PLACE (VALUE_TRANSFORM | VALUE_MOTION)

/* Common ranges. Lengths and matrices: what squares of areas can represent. How far apart things may be, relative to
 * the scene's size, is checked when that is known (PARAM_REACH_MAX). */
#define PARAM_LENGTH_MAX 1e60
#define PARAM_LIGHT_MAX 1e30 /* radiance, irradiance, intensity: sums of it fit a film of float */
#define PARAM_REACH_MAX 1e12 /* distance of cameras and lights from the middle of the scene, in scene radii */
#define PARAM_UV_MAX 1e6     /* factors and offsets of texture coordinates: enough digits remain to select a pixel */
#define PARAM_IOR_MIN 1e-3
#define PARAM_IOR_MAX 1e3
#define PARAM_METAL_MAX 1e9 /* eta and k of conductors */

enum param_class {
	PARAM_UNDERSTOOD,
	PARAM_IGNORED, /* has no effect on light: reported once, with file and line */
	PARAM_DIFFERS, /* changes light a little and is not modelled: a warning, unless the scene says `false` or 0 */
	PARAM_REFUSED, /* would change light: the scene is refused, with what is supported */
};

struct param {
	const char *name;
	unsigned types; /* of enum value_type */
	enum param_class status;
	double min, max; /* for every number in the value, also in points, colours and spectra; outside is an error. min
			    < max for all types with numbers (checked by a test of all tables); textures have their own
			    ranges */
	const char *choices; /* for VALUE_STRING: "beckmann|ggx", NULL: any */
};

/* The end of a row without a range, after its name. */
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

/* Unnamed children (a BSDF in a shape, a film in a sensor) are accepted by class: nested_classes. */
struct plugin_decl {
	enum plugin_class cls;
	const char *type;	    /* as written in type="..." */
	const struct param *params; /* ends with a NULL name; NULL: none */
	unsigned nested_classes;    /* bits 1 << enum plugin_class */
	enum param_class status; /* IGNORED: has no effect except for its understood parameters (samplers), everything
				    else in it is skipped; REFUSED is never listed: unknown plug-ins are refused */
};

/* The parameters of a plug-in, with the row that ends them. */
#define PARAMS(...) ((const struct param[]){__VA_ARGS__, {.name = NULL}})
/* A plug-in that is understood and has nothing nested in it but what its parameters name. */
#define PLUGIN(class, name, ...)                                                   \
	{                                                                          \
		.cls = PLUGIN_##class, .type = name, .params = PARAMS(__VA_ARGS__) \
	}

#endif
