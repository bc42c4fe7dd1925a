/* SPDX-License-Identifier: Apache-2.0 */
/* Prints the table of upsampling coefficients as a C initialiser: [largest component][its value][y][x][3]. */
#include "worker/render/texture/upsample.h"

#include <stdio.h>
#include <string.h>

static float table[3][UPSAMPLE_TABLE_SIZE][UPSAMPLE_TABLE_SIZE][UPSAMPLE_TABLE_SIZE][3];

/* Fits one column of the table, from a middle brightness outwards; each fit starts from that of its neighbour. */
static void fit_column(const struct upsample *s, int largest, int y, int x)
{
	const int n = UPSAMPLE_TABLE_SIZE, start = n / 5;
	double middle[3] = {0, 0, 0};
	for (int direction = 1; direction >= -1; direction -= 2) {
		double c[3];
		memcpy(c, middle, sizeof c);
		for (int k = direction > 0 ? start : start - 1; k >= 0 && k < n; k += direction) {
			double rgb[3], value = upsample_table_value(k);
			rgb[largest] = value;
			rgb[(largest + 1) % 3] = value * x / (n - 1);
			rgb[(largest + 2) % 3] = value * y / (n - 1);
			upsample_fit(s, rgb, 1e-4, c);
			if (k == start)
				memcpy(middle, c, sizeof c);
			for (int i = 0; i < 3; i++)
				table[largest][k][y][x][i] = (float)c[i];
		}
	}
}

int main(void)
{
	static struct upsample s;
	upsample_init(&s, 5);
	for (int l = 0; l < 3; l++)
		for (int y = 0; y < UPSAMPLE_TABLE_SIZE; y++)
			for (int x = 0; x < UPSAMPLE_TABLE_SIZE; x++)
				fit_column(&s, l, y, x);
	const float *p = &table[0][0][0][0][0];
	for (size_t i = 0; i < sizeof table / sizeof *p; i++)
		printf("%.8ef,%s", (double)p[i], i % 6 == 5 ? "\n" : " ");
	return ferror(stdout) || fflush(stdout) ? 1 : 0;
}
