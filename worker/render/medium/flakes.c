/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/medium/flakes.h"

#include "worker/render/text/number.h"
#include "worker/render/volume/grid_file.h"

#include <math.h>
#include <string.h>

/* The largest number of a matrix, which is a squared area; and the smallest trace of a matrix that is not 0. */
#define NUMBER_MAX 1e12
#define TRACE_MIN 1e-30
/* An eigenvalue may be negative by this share of the trace, owing to rounding in matrices stored as bytes. */
#define ROUNDING_TOLERANCE 0.01

/* Returns the smallest eigenvalue, in closed form (Smith 1961, Eigenvalues of a Symmetric 3 x 3 Matrix). */
static double min_eigenvalue(const double s[FLAKES_NUMBERS])
{
	double mean = (s[0] + s[1] + s[2]) / 3, x = s[0] - mean, y = s[1] - mean, z = s[2] - mean;
	double p2 = (x * x + y * y + z * z + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])) / 6, p = sqrt(p2);
	if (!(p > 0x1p-52 * mean))
		return mean;
	double det = x * (y * z - s[5] * s[5]) - s[3] * (s[3] * z - s[5] * s[4]) + s[4] * (s[3] * s[5] - y * s[4]);
	double cosine = fmin(fmax(det / (2 * p * p2), -1), 1);
	return mean + 2 * p * cos(acos(cosine) / 3 + 2 * M_PI / 3);
}

/* Raises the eigenvalues of a matrix to at least FLAKES_EIGENVALUE_MIN times the trace. Returns false if the matrix is
 * not positive definite even within rounding. */
static bool make_definite(double s[FLAKES_NUMBERS])
{
	double trace = s[0] + s[1] + s[2];
	if (trace == 0)
		return s[0] == 0 && s[1] == 0 && s[3] == 0 && s[4] == 0 && s[5] == 0;
	if (!(trace >= TRACE_MIN))
		return false;
	double scaled[FLAKES_NUMBERS];
	for (int i = 0; i < FLAKES_NUMBERS; i++)
		scaled[i] = s[i] / trace;
	double min_share = min_eigenvalue(scaled);
	for (int i = 0; i < 3 && min_share < FLAKES_EIGENVALUE_MIN; i++)
		s[i] += (FLAKES_EIGENVALUE_MIN - min_share) * trace;
	return min_share >= -ROUNDING_TOLERANCE;
}

static int refuse_matrix(const struct scene_node *n, const double s[FLAKES_NUMBERS], struct error *e)
{
	return node_error(n, e, EINVAL,
			  "S: the matrix %g %g %g, %g %g %g (xx yy zz, xy xz yz) is not positive definite", s[0], s[1],
			  s[2], s[3], s[4], s[5]);
}

/* Splits six channels into two grids of three. */
static int split_channels(struct flakes *f, const struct scene_node *n, const struct grid_file *file,
			  struct arena *arena, struct error *e)
{
	size_t count = (size_t)file->size[0] * file->size[1] * file->size[2];
	float *part[2];
	for (int k = 0; k < 2; k++)
		if (!(f->grid[k].value = part[k] = arena_alloc(arena, count, 3 * sizeof(float))))
			return node_error(n, e, ENOMEM, "out of memory");
	for (size_t i = 0; i < count; i++) {
		double s[FLAKES_NUMBERS];
		for (int k = 0; k < FLAKES_NUMBERS; k++)
			s[k] = (double)file->value[FLAKES_NUMBERS * i + (size_t)k];
		if (!make_definite(s))
			return refuse_matrix(n, s, e);
		for (int k = 0; k < FLAKES_NUMBERS; k++)
			part[k / 3][3 * i + (size_t)k % 3] = (float)s[k];
	}
	return 0;
}

static int read_grid(struct flakes *f, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	struct grid_file file;
	struct arena scratch = {.limit = build->arena->limit};
	int rc = grid_file_read(n, build->assets, FLAKES_NUMBERS, &scratch, &file, e);
	if (!rc && !(file.min_value >= -NUMBER_MAX && file.max_value <= NUMBER_MAX))
		rc = node_error(n, e, ERANGE, "S: its values go from %g to %g; [-%g, %g] is supported", file.min_value,
				file.max_value, NUMBER_MAX, NUMBER_MAX);
	file.channels = 3;
	file.occupied_bricks = NULL;
	if (!rc)
		rc = volume_make_grid(&f->grid[0], n, &file, build, e);
	if (!rc) {
		f->grid[1] = f->grid[0];
		rc = split_channels(f, n, &file, build->arena, e);
	}
	f->has_grid = !rc && (file.size[0] > 1 || file.size[1] > 1 || file.size[2] > 1);
	for (int k = 0; k < FLAKES_NUMBERS && !rc; k++)
		f->constant[k] = (double)f->grid[k / 3].value[k % 3];
	arena_fini(&scratch);
	return rc;
}

int flakes_create(struct flakes *f, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	const struct property *p = node_find_property(n, "S");
	const struct scene_node *inner = p && p->value.type == VALUE_NODE ? p->value.as.node : NULL;
	*f = (struct flakes){.has_grid = false};
	if (!inner)
		return node_error(n, e, EINVAL, "needs a volume `S`");
	if (strcmp(inner->type, "gridvolume") == 0)
		return read_grid(f, inner, build, e);
	p = node_find_property(inner, "value");
	const char *text = p && p->value.type == VALUE_STRING ? p->value.as.string : "";
	if (number_parse_list(text, f->constant, FLAKES_NUMBERS) != FLAKES_NUMBERS)
		return node_error(inner, e, EINVAL,
				  "S: needs six numbers (xx yy zz, xy xz yz), as a string `value` or the channels of a "
				  "gridvolume");
	for (int k = 0; k < FLAKES_NUMBERS; k++)
		if (!(fabs(f->constant[k]) <= NUMBER_MAX))
			return node_error(inner, e, ERANGE, "S: %g is outside [-%g, %g]", f->constant[k], NUMBER_MAX,
					  NUMBER_MAX);
	return make_definite(f->constant) ? 0 : refuse_matrix(inner, f->constant, e);
}

void flakes_eval(const struct flakes *f, vec3 position, double s[FLAKES_NUMBERS])
{
	if (!f->has_grid) {
		memcpy(s, f->constant, sizeof f->constant);
		return;
	}
	grid_eval(&f->grid[0], position, s);
	grid_eval(&f->grid[1], position, s + 3);
}
