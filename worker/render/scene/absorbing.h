/* SPDX-License-Identifier: Apache-2.0 */
/* Which media are supported: homogeneous ones that do not scatter, inside or outside of shapes. */
#ifndef WORKER_RENDER_SCENE_ABSORBING_H
#define WORKER_RENDER_SCENE_ABSORBING_H

#include "worker/render/scene/notes.h"
#include "worker/render/scene/param.h"
#include "worker/render/scene/xml.h"

/* A <medium type="homogeneous"> whose sigma_s or albedo is given, and 0 throughout. Without both, Mitsuba's scatter. */
bool medium_only_absorbs(const struct xml_element *el);
/* Any other: an error, or lenient, a note. */
int medium_refuse(const struct notes *k, bool lenient, const struct xml_element *el);
/* One around an emitter or a sensor: `target`, to which `el` may only refer. Those that scatter are reported where they
 * are made; of the others an emitter need not know. */
int medium_elsewhere(const struct notes *k, bool lenient, enum plugin_class owner, const struct xml_element *el,
		     const struct xml_element *target);

#endif
