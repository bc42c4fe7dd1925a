/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/polarized_file.h"

#include "common/base/bytes.h"
#include "tests/support/tensor_file.h"

#include <math.h>

static double angle_of_index(double min, double max, int i, int n)
{
	return min + (max - min) * i / (n - 1);
}

unsigned char *polarized_file_make(polarized_function *f, int phis, int thetas, size_t *size)
{
	struct tensor_file file = {.count = 0};
	const int rows[2] = {1, thetas}, phi_row[2] = {1, phis}, wavelengths[1] = {POLARIZED_WAVELENGTHS},
		  sides[6] = {phis, thetas, thetas, POLARIZED_WAVELENGTHS, 4, 4};
	unsigned char *phi = tensor_file_add(&file, "phi_d", TENSOR_FLOATS, 2, phi_row),
		      *theta_d = tensor_file_add(&file, "theta_d", TENSOR_FLOATS, 2, rows),
		      *theta_h = tensor_file_add(&file, "theta_h", TENSOR_FLOATS, 2, rows),
		      *nm = tensor_file_add(&file, "wvls", TENSOR_SHORTS, 1, wavelengths),
		      *m = tensor_file_add(&file, "M", TENSOR_FLOATS, 6, sides);
	for (int i = 0; i < phis; i++)
		tensor_file_put_float(&phi, angle_of_index(-M_PI, M_PI, i, phis));
	for (int i = 0; i < thetas; i++) {
		tensor_file_put_float(&theta_d, angle_of_index(0, M_PI / 2, i, thetas));
		tensor_file_put_float(&theta_h, angle_of_index(0, M_PI / 2, i, thetas));
	}
	for (int i = 0; i < POLARIZED_WAVELENGTHS; i++)
		put_bytes(nm + 2 * i, (uint64_t)(450 + 50 * i), 2);
	for (int i = 0; i < phis; i++)
		for (int d = 0; d < thetas; d++)
			for (int h = 0; h < thetas; h++)
				for (int w = 0; w < POLARIZED_WAVELENGTHS; w++)
					for (int k = 0; k < 16; k++) {
						double first = f(angle_of_index(-M_PI, M_PI, i, phis),
								 angle_of_index(0, M_PI / 2, d, thetas),
								 angle_of_index(0, M_PI / 2, h, thetas), 450 + 50 * w);
						tensor_file_put_float(&m, k ? 7 : first);
					}
	return tensor_file_end(&file, size);
}
