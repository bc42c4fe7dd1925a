/* SPDX-License-Identifier: Apache-2.0 */
/* All plug-ins that a scene may name, and reading a scene with them. Any thread. */
#ifndef WORKER_RENDER_PLUGINS_H
#define WORKER_RENDER_PLUGINS_H

#include "worker/render/world/build.h"

/* Returns all plug-in declarations, for scene_read. */
const struct plugin_decl *render_plugins(void);

/* Reads a scene with all plug-ins: scene_read, or scene_read_lenient if the options have RENDER_LENIENT. */
int render_scene_read(struct scene *s, const struct asset_source *assets, const char *name,
		      const struct scene_define *defines, size_t define_count, const struct render_options *o,
		      struct error *e);
#define RENDER_LENIENT "lenient=yes"

#endif
