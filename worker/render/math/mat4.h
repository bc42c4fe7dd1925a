/* SPDX-License-Identifier: Apache-2.0 */
/* Affine transforms, row major: p' = M p. */
#ifndef WORKER_RENDER_MATH_MAT4_H
#define WORKER_RENDER_MATH_MAT4_H

#include "worker/render/math/vec3.h"

#include <stdbool.h>

typedef struct {
	double m[4][4];
} mat4;

mat4 mat4_identity(void);
mat4 mat4_mul(mat4 a, mat4 b);		 /* b is applied first */
bool mat4_invert(mat4 a, mat4 *inverse); /* returns false if a is singular or not finite */
mat4 mat4_translate(vec3 t);
mat4 mat4_scale(vec3 s);
mat4 mat4_rotate(vec3 axis, double degrees);
mat4 mat4_look_at(vec3 origin, vec3 target,
		  /* Camera to world: +z points to the target, +x to the LEFT, as in Mitsuba. */
		  vec3 up);
double mat4_det3(mat4 a); /* determinant of the upper left 3x3 block */
/* Whether a only rotates, mirrors, translates and scales evenly, to the four digits that files give. */
bool mat4_is_conformal(const mat4 *a);

/* Returns the image of the unit vector of axis k, or of the origin for k = 3. */
static inline vec3 mat4_column(const mat4 *a, int k)
{
	return (vec3){a->m[0][k], a->m[1][k], a->m[2][k]};
}
vec3 mat4_point(const mat4 *a, vec3 p);
vec3 mat4_vector(const mat4 *a, vec3 v);
vec3 mat4_normal(const mat4 *inverse, vec3 n); /* multiplies by the transpose of the INVERSE; not normalised */

#endif
