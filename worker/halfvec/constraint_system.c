#include "worker/halfvec/constraint.h"

#include <assert.h>
#include <string.h>

/*
 * Rows and columns of the pivoted form: 2 (j - c - 1) and the next for vertex j. Row r of `band`: [0..6] what is left of the
 * row from its diagonal on, [7..9] the multipliers with which the pivot row of column r was taken from the three rows below.
 * order[r]: how far below r its pivot row was.
 */
enum { LOWER = 3, UPPER = 3, WIDTH = LOWER + UPPER + 1 };

/* A block that lost more than this to cancellation is not eliminated with: the digits it lost would be lost to all others. */
#define BLOCK_LEAST 1e-3
/* The last block is only solved with: this much less before the matrix is looked at as a whole. */
#define LAST_LEAST 1e-10
/* Products of three of these, sums of them and determinants stay finite. */
#define ENTRY_MOST 1e70

/* Products of many determinants, out of reach of overflow. */
struct long_product {
	double v;
	int exponent;
};

static void multiply(struct long_product *p, double v)
{
	int e;
	p->v = frexp(p->v * v, &e);
	p->exponent += e;
}

static double log_of(const struct long_product *p)
{
	return log(p->v) + p->exponent * M_LN2;
}

static bool fits(mat2 m)
{
	return fabs(m.xx) < ENTRY_MOST && fabs(m.xy) < ENTRY_MOST && fabs(m.yx) < ENTRY_MOST && fabs(m.yy) < ENTRY_MOST;
}

static mat2 magnitudes(mat2 m)
{
	return (mat2){fabs(m.xx), fabs(m.xy), fabs(m.yx), fabs(m.yy)};
}

/*
 * L = b - x inverse(L') y and its inverse. false: |det L| is below `least` of the products of the magnitudes that it was made
 * of, however rows and columns are scaled.
 */
static bool eliminate(mat2 b, mat2 taken, mat2 taken_sizes, double least, mat2 *inverse, double *det)
{
	mat2 l = mat2_sub(b, taken), size = magnitudes(b);
	size = (mat2){size.xx + taken_sizes.xx, size.xy + taken_sizes.xy, size.yx + taken_sizes.yx, size.yy + taken_sizes.yy};
	if (!fits(l) || !fits(size))
		return false;
	*det = mat2_det(l);
	if (!(fabs(*det) > least * (size.xx * size.yy + size.xy * size.yx)))
		return false;
	mat2 adjugate = mat2_adjugate(l);
	*inverse = (mat2){adjugate.xx / *det, adjugate.xy / *det, adjugate.yx / *det, adjugate.yy / *det};
	return fits(*inverse);
}

static mat2 triple(mat2 x, mat2 y, mat2 z)
{
	return mat2_mul(mat2_mul(x, y), z);
}

static bool factor_blocks(const struct constraint *k, struct constraint_system *m)
{
	struct long_product all = {1, 0};
	mat2 taken = {0, 0, 0, 0}, sizes = taken;
	for (unsigned j = m->b - 1; j > m->c; j--) {
		double det;
		if (!eliminate(k[j].b, taken, sizes, j == m->c + 1 ? LAST_LEAST : BLOCK_LEAST, &m->inverse[j], &det))
			return false;
		multiply(&all, det);
		if (j == m->c + 1)
			break;
		taken = triple(k[j - 1].c, m->inverse[j], k[j].a);
		sizes = triple(magnitudes(k[j - 1].c), magnitudes(m->inverse[j]), magnitudes(k[j].a));
	}
	all.v = fabs(all.v);
	m->log_det = log_of(&all);
	return true;
}

/* Row r of the matrix as it stands, from column r - LOWER on. */
static void scalar_row(const struct constraint *k, const struct constraint_system *m, unsigned r, double row[WIDTH])
{
	unsigned j = m->c + 1 + r / 2, second = r & 1;
	mat2 block[3] = {k[j].a, k[j].b, k[j].c};
	unsigned first = LOWER - 2 - second; /* of block a */
	memset(row, 0, WIDTH * sizeof *row);
	for (unsigned i = 0; i < 3; i++) {
		if ((i == 0 && j == m->c + 1) || (i == 2 && j + 1 == m->b))
			continue;
		row[first + 2 * i] = second ? block[i].yx : block[i].xx;
		row[first + 2 * i + 1] = second ? block[i].yy : block[i].xy;
	}
}

/* Largest magnitudes of the columns, and of the rows after dividing by those. false: one of them is nothing. */
static bool scales(double row[][WIDTH], unsigned n, double *of_column, double *of_row)
{
	memset(of_column, 0, n * sizeof *of_column);
	memset(of_row, 0, n * sizeof *of_row);
	for (unsigned r = 0; r < n; r++)
		for (unsigned i = 0; i < WIDTH; i++)
			if (row[r][i] != 0)
				of_column[r + i - LOWER] = fmax(of_column[r + i - LOWER], fabs(row[r][i]));
	for (unsigned r = 0; r < n; r++)
		for (unsigned i = 0; i < WIDTH; i++)
			if (row[r][i] != 0)
				of_row[r] = fmax(of_row[r], fabs(row[r][i]) / of_column[r + i - LOWER]);
	for (unsigned r = 0; r < n; r++)
		if (!(of_row[r] > 0) || !(of_column[r] > 0))
			return false;
	return true;
}

static void exchange(double *a, double *b)
{
	for (unsigned i = 0; i < WIDTH; i++) {
		double t = a[i];
		a[i] = b[i];
		b[i] = t;
	}
}

/* The pivot of column r: of the rows from there that reach it, the one with the largest entry by its row's scale. All rows
 * from r on are kept from column r on. */
static unsigned pick(double row[][WIDTH], const double *of_row, unsigned r, unsigned n)
{
	unsigned best = r;
	for (unsigned q = r + 1; q < n && q <= r + LOWER; q++)
		if (fabs(row[q][0]) * of_row[best] > fabs(row[best][0]) * of_row[q])
			best = q;
	return best;
}

static bool eliminate_band(double row[][WIDTH], unsigned n, double *of_column, double *of_row, struct constraint_system *m)
{
	struct long_product all = {1, 0};
	double least = n * 0x1p-46;
	/* Rows below the first start left of where they are first looked at: align those that reach column 0. */
	for (unsigned r = 0; r < n && r < LOWER; r++) {
		memmove(row[r], row[r] + LOWER - r, (WIDTH - LOWER + r) * sizeof(double));
		memset(row[r] + WIDTH - LOWER + r, 0, (LOWER - r) * sizeof(double));
	}
	for (unsigned r = 0; r < n; r++) {
		unsigned p = pick(row, of_row, r, n);
		m->order[r] = (unsigned char)(p - r);
		exchange(row[r], row[p]);
		double s = of_row[r];
		of_row[r] = of_row[p];
		of_row[p] = s;
		if (!(fabs(row[r][0]) > least * of_row[r] * of_column[r]))
			return false;
		multiply(&all, row[r][0]);
		memcpy(m->band[r], row[r], sizeof row[r]);
		for (unsigned q = r + 1; q <= r + LOWER; q++) {
			double f = q < n ? row[q][0] / row[r][0] : 0;
			m->band[r][WIDTH + q - r - 1] = f;
			if (q >= n)
				continue;
			for (unsigned i = 1; i < WIDTH; i++)
				row[q][i - 1] = row[q][i] - f * row[r][i];
			row[q][WIDTH - 1] = 0;
		}
	}
	all.v = fabs(all.v);
	m->log_det = log_of(&all);
	return true;
}

static bool factor_pivoted(const struct constraint *k, struct constraint_system *m)
{
	double row[2 * WHOLE_MAX_VERTICES][WIDTH], of_column[2 * WHOLE_MAX_VERTICES], of_row[2 * WHOLE_MAX_VERTICES];
	unsigned n = 2 * (m->b - m->c - 1);
	m->pivoted = true;
	for (unsigned r = 0; r < n; r++)
		scalar_row(k, m, r, row[r]);
	return scales(row, n, of_column, of_row) && eliminate_band(row, n, of_column, of_row, m);
}

static enum constraint_end factor(const struct constraint *k, unsigned b, unsigned c, struct constraint_system *m)
{
	assert(c + 2 <= b && b < WHOLE_MAX_VERTICES);
	m->b = b;
	m->c = c;
	m->pivoted = false;
	for (unsigned j = c + 1; j < b; j++)
		if (!fits(k[j].a) || !fits(k[j].b) || !fits(k[j].c))
			return CONSTRAINT_SINGULAR;
	return factor_blocks(k, m) || factor_pivoted(k, m) ? CONSTRAINT_OK : CONSTRAINT_SINGULAR;
}

enum constraint_end constraint_factor(const struct constraint *k, unsigned b, unsigned c, struct constraint_system *m)
{
	if (factor(k, b, c, m) != CONSTRAINT_OK)
		return CONSTRAINT_SINGULAR;
	struct long_product all = {1, 0};
	for (unsigned j = c + 1; j < b; j++)
		multiply(&all, mat2_det(k[j].a));
	all.v = fabs(all.v);
	m->log_transfer = log_of(&all) - m->log_det;
	return CONSTRAINT_OK;
}

static void solve_pivoted(const struct constraint_system *m, const vec2 *dh, vec2 *dx)
{
	double y[2 * WHOLE_MAX_VERTICES + WIDTH] = {0};
	unsigned n = 2 * (m->b - m->c - 1);
	for (unsigned r = 0; r < n; r++)
		y[r] = r & 1 ? dh[m->c + 1 + r / 2].y : dh[m->c + 1 + r / 2].x;
	for (unsigned r = 0; r < n; r++) {
		unsigned p = r + m->order[r];
		double t = y[p];
		y[p] = y[r];
		y[r] = t;
		for (unsigned i = 1; i <= LOWER; i++)
			y[r + i] -= m->band[r][WIDTH + i - 1] * t;
	}
	for (unsigned r = n; r-- > 0;) {
		for (unsigned i = 1; i < WIDTH; i++)
			y[r] -= m->band[r][i] * y[r + i];
		y[r] /= m->band[r][0];
		if (r & 1)
			dx[m->c + 1 + r / 2].y = y[r];
		else
			dx[m->c + 1 + r / 2].x = y[r];
	}
}

void constraint_solve(const struct constraint *k, const struct constraint_system *m, const vec2 *dh, vec2 *dx)
{
	if (m->pivoted) {
		solve_pivoted(m, dh, dx);
		return;
	}
	vec2 y[WHOLE_MAX_VERTICES];
	y[m->b - 1] = dh[m->b - 1];
	for (unsigned j = m->b - 2; j > m->c; j--)
		y[j] = vec2_sub(dh[j], mat2_apply(k[j].c, mat2_apply(m->inverse[j + 1], y[j + 1])));
	dx[m->c + 1] = mat2_apply(m->inverse[m->c + 1], y[m->c + 1]);
	for (unsigned j = m->c + 2; j < m->b; j++)
		dx[j] = mat2_apply(m->inverse[j], vec2_sub(y[j], mat2_apply(k[j].a, dx[j - 1])));
}

/* By elimination from the light's end, whose last block is x_{b-1}'s:
 * D_{b-1} = L_{b-1}^-1, D_j = -D_{j+1} a_{j+1} L_j^-1. */
static bool differentials_by_blocks(const struct constraint *k, unsigned b, unsigned c, mat2 *d)
{
	mat2 inverse[WHOLE_MAX_VERTICES], taken = {0, 0, 0, 0}, sizes = taken;
	for (unsigned j = c + 1; j < b; j++) {
		double det;
		if (!eliminate(k[j].b, taken, sizes, j + 1 == b ? LAST_LEAST : BLOCK_LEAST, &inverse[j], &det))
			return false;
		if (j + 1 == b)
			break;
		taken = triple(k[j + 1].a, inverse[j], k[j].c);
		sizes = triple(magnitudes(k[j + 1].a), magnitudes(inverse[j]), magnitudes(k[j].c));
	}
	d[b - 1] = inverse[b - 1];
	for (unsigned j = b - 2; j > c; j--) {
		d[j] = mat2_scale(-1, triple(d[j + 1], k[j + 1].a, inverse[j]));
		if (!fits(d[j]))
			return false;
	}
	return true;
}

enum constraint_end constraint_differentials(const struct constraint *k, unsigned b, unsigned c, mat2 *d)
{
	for (unsigned j = c + 1; j < b; j++)
		if (!fits(k[j].a) || !fits(k[j].b) || !fits(k[j].c))
			return CONSTRAINT_SINGULAR;
	if (differentials_by_blocks(k, b, c, d))
		return CONSTRAINT_OK;
	struct constraint_system m;
	m.b = b;
	m.c = c;
	if (!factor_pivoted(k, &m))
		return CONSTRAINT_SINGULAR;
	for (unsigned j = c + 1; j < b; j++) {
		vec2 dh[WHOLE_MAX_VERTICES] = {{0, 0}}, x[WHOLE_MAX_VERTICES], y[WHOLE_MAX_VERTICES];
		dh[j] = (vec2){1, 0};
		constraint_solve(k, &m, dh, x);
		dh[j] = (vec2){0, 1};
		constraint_solve(k, &m, dh, y);
		d[j] = mat2_of_columns(x[b - 1], y[b - 1]);
	}
	return CONSTRAINT_OK;
}
