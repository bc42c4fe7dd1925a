/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/medium/flakes.h"

#include "worker/render/text/number.h"
#include "worker/render/volume/grid_file.h"

#include <math.h>
#include <string.h>

/* The largest number of a matrix, which is a squared area; and the smallest trace of a matrix that is not 0. */
#define LARGEST 1e12
#define SMALLEST 1e-30
/* An eigenvalue may be negative by this share of the trace, owing to rounding in matrices stored as bytes. */
#define ROUNDED 0.01

/* Returns the smallest eigenvalue, in closed form (Smith 1961, Eigenvalues of a Symmetric 3 x 3 Matrix). */
static double least_eigenvalue(const double s[FLAKES_NUMBERS])
{
	double mean = (s[0] + s[1] + s[2]) / 3, x = s[0] - mean, y = s[1] - mean, z = s[2] - mean;
	double p2 = (x * x + y * y + z * z + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])) / 6, p = sqrt(p2);
	if (!(p > 0x1p-52 * mean))
		return mean;
	double det = x * (y * z - s[5] * s[5]) - s[3] * (s[3] * z - s[5] * s[4]) + s[4] * (s[3] * s[5] - y * s[4]);
	double cosine = fmin(fmax(det / (2 * p * p2), -1), 1);
	return mean + 2 * p * cos(acos(cosine) / 3 + 2 * M_PI / 3);
}

/* Raises the eigenvalues of a matrix to at least FLAKES_LEAST times the trace. Returns false if the matrix is not
 * positive definite even within rounding. */
static bool make_definite(double s[FLAKES_NUMBERS])
{
	double trace = s[0] + s[1] + s[2];
	if (trace == 0)
		return s[0] == 0 && s[1] == 0 && s[3] == 0 && s[4] == 0 && s[5] == 0;
	if (!(trace >= SMALLEST))
		return false;
	double scaled[FLAKES_NUMBERS];
	for (int i = 0; i < FLAKES_NUMBERS; i++)
		scaled[i] = s[i] / trace;
	double least = least_eigenvalue(scaled);
	for (int i = 0; i < 3 && least < FLAKES_LEAST; i++)
		s[i] += (FLAKES_LEAST - least) * trace;
	return least >= -ROUNDED;
}

static int refuse(const struct scene_node *n, const double s[FLAKES_NUMBERS], struct error *e)
{
	return node_error(n, e, EINVAL,
			  "S: the matrix %g %g %g, %g %g %g (xx yy zz, xy xz yz) is not positive definite", s[0], s[1],
			  s[2], s[3], s[4], s[5]);
}

/* Splits six channels into two grids of three. */
static int split(struct flakes *f, const struct scene_node *n, const struct grid_file *file, struct arena *arena,
		 struct error *e)
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
			return refuse(n, s, e);
		for (int k = 0; k < FLAKES_NUMBERS; k++)
			part[k / 3][3 * i + (size_t)k % 3] = (float)s[k];
	}
	return 0;
}

static int read_grid(struct flakes *f, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	struct grid_file file;
	struct arena room = {.limit = build->arena->limit};
	int rc = grid_file_read(n, build->assets, FLAKES_NUMBERS, &room, &file, e);
	if (!rc && !(file.least >= -LARGEST && file.largest <= LARGEST))
		rc = node_error(n, e, ERANGE, "S: its values go from %g to %g; [-%g, %g] is supported", file.least,
				file.largest, LARGEST, LARGEST);
	file.channels = 3;
	file.full = NULL;
	if (!rc)
		rc = volume_grid(&f->grid[0], n, &file, build, e);
	if (!rc) {
		f->grid[1] = f->grid[0];
		rc = split(f, n, &file, build->arena, e);
	}
	f->uneven = !rc && (file.size[0] > 1 || file.size[1] > 1 || file.size[2] > 1);
	for (int k = 0; k < FLAKES_NUMBERS && !rc; k++)
		f->even[k] = (double)f->grid[k / 3].value[k % 3];
	arena_fini(&room);
	return rc;
}

int flakes_create(struct flakes *f, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	const struct property *p = node_find(n, "S");
	const struct scene_node *inner = p && p->value.type == VALUE_NODE ? p->value.as.node : NULL;
	*f = (struct flakes){.uneven = false};
	if (!inner)
		return node_error(n, e, EINVAL, "needs a volume `S`");
	if (strcmp(inner->type, "gridvolume") == 0)
		return read_grid(f, inner, build, e);
	p = node_find(inner, "value");
	const char *text = p && p->value.type == VALUE_STRING ? p->value.as.string : "";
	if (number_list(text, f->even, FLAKES_NUMBERS) != FLAKES_NUMBERS)
		return node_error(inner, e, EINVAL,
				  "S: needs six numbers (xx yy zz, xy xz yz), as a string `value` or the channels of a "
				  "gridvolume");
	for (int k = 0; k < FLAKES_NUMBERS; k++)
		if (!(fabs(f->even[k]) <= LARGEST))
			return node_error(inner, e, ERANGE, "S: %g is outside [-%g, %g]", f->even[k], LARGEST, LARGEST);
	return make_definite(f->even) ? 0 : refuse(inner, f->even, e);
}

void flakes_at(const struct flakes *f, vec3 at, double s[FLAKES_NUMBERS])
{
	if (!f->uneven) {
		memcpy(s, f->even, sizeof f->even);
		return;
	}
	grid_at(&f->grid[0], at, s);
	grid_at(&f->grid[1], at, s + 3);
}
