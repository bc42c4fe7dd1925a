#include "worker/halfvec/constraint.h"

#include <assert.h>
#include <string.h>

/*
 * Rows and columns of the pivoted form: 2 (j - c - 1) and the next for vertex j. Row r of `band`: [0..6] what is left of the
 * row from its diagonal on, [7..9] the multipliers with which the pivot row of column r was taken from the three rows below.
 * order[r]: how far below r its pivot row was.
 */
enum { LOWER = 3, UPPER = 3, WIDTH = LOWER + UPPER + 1 };

/* Rows and columns scaled to entries of at most 1, the inverse of a block that others are eliminated with is at most this:
 * what it is multiplied with grows by no more. */
#define BLOCK_MOST 10.0
/* The last block is only solved with: this much before the matrix is looked at as a whole. */
#define LAST_MOST 1e10
/* Products of three of these, sums of them and determinants stay finite. */
#define ENTRY_MOST 1e70
#define ENTRY_LEAST 1e-140

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
	return log(fabs(p->v)) + p->exponent * M_LN2;
}

static bool fits(mat2 m)
{
	return fabs(m.xx) < ENTRY_MOST && fabs(m.xy) < ENTRY_MOST && fabs(m.yx) < ENTRY_MOST && fabs(m.yy) < ENTRY_MOST;
}

/* By vertex, of its two rows and columns: the entries over both scales are at most 1, and 1 somewhere in each. */
struct scales {
	vec2 row[WHOLE_MAX_VERTICES], column[WHOLE_MAX_VERTICES];
};

/* Of numbers that are none of them NaN: a call of fmax costs more than what is done here with the result. */
static inline double larger(double a, double b)
{
	return a > b ? a : b;
}

static inline void grow_column(vec2 *column, mat2 m, vec2 row)
{
	column->x = larger(column->x, larger(fabs(m.xx) * row.x, fabs(m.yx) * row.y));
	column->y = larger(column->y, larger(fabs(m.xy) * row.x, fabs(m.yy) * row.y));
}

static inline void grow_row(vec2 *row, mat2 m, vec2 column)
{
	row->x = larger(row->x, larger(fabs(m.xx) * column.x, fabs(m.xy) * column.y));
	row->y = larger(row->y, larger(fabs(m.yx) * column.x, fabs(m.yy) * column.y));
}

/* 1 / of both; false: nothing, or nearly nothing, is there to be divided by. */
static bool reciprocal(vec2 *v)
{
	if (!(v->x > ENTRY_LEAST) || !(v->y > ENTRY_LEAST))
		return false;
	*v = (vec2){1 / v->x, 1 / v->y};
	return true;
}

static bool scale_columns(const struct constraint *k, unsigned b, unsigned c, struct scales *s)
{
	for (unsigned j = c + 1; j < b; j++)
		s->column[j] = (vec2){0, 0};
	for (unsigned j = c + 1; j < b; j++) {
		grow_column(&s->column[j], k[j].b, s->row[j]);
		if (j > c + 1)
			grow_column(&s->column[j - 1], k[j].a, s->row[j]);
		if (j + 1 < b)
			grow_column(&s->column[j + 1], k[j].c, s->row[j]);
	}
	for (unsigned j = c + 1; j < b; j++)
		if (!reciprocal(&s->column[j]))
			return false;
	return true;
}

/* Factors for columns, then rows, then the columns that are now all small; at last the scales are what was divided by.
 * false: an entry is too large, or a row or column is nothing. */
static bool find_scales(const struct constraint *k, unsigned b, unsigned c, struct scales *s)
{
	for (unsigned j = c + 1; j < b; j++) {
		if (!fits(k[j].a) || !fits(k[j].b) || !fits(k[j].c))
			return false;
		s->row[j] = (vec2){1, 1};
	}
	if (!scale_columns(k, b, c, s))
		return false;
	for (unsigned j = c + 1; j < b; j++) {
		vec2 r = {0, 0};
		grow_row(&r, k[j].b, s->column[j]);
		if (j > c + 1)
			grow_row(&r, k[j].a, s->column[j - 1]);
		if (j + 1 < b)
			grow_row(&r, k[j].c, s->column[j + 1]);
		if (!reciprocal(&r))
			return false;
		s->row[j] = r;
	}
	if (!scale_columns(k, b, c, s))
		return false;
	for (unsigned j = c + 1; j < b; j++) {
		s->row[j] = (vec2){1 / s->row[j].x, 1 / s->row[j].y};
		s->column[j] = (vec2){1 / s->column[j].x, 1 / s->column[j].y};
	}
	return true;
}

/* Inverse of l = the block of vertex j as it stands. false: too large by the scales, above. */
static bool invert(mat2 l, const struct scales *s, unsigned j, double most, mat2 *inverse, double *det)
{
	if (!fits(l))
		return false;
	*det = mat2_det(l);
	mat2 adjugate = mat2_adjugate(l);
	vec2 row = s->row[j], column = s->column[j];
	double largest = larger(larger(fabs(adjugate.xx) * row.x * column.x, fabs(adjugate.xy) * row.y * column.x),
				larger(fabs(adjugate.yx) * row.x * column.y, fabs(adjugate.yy) * row.y * column.y));
	if (!(largest < most * fabs(*det)))
		return false;
	*inverse = (mat2){adjugate.xx / *det, adjugate.xy / *det, adjugate.yx / *det, adjugate.yy / *det};
	return fits(*inverse);
}

static mat2 triple(mat2 x, mat2 y, mat2 z)
{
	return mat2_mul(mat2_mul(x, y), z);
}

static bool factor_blocks(const struct constraint *k, const struct scales *s, struct constraint_system *m)
{
	mat2 taken = {0, 0, 0, 0};
	for (unsigned j = m->b - 1; j > m->c; j--) {
		bool last = j == m->c + 1;
		if (!invert(mat2_sub(k[j].b, taken), s, j, last ? LAST_MOST : BLOCK_MOST, &m->inverse[j], &m->det[j]))
			return false;
		if (!last)
			taken = triple(k[j - 1].c, m->inverse[j], k[j].a);
	}
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

static bool eliminate_band(double row[][WIDTH], unsigned n, const double *of_column, double *of_row,
			   struct constraint_system *m)
{
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
	return true;
}

static bool factor_pivoted(const struct constraint *k, const struct scales *s, struct constraint_system *m)
{
	double row[2 * WHOLE_MAX_VERTICES][WIDTH], of_column[2 * WHOLE_MAX_VERTICES], of_row[2 * WHOLE_MAX_VERTICES];
	unsigned n = 2 * (m->b - m->c - 1);
	m->pivoted = true;
	for (unsigned r = 0; r < n; r++) {
		unsigned j = m->c + 1 + r / 2;
		scalar_row(k, m, r, row[r]);
		of_column[r] = r & 1 ? s->column[j].y : s->column[j].x;
		of_row[r] = r & 1 ? s->row[j].y : s->row[j].x;
	}
	return eliminate_band(row, n, of_column, of_row, m);
}

enum constraint_end constraint_factor_to_solve(const struct constraint *k, unsigned b, unsigned c, struct constraint_system *m)
{
	assert(c + 2 <= b && b < WHOLE_MAX_VERTICES);
	struct scales s;
	m->b = b;
	m->c = c;
	m->pivoted = false;
	if (!find_scales(k, b, c, &s) || !(factor_blocks(k, &s, m) || factor_pivoted(k, &s, m)))
		return CONSTRAINT_SINGULAR;
	return CONSTRAINT_OK;
}

enum constraint_end constraint_factor(const struct constraint *k, unsigned b, unsigned c, struct constraint_system *m)
{
	if (constraint_factor_to_solve(k, b, c, m) != CONSTRAINT_OK)
		return CONSTRAINT_SINGULAR;
	struct long_product all = {1, 0}, towards_light = {1, 0};
	for (unsigned j = b - 1; !m->pivoted && j > c; j--)
		multiply(&all, m->det[j]);
	for (unsigned r = 0; m->pivoted && r < 2 * (b - c - 1); r++)
		multiply(&all, m->band[r][0]);
	for (unsigned j = c + 1; j < b; j++)
		multiply(&towards_light, mat2_det(k[j].a));
	m->log_det = log_of(&all);
	m->log_transfer = log_of(&towards_light) - m->log_det;
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
static bool differentials_by_blocks(const struct constraint *k, const struct scales *s, unsigned b, unsigned c, mat2 *d)
{
	mat2 inverse[WHOLE_MAX_VERTICES], taken = {0, 0, 0, 0};
	for (unsigned j = c + 1; j < b; j++) {
		bool last = j + 1 == b;
		double det;
		if (!invert(mat2_sub(k[j].b, taken), s, j, last ? LAST_MOST : BLOCK_MOST, &inverse[j], &det))
			return false;
		if (!last)
			taken = triple(k[j + 1].a, inverse[j], k[j].c);
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
	struct scales s;
	if (!find_scales(k, b, c, &s))
		return CONSTRAINT_SINGULAR;
	if (differentials_by_blocks(k, &s, b, c, d))
		return CONSTRAINT_OK;
	struct constraint_system m;
	m.b = b;
	m.c = c;
	if (!factor_pivoted(k, &s, &m))
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
