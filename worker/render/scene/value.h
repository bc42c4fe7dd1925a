/* SPDX-License-Identifier: Apache-2.0 */
/* Reads the values of the scene language from their elements: <float>, <rgb>, <transform> ... One thread; allocates
 * in the arena. */
#ifndef WORKER_RENDER_SCENE_VALUE_H
#define WORKER_RENDER_SCENE_VALUE_H

#include "worker/render/scene/node.h"
#include "worker/render/xml/xml.h"

/* Returns whether elements of this name (float, rgb, ...) are values, including those that value_read() refuses,
 * such as animation. */
bool value_is_element(const char *name);
/* Offers the names of the elements that value_read() accepts to a search for the most similar name. */
struct spelling;
void value_offer_elements(struct spelling *s);
/* Returns the i-th of these elements and its attributes, "a|b"; NULL after the last. */
const char *value_element_at(size_t i, const char **attributes);

/* Reads a value. assets: for spectra in files. */
int value_read(const struct xml_element *el, const struct asset_source *assets, struct arena *arena, struct value *out,
	       struct error *e);

/* Lists the names of the types, any combination of bits, for messages: "float", "rgb" ... */
void value_list_type_names(unsigned types, char *text, size_t size);

/* Returns all numbers of a value, in *v or in scratch: three for a point or rgb, none for types without numbers
 * (transforms are checked in transform.h). */
const double *value_numbers(const struct value *v, double scratch[3], uint32_t *count);

#endif
