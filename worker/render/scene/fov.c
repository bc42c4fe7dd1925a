/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/fov.h"
#include "worker/render/text/number.h"

#include <stdio.h>
#include <string.h>

#define DIAGONAL_35MM 43.266615305567875 /* of a film of 36 mm x 24 mm */

int fov_read(const struct scene_node *n, double *degrees, char axis[FOV_AXIS_MAX], struct error *e)
{
	const struct property *fov = node_find_property(n, "fov");
	const char *focal_length = node_string(n, "focal_length", NULL);
	if (fov && focal_length)
		return node_error(n, e, EINVAL, "fov and focal_length are both given: only one is allowed");
	if (fov) {
		*degrees = node_float(n, "fov", 0);
		snprintf(axis, FOV_AXIS_MAX, "%s", node_string(n, "fov_axis", "x"));
		return 0;
	}
	const char *text = focal_length ? focal_length : "50mm";
	double mm;
	const char *rest = number_scan(text, text + strlen(text), &mm);
	if (!rest || (*rest && strcmp(rest, "mm") != 0) || !(mm >= 0.1) || !(mm <= 1e6))
		return node_error(n, e, EINVAL, "focal_length=\"%.64s\" is not a length like \"50mm\"", text);
	*degrees = 2 * atan(0.5 * DIAGONAL_35MM / mm) * 57.295779513082320877;
	snprintf(axis, FOV_AXIS_MAX, "diagonal");
	return 0;
}

double fov_side(const char *axis, double width, double height)
{
	if (strcmp(axis, "y") == 0)
		return height;
	if (strcmp(axis, "diagonal") == 0)
		return hypot(width, height);
	if (strcmp(axis, "smaller") == 0)
		return fmin(width, height);
	return strcmp(axis, "larger") == 0 ? fmax(width, height) : width;
}
