/* SPDX-License-Identifier: Apache-2.0 */
/* All plug-ins that a scene may name, collected from the registries for the scene reader. */
#include "worker/render/plugins.h"

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/emitter/emitter.h"
#include "worker/render/medium/medium.h"
#include "worker/render/settings/accuracy_settings.h"
#include "worker/render/shape/shape.h"
#include "worker/render/volume/volume.h"

#include <assert.h>
#include <pthread.h>

enum { PLUGINS_MAX = 128 };

static struct plugin_decl decls[PLUGINS_MAX];
static size_t decl_count;

static void add_plugin(struct plugin_decl d)
{
	assert(decl_count + 1 < PLUGINS_MAX);
	decls[decl_count++] = d;
}

static void gather_plugins(void)
{
	for (size_t i = 0; shape_registry[i]; i++)
		add_plugin(shape_registry[i]->decl);
	for (const struct plugin_decl *d = setting_decls; d->type; d++)
		add_plugin(*d);
	for (size_t i = 0; bsdf_registry[i]; i++)
		add_plugin(bsdf_registry[i]->decl);
	for (size_t i = 0; texture_registry[i]; i++)
		add_plugin(texture_registry[i]->decl);
	for (const struct plugin_decl *d = medium_decls; d->type; d++)
		add_plugin(*d);
	for (const struct plugin_decl *d = volume_decls; d->type; d++)
		add_plugin(*d);
	for (size_t i = 0; phase_registry[i]; i++)
		add_plugin(phase_registry[i]->decl);
	for (size_t i = 0; emitter_registry[i]; i++)
		add_plugin(emitter_registry[i]->decl);
}

const struct plugin_decl *render_plugins(void)
{
	static pthread_once_t gather_once = PTHREAD_ONCE_INIT;
	pthread_once(&gather_once, gather_plugins);
	return decls;
}

int render_scene_read(struct scene *s, const struct asset_source *assets, const char *name,
		      const struct scene_define *defines, size_t define_count, const struct render_options *o,
		      struct error *e)
{
	struct accuracy_settings k;
	int code = accuracy_settings_read(o->accuracy, &k, e);
	if (code)
		return code;
	return (k.lenient > 0 ? scene_read_lenient : scene_read)(s, assets, name, render_plugins(), defines,
								 define_count, e);
}
