/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reading the arrays of measured materials from a file of them (tensor.h) for a node of the scene. Functions return 0,
 * or a negative error code with a sentence in in->error that names the file and the array. They allocate from the
 * arena, and never more than the file is long, times a small number. One thread.
 */
#ifndef WORKER_RENDER_BSDF_TENSOR_INPUT_H
#define WORKER_RENDER_BSDF_TENSOR_INPUT_H

#include "worker/render/bsdf/tensor.h"
#include "worker/render/scene/scene.h"

#define TENSOR_NUMBER_MAX 1e30

struct tensor_input {
	const unsigned char *bytes;
	size_t size;
	const struct scene_node *node;
	struct arena *arena;
	struct error *error;
};

/* The sentence "FILE: NAME WHAT". Returns -code. */
int tensor_fault(const struct tensor_input *in, int code, const char *name, const char *what);

/* An array of this type and number of dimensions, of sides from 1 to 65,536. -EINVAL, -ENOTSUP. */
int tensor_input_find(const struct tensor_input *in, const char *name, enum tensor_type type, unsigned dimensions,
		      struct tensor *out);

/* Number i of an array of TENSOR_FLOATS or TENSOR_SHORTS. */
double tensor_value(const struct tensor *t, uint64_t i);
/* The same for floats that may be anything. By its bits: NaNs that signal must not be compared. */
bool tensor_is_usable(const struct tensor *t, uint64_t i); /* finite, and at most TENSOR_NUMBER_MAX */

int tensor_check_finite(const struct tensor_input *in, const struct tensor *t, const char *name);
/* All numbers, as doubles. NULL in *out if the code is not 0. */
int tensor_numbers(const struct tensor_input *in, const struct tensor *t, const char *name, double **out);
/* Numbers that ascend, from an array of one dimension, or of two if the first side is 1. */
int tensor_axis(const struct tensor_input *in, const char *name, enum tensor_type type, unsigned dimensions,
		uint32_t *count, const double **at);

/* What each wavelength adds to R, G and B under D65, for values that are linear between them and the same beyond. */
int tensor_rgb_weights(const struct tensor_input *in, const double *nm, uint32_t count, double (**out)[3]);

#endif
