/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Spectra of scene files: <spectrum value="..."/> and filename="....spd", <spectrum type="..."> of 3.x, <blackbody> of
 * 0.6. For light and surfaces alike, they become a constant or a table of wavelengths and values (struct value). One
 * thread; allocates in the arena.
 */
#ifndef WORKER_RENDER_SCENE_SPECTRAL_H
#define WORKER_RENDER_SCENE_SPECTRAL_H

#include "worker/render/asset/asset.h"
#include "worker/render/scene/node.h"
#include "worker/render/xml/xml.h"

#include <stdbool.h>
#include <stddef.h>

enum { SPECTRAL_POINTS_MAX = 65536 };

bool spectral_is_type(const char *type); /* of a <spectrum type="..."> */
/* Returns the i-th such type and the names of the parameters that it may contain, "a|b"; NULL after the last. */
const char *spectral_type_at(size_t i, const char **names);
/* Returns the i-th attribute that defines a <spectrum>, and what its value means; NULL after the last. */
const char *spectral_form_at(size_t i, const char **meaning);
/* Reads a <spectrum>; *out may also become an rgb colour (three numbers in 0.6, type="srgb" and "rgb"). */
int spectral_read(const struct xml_element *el, const struct asset_source *assets, struct arena *arena,
		  struct value *out, struct error *e);
/* Reads <blackbody temperature="5000" scale="1"/>: Planck's law in W / (m^2 sr nm), times the scale. */
int spectral_read_blackbody(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e);

#endif
