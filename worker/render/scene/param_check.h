/* SPDX-License-Identifier: Apache-2.0 */
/* Does a value suit its parameter: type, range, choice? Any thread; allocates nothing. */
#ifndef WORKER_RENDER_SCENE_PARAM_CHECK_H
#define WORKER_RENDER_SCENE_PARAM_CHECK_H

#include "worker/render/scene/param.h"
#include "worker/render/scene/xml.h"

struct value;

/* Makes a number of v where p takes no colour and v is a whole number or a colour without hue. Errors have the place
 * of el: EINVAL for another type or choice, with what is supported; ERANGE. */
int param_check(const struct xml_element *el, const struct param *p, struct value *v, struct error *e);

#endif
