/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/scene_tables.h"

#include "worker/render/medium/medium.h"
#include "worker/render/volume/volume.h"

#include <assert.h>

#define UNDERSTOOD(types) types, PARAM_UNDERSTOOD, 0, 0, NULL
#define END                            \
	{                              \
		NULL, 0, 0, 0, 0, NULL \
	}

static const struct param diffuse_params[] = {{"reflectance", UNDERSTOOD(VALUE_TEXTURE)}, END};
static const struct param rough_params[] = {
	{"alpha", VALUE_FLOAT, PARAM_UNDERSTOOD, 1e-4, 1, NULL},
	{"distribution", VALUE_STRING, PARAM_UNDERSTOOD, 0, 0, "beckmann|ggx"},
	{"material", UNDERSTOOD(VALUE_STRING)},
	{"eta", UNDERSTOOD(VALUE_COLOR)},
	{"k", UNDERSTOOD(VALUE_COLOR)},
	{"ext_eta", UNDERSTOOD(VALUE_FLOAT)},
	{"int_ior", UNDERSTOOD(VALUE_FLOAT | VALUE_STRING)},
	{"ext_ior", UNDERSTOOD(VALUE_FLOAT | VALUE_STRING)},
	{"specular_reflectance", UNDERSTOOD(VALUE_TEXTURE)},
	{"sample_visible", 0, PARAM_IGNORED, 0, 0, NULL},
	{"nonlinear", 0, PARAM_REFUSED, 0, 0, NULL},
	END,
};
static const struct param phong_params[] = {
	{"diffuse_reflectance", UNDERSTOOD(VALUE_TEXTURE)},
	{"specular_reflectance", UNDERSTOOD(VALUE_TEXTURE)},
	{"exponent", UNDERSTOOD(VALUE_FLOAT)},
	END,
};
static const struct param bitmap_params[] = {
	{"filename", UNDERSTOOD(VALUE_STRING)},
	{"uvscale", UNDERSTOOD(VALUE_FLOAT)},
	{"raw", UNDERSTOOD(VALUE_BOOL)},
	{"gamma", 0, PARAM_IGNORED, 0, 0, NULL},
	END,
};
static const struct param checkerboard_params[] = {
	{"color0", UNDERSTOOD(VALUE_TEXTURE)},
	{"color1", UNDERSTOOD(VALUE_TEXTURE)},
	END,
};
static const struct param area_params[] = {{"radiance", UNDERSTOOD(VALUE_COLOR)}, END};
static const struct param no_params[] = {END};

static const struct plugin_decl test_plugins[] = {
	{PLUGIN_BSDF, "diffuse", diffuse_params, 0, PARAM_UNDERSTOOD},
	{PLUGIN_BSDF, "roughconductor", rough_params, 0, PARAM_UNDERSTOOD},
	{PLUGIN_BSDF, "dielectric", rough_params, 0, PARAM_UNDERSTOOD},
	{PLUGIN_BSDF, "roughdielectric", rough_params, 0, PARAM_UNDERSTOOD},
	{PLUGIN_BSDF, "phong", phong_params, 0, PARAM_UNDERSTOOD},
	{PLUGIN_BSDF, "twosided", no_params, 1u << PLUGIN_BSDF, PARAM_UNDERSTOOD},
	{PLUGIN_TEXTURE, "bitmap", bitmap_params, 0, PARAM_UNDERSTOOD},
	{PLUGIN_TEXTURE, "checkerboard", checkerboard_params, 0, PARAM_UNDERSTOOD},
	{PLUGIN_EMITTER, "area", area_params, 0, PARAM_UNDERSTOOD},
};

const struct plugin_decl *scene_tables(void)
{
	static struct plugin_decl all[64];
	size_t n = 0;
	for (size_t i = 0; i < sizeof test_plugins / sizeof *test_plugins; i++)
		all[n++] = test_plugins[i];
	for (size_t i = 0; shape_registry[i]; i++)
		all[n++] = shape_registry[i]->decl;
	for (const struct plugin_decl *d = setting_decls; d->type; d++)
		all[n++] = *d;
	for (const struct plugin_decl *d = medium_decls; d->type; d++)
		all[n++] = *d;
	for (const struct plugin_decl *d = volume_decls; d->type; d++)
		all[n++] = *d;
	for (size_t i = 0; phase_registry[i]; i++)
		all[n++] = phase_registry[i]->decl;
	assert(n < sizeof all / sizeof *all);
	all[n] = (struct plugin_decl){0};
	return all;
}
