/* SPDX-License-Identifier: Apache-2.0 */
/* Small dense systems in long double, by elimination with full pivoting. */
#ifndef TESTS_WORKER_HALFVEC_DENSE_H
#define TESTS_WORKER_HALFVEC_DENSE_H

#include "worker/render/halfvec/constraint.h"

#include <string.h>

enum { DENSE_SIZE_MAX = 2 * FULL_PATH_VERTICES_MAX };

struct dense {
	unsigned n;
	long double m[DENSE_SIZE_MAX][DENSE_SIZE_MAX], inverse[DENSE_SIZE_MAX][DENSE_SIZE_MAX];
	long double log_det;
	/* The scale of an entry, 0 outside the blocks: the product of scales of its row and its column, so that the
	 * largest entry of each row and column is about as large. Condition numbers refer to errors of this size and
	 * so do not depend on units. */
	long double scale[DENSE_SIZE_MAX][DENSE_SIZE_MAX];
};

/* Fills the dense matrix with the blocks of the vertices c+1..b-1, in this order. */
static inline void dense_fill(struct dense *d, const struct constraint *k, unsigned b, unsigned c)
{
	memset(d, 0, sizeof *d);
	d->n = 2 * (b - c - 1);
	for (unsigned j = c + 1; j < b; j++) {
		const mat2 *block[3] = {&k[j].a, &k[j].b, &k[j].c};
		for (unsigned i = 0; i < 3; i++) {
			unsigned row = 2 * (j - c - 1);
			if ((i == 0 && j == c + 1) || (i == 2 && j + 1 == b))
				continue;
			unsigned column = row + 2 * i - 2;
			d->m[row][column] = block[i]->xx;
			d->m[row][column + 1] = block[i]->xy;
			d->m[row + 1][column] = block[i]->yx;
			d->m[row + 1][column + 1] = block[i]->yy;
		}
	}
}

static inline void dense_compute_scales(struct dense *d)
{
	long double column[DENSE_SIZE_MAX], row[DENSE_SIZE_MAX];
	for (unsigned r = 0; r < d->n; r++)
		row[r] = column[r] = 1;
	for (unsigned pass = 0; pass < 3; pass++) {
		long double *of = pass == 1 ? row : column, *other = pass == 1 ? column : row;
		for (unsigned r = 0; r < d->n; r++) {
			of[r] = 0;
			for (unsigned c = 0; c < d->n; c++)
				of[r] = fmaxl(of[r], fabsl(pass == 1 ? d->m[r][c] : d->m[c][r]) / other[c]);
		}
	}
	for (unsigned r = 0; r < d->n; r++)
		for (unsigned c = 0; c < d->n; c++)
			d->scale[r][c] = r / 2 <= c / 2 + 1 && c / 2 <= r / 2 + 1 ? row[r] * column[c] : 0;
}

/* Inverts by Gauss-Jordan elimination, exchanging rows and columns. Returns false if a pivot is 0. */
static inline bool dense_invert(struct dense *d)
{
	static long double a[DENSE_SIZE_MAX][2 * DENSE_SIZE_MAX];
	unsigned n = d->n, column_at[DENSE_SIZE_MAX];
	for (unsigned r = 0; r < n; r++) {
		column_at[r] = r;
		for (unsigned c = 0; c < n; c++) {
			a[r][c] = d->m[r][c];
			a[r][n + c] = r == c;
		}
	}
	d->log_det = 0;
	for (unsigned s = 0; s < n; s++) {
		unsigned pr = s, pc = s;
		for (unsigned r = s; r < n; r++)
			for (unsigned c = s; c < n; c++)
				if (fabsl(a[r][c]) > fabsl(a[pr][pc])) {
					pr = r;
					pc = c;
				}
		for (unsigned c = 0; c < 2 * n; c++) {
			long double t = a[s][c];
			a[s][c] = a[pr][c];
			a[pr][c] = t;
		}
		for (unsigned r = 0; r < n; r++) {
			long double t = a[r][s];
			a[r][s] = a[r][pc];
			a[r][pc] = t;
		}
		unsigned t = column_at[s];
		column_at[s] = column_at[pc];
		column_at[pc] = t;
		long double pivot = a[s][s];
		if (pivot == 0)
			return false;
		d->log_det += logl(fabsl(pivot));
		for (unsigned c = s; c < 2 * n; c++)
			a[s][c] /= pivot;
		for (unsigned r = 0; r < n; r++) {
			long double f = a[r][s];
			if (r == s || f == 0)
				continue;
			for (unsigned c = s; c < 2 * n; c++)
				a[r][c] -= f * a[s][c];
		}
	}
	for (unsigned r = 0; r < n; r++)
		for (unsigned c = 0; c < n; c++)
			d->inverse[column_at[r]][c] = a[r][n + c];
	dense_compute_scales(d);
	return true;
}

/* Returns the largest change of log |det| for changes of all entries relative to their sizes. */
static inline double dense_det_condition(const struct dense *d)
{
	long double sum = 0;
	for (unsigned r = 0; r < d->n; r++)
		for (unsigned c = 0; c < d->n; c++)
			sum += d->scale[r][c] * fabsl(d->inverse[c][r]);
	return (double)sum;
}

#endif
