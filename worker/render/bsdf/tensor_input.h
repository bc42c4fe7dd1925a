/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads the arrays of measured materials from a tensor file (tensor.h) for a node of the scene. Functions return 0, or
 * a negative error code with a sentence in in->error that names the file and the array. They allocate from the arena,
 * at most a small multiple of the size of the file. One thread.
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

/* Sets the error to the sentence "FILE: NAME WHAT". Returns -code. */
int tensor_input_error(const struct tensor_input *in, int code, const char *name, const char *what);

/* Finds an array of the given type and number of dimensions, with sides from 1 to 65,536. Returns 0, -EINVAL or
 * -ENOTSUP. */
int tensor_input_find(const struct tensor_input *in, const char *name, enum tensor_type type, unsigned dimensions,
		      struct tensor *out);

/* Returns number i of an array of TENSOR_FLOATS or TENSOR_SHORTS. */
double tensor_value(const struct tensor *t, uint64_t i);
/* Returns whether number i is finite and at most TENSOR_NUMBER_MAX in magnitude. Finite is tested by the bits, since
 * comparing a signalling NaN would trap. */
bool tensor_is_usable(const struct tensor *t, uint64_t i);

/* Returns 0 if all numbers of t are usable, otherwise -EINVAL. */
int tensor_check_finite(const struct tensor_input *in, const struct tensor *t, const char *name);
/* Converts all numbers to doubles in *out, or sets it to NULL and returns -EINVAL or -ENOMEM. */
int tensor_read_numbers(const struct tensor_input *in, const struct tensor *t, const char *name, double **out);
/* Reads strictly ascending numbers from an array of one dimension, or of two if the first size is 1. Returns 0,
 * -EINVAL, -ENOTSUP or -ENOMEM. */
int tensor_read_axis(const struct tensor_input *in, const char *name, enum tensor_type type, unsigned dimensions,
		     uint32_t *count, const double **values);

/* Computes the weight of each wavelength in R, G and B under D65, for spectra that are linear between the wavelengths
 * and constant beyond. -ENOMEM. */
int tensor_rgb_weights(const struct tensor_input *in, const double *nm, uint32_t count, double (**out)[3]);

#endif
