/* SPDX-License-Identifier: Apache-2.0 */
/* <transform>: its elements apply in order, each to the result of the previous ones. Pure. */
#ifndef WORKER_RENDER_SCENE_TRANSFORM_H
#define WORKER_RENDER_SCENE_TRANSFORM_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/report.h"
#include "worker/render/xml/xml.h"

int transform_read(const struct xml_element *el, mat4 *out, struct error *e);

/* Handles the failure in *e of reading the value el: if el is a <transform> or an <animation> with a wrong element,
 * reports it, and the problems of all other elements. Returns REPORT_ALREADY_REPORTED, or what report_problem()
 * returns; any other failure is returned unchanged. */
int transform_report(const struct xml_element *el, int failure, struct report *report, struct error *e);

/* Reads x=, y=, z= (`fallback` where absent) or value="x, y, z"; allow_single: value="s" stands for three equal
 * numbers. */
int transform_read_vec3(const struct xml_element *el, double fallback, bool allow_single, vec3 *out, struct error *e);

#endif
