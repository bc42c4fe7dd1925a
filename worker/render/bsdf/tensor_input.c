/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/tensor_input.h"

#include "common/base/bytes.h"
#include "common/base/color.h"
#include "common/base/liveness.h"
#include "worker/render/math/cie.h"
#include "worker/render/math/search.h"
#include "worker/render/texture/color.h"

enum { SIDE_MAX = 1 << 16, EXPONENT_MASK = 0x7f800000 /* of a 32-bit float */ };

int tensor_input_error(const struct tensor_input *in, int code, const char *name, const char *what)
{
	return node_error(in->node, in->error, code, "%s: %s%s%s", node_string(in->node, "filename", ""), name,
			  *name ? " " : "", what);
}

int tensor_input_find(const struct tensor_input *in, const char *name, enum tensor_type type, unsigned dimensions,
		      struct tensor *out)
{
	int rc = tensor_find(in->bytes, in->size, name, out);
	if (rc == -ENOENT)
		return tensor_input_error(in, EINVAL, name, "is missing: this is not a measured material");
	if (rc)
		return tensor_input_error(in, -rc, "",
					  rc == -ENOTSUP ? "this version of a tensor file is not supported"
							 : "this is not a tensor file (.bsdf), or it is truncated");
	if (out->type != (unsigned)type || out->dimension_count != dimensions)
		return tensor_input_error(in, EINVAL, name, "has the wrong type or number of dimensions");
	for (unsigned i = 0; i < dimensions; i++)
		if (out->shape[i] < 1 || out->shape[i] > SIDE_MAX)
			return tensor_input_error(in, EINVAL, name, "has a side of 0 or of more than 65,536");
	return 0;
}

double tensor_value(const struct tensor *t, uint64_t i)
{
	return t->type == TENSOR_SHORTS ? (double)get16(t->bytes + 2 * i) : (double)get_float(t->bytes + 4 * i);
}

bool tensor_is_usable(const struct tensor *t, uint64_t i)
{
	return t->type == TENSOR_SHORTS || ((get32(t->bytes + 4 * i) & EXPONENT_MASK) != EXPONENT_MASK &&
					    fabs(tensor_value(t, i)) <= TENSOR_NUMBER_MAX);
}

int tensor_check_finite(const struct tensor_input *in, const struct tensor *t, const char *name)
{
	for (uint64_t i = 0; i < t->count; i++) {
		if (!tensor_is_usable(t, i))
			return tensor_input_error(in, EINVAL, name,
						  "has a number beyond 1e30, or one that is not finite");
		if (i % SIDE_MAX == 0)
			liveness_tick();
	}
	return 0;
}

int tensor_read_numbers(const struct tensor_input *in, const struct tensor *t, const char *name, double **out)
{
	int rc = tensor_check_finite(in, t, name);
	*out = rc ? NULL : arena_alloc(in->arena, t->count, sizeof **out);
	if (rc || !*out)
		return rc ? rc : tensor_input_error(in, ENOMEM, name, "does not fit into memory");
	for (uint64_t i = 0; i < t->count; i++)
		(*out)[i] = tensor_value(t, i);
	return 0;
}

int tensor_read_axis(const struct tensor_input *in, const char *name, enum tensor_type type, unsigned dimensions,
		     uint32_t *count, const double **values)
{
	struct tensor t;
	double *value = NULL;
	int rc = tensor_input_find(in, name, type, dimensions, &t);
	if (!rc && t.count != t.shape[dimensions - 1])
		rc = tensor_input_error(in, EINVAL, name, "has more than one row");
	if (!rc)
		rc = tensor_read_numbers(in, &t, name, &value);
	if (rc)
		return rc;
	*count = (uint32_t)t.count;
	*values = value;
	for (uint32_t i = 1; i < *count; i++)
		if (!(value[i] > value[i - 1]))
			return tensor_input_error(in, EINVAL, name, "must ascend");
	return 0;
}

int tensor_rgb_weights(const struct tensor_input *in, const double *nm, uint32_t count, double (**out)[3])
{
	double(*weight)[3] = arena_alloc(in->arena, count, sizeof *weight), sum[3] = {0, 0, 0}, white[3];
	if (!weight)
		return tensor_input_error(in, ENOMEM, "wavelengths", "do not fit into memory");
	for (int i = 0; i < CIE_COUNT; i++) {
		double wavelength = CIE_FIRST_NM + i, fraction = 0;
		uint32_t k = 0;
		if (count > 1 && wavelength > nm[0]) {
			k = search_find_cell(nm, count - 1, wavelength);
			fraction = fmin((wavelength - nm[k]) / (nm[k + 1] - nm[k]), 1);
		}
		for (int c = 0; c < 3; c++) {
			double x = cie_observer[i][c] * color_d65(wavelength);
			weight[k][c] += (1 - fraction) * x;
			if (fraction > 0)
				weight[k + 1][c] += fraction * x;
			sum[c] += x;
		}
	}
	rec709_from_xyz(sum, white);
	for (uint32_t k = 0; k < count; k++) {
		double rgb[3];
		rec709_from_xyz(weight[k], rgb);
		for (int c = 0; c < 3; c++)
			weight[k][c] = rgb[c] / white[c];
	}
	*out = weight;
	return 0;
}
