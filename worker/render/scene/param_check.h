/* SPDX-License-Identifier: Apache-2.0 */
/* Checks a value against its parameter: type, range, choice, and whether it was given before. Any thread; allocates
 * nothing but notes. */
#ifndef WORKER_RENDER_SCENE_PARAM_CHECK_H
#define WORKER_RENDER_SCENE_PARAM_CHECK_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/notes.h"
#include "worker/render/plugin/param.h"

/* Checks *v. A colour with three equal components is converted to a number if p takes no colour, and an integer to a
 * float if p takes no integer. Errors have the place of el: -EINVAL for a wrong type or choice, with what is supported;
 * -ERANGE for a value outside the range. */
int param_check(const struct xml_element *el, const struct param *p, struct value *v, struct error *e);

/* For parameters with VALUE_CLAMPED, which Mitsuba limits to their range: moves a number, or each component of a
 * colour, that is outside the range of p to the nearer end, with a note. Spectra stay as they are. Returns 0 or
 * -ENOMEM. */
int clip_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
	       const struct param *p, struct value *v);

/* Refuses a property that an object is given a second time. Returns -EINVAL. */
int refuse_second_value(const struct xml_element *el, const struct property *previous, struct error *e);

/* For files of 0.6: sets *previous to the value that counts in Mitsuba 0.6, with a note. Returns -EINVAL if two names
 * of 0.6 that mean the same parameter are given. */
int resolve_second_value(const struct notes *t, const struct plugin_decl *decl, const struct xml_element *el,
			 struct property *previous, struct value v);

#endif
