/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Pairs and 2x2 matrices, passed by value: tangent coordinates, half vectors, blocks of constraint derivatives. In
 * double, and in float with names that end in _single.
 */
#ifndef WORKER_RENDER_MATH_MAT2_H
#define WORKER_RENDER_MATH_MAT2_H

#include <math.h>

#define REAL double
#define N(name) name
#define F(name) name
#include "worker/render/math/mat2.inc"
#undef REAL
#undef N
#undef F

#define REAL float
#define N(name) name##_single
#define F(name) name##f
#include "worker/render/math/mat2.inc"
#undef REAL
#undef N
#undef F

#endif
