/* SPDX-License-Identifier: Apache-2.0 */
/* <transform>: its elements apply in order, each to the result of those before. Pure. */
#ifndef WORKER_RENDER_SCENE_TRANSFORM_H
#define WORKER_RENDER_SCENE_TRANSFORM_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/report.h"
#include "worker/render/xml/xml.h"

int transform_read(const struct xml_element *el, mat4 *out, struct error *e);

/* After a failure in the value el, which is in e: if that is a <transform> or an <animation>, reports it, and what is
 * wrong in each of their elements. REPORT_TOLD, or what report_problem returns; failures of other values, and others
 * than wrong elements, are returned unchanged. */
int transform_report(const struct xml_element *el, int failure, struct report *report, struct error *e);

/* x=, y=, z= (default `missing`) or value="x, y, z"; one_for_all: value="s" stands for three equal ones. */
int transform_read_vec3(const struct xml_element *el, double missing, bool one_for_all, vec3 *out, struct error *e);

#endif
