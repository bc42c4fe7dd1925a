/* SPDX-License-Identifier: Apache-2.0 */
/* Values of the scene language from their elements: <float>, <rgb>, <transform> ... One thread; allocates in the arena.
 */
#ifndef WORKER_RENDER_SCENE_VALUE_H
#define WORKER_RENDER_SCENE_VALUE_H

#include "worker/render/scene/node.h"
#include "worker/render/xml/xml.h"

/* Whether it is the name of a value's element (float, rgb, ... including refused ones such as animation). */
bool value_is_element(const char *name);
/* Offers all these names for a suggestion. */
struct spelling;
void value_offer_elements(struct spelling *s);
/* The i-th element and its attributes, "a|b"; NULL after the last. */
const char *value_element_at(size_t i, const char **attributes);

/* assets: for spectra from files. */
int value_read(const struct xml_element *el, const struct asset_source *assets, struct arena *arena, struct value *out,
	       struct error *e);

/* "float", "rgb" ... for messages; types: any combination of bits, as a list. */
void value_type_names(unsigned types, char *text, size_t size);

/* All numbers of a value, three for a point or rgb; none for types without numbers (transforms are checked in
 * transform.h). The result is in *v or in scratch. */
const double *value_numbers(const struct value *v, double scratch[3], uint32_t *count);

#endif
