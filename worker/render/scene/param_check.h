/* SPDX-License-Identifier: Apache-2.0 */
/* Checks a value against its parameter: type, range, choice. Any thread; allocates nothing. */
#ifndef WORKER_RENDER_SCENE_PARAM_CHECK_H
#define WORKER_RENDER_SCENE_PARAM_CHECK_H

#include "worker/render/scene/param.h"
#include "worker/render/scene/xml.h"

struct value;

/* Converts v to a number if p takes no colour and v is an integer or a colour without hue. Errors have the place of
 * el: EINVAL for a wrong type or choice, with what is supported; ERANGE. */
int param_check(const struct xml_element *el, const struct param *p, struct value *v, struct error *e);

#endif
