/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A table of values at equidistant cosines from -1 to 1, linear in between and scaled to an integral of 1. The
 * cumulative distribution is the sum over the intervals before plus, in an interval of width h between the values a and
 * b, h (a t + (b - a) t^2 / 2): a quadratic equation for t in [0,1], which is solved without cancellation.
 *
 * Creation fails if there are fewer than two or more than TABLE_VALUES_MAX values, if one is negative or too large, or
 * if all are 0.
 */
#include "worker/render/math/search.h"
#include "worker/render/medium/phase.h"
#include "worker/render/text/number.h"

#include <math.h>
#include <string.h>

enum { TABLE_VALUES_MAX = 1 << 16 };
#define TABLE_VALUE_MAX 1e30

struct table {
	uint32_t interval_count;
	double interval_width; /* of an interval, as a difference of cosines */
	double *density;       /* per unit of cosine, at the ends of the intervals */
	double *cumulative;    /* the cumulative distribution at the ends of the intervals */
};

/* Makes the table from `count` values, at least one of which is above 0. */
static void make_table(struct table *t, const double *value, uint32_t count)
{
	double max_value = 0, sum = 0;
	for (uint32_t i = 0; i < count; i++)
		max_value = fmax(max_value, value[i]);
	t->interval_count = count - 1;
	t->interval_width = 2.0 / t->interval_count;
	for (uint32_t i = 0; i < count; i++) {
		t->density[i] = value[i] / max_value;
		sum += i > 0 ? t->interval_width * (t->density[i - 1] + t->density[i]) / 2 : 0;
		t->cumulative[i] = sum;
	}
	for (uint32_t i = 0; i < count; i++) {
		t->density[i] /= sum;
		t->cumulative[i] /= sum;
	}
}

static int read_values(const struct scene_node *n, double *value, uint32_t *count, size_t max_count, struct error *e)
{
	double largest = 0;
	int found = number_parse_list(node_string(n, "values", ""), value, max_count);
	if (found < 2)
		return node_error(n, e, EINVAL, "values: needs a list of 2 to %d numbers", TABLE_VALUES_MAX);
	for (int i = 0; i < found; i++) {
		if (!(value[i] >= 0 && value[i] <= TABLE_VALUE_MAX))
			return node_error(n, e, ERANGE, "values: %g is outside [0, %g]", value[i], TABLE_VALUE_MAX);
		largest = fmax(largest, value[i]);
	}
	*count = (uint32_t)found;
	return largest > 0 ? 0 : node_error(n, e, EINVAL, "values: all are 0");
}

static int create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	size_t length = strlen(node_string(n, "values", "")), max_count = length / 2 + 1; /* a digit, a separator */
	max_count = max_count < TABLE_VALUES_MAX ? max_count : TABLE_VALUES_MAX;
	struct table *t = arena_alloc(build->arena, 1, sizeof *t);
	double *storage = arena_alloc(build->arena, max_count, 3 * sizeof *storage);
	uint32_t count = 0;
	if (!t || !storage)
		return node_error(n, e, ENOMEM, "out of memory");
	int rc = read_values(n, storage, &count, max_count, e);
	if (rc)
		return rc;
	*t = (struct table){.density = storage + count, .cumulative = storage + 2 * count};
	make_table(t, storage, count);
	p->data = t;
	return 0;
}

static double eval(const struct phase *p, vec3 position, double cosine)
{
	(void)position;
	const struct table *t = p->data;
	double scaled = fmin(fmax((cosine + 1) / t->interval_width, 0), t->interval_count);
	uint32_t i = scaled < t->interval_count ? (uint32_t)scaled : t->interval_count - 1;
	double fraction = scaled - i;
	return ((1 - fraction) * t->density[i] + fraction * t->density[i + 1]) / (2 * M_PI);
}

static double sample(const struct phase *p, vec3 position, double u)
{
	(void)position;
	const struct table *t = p->data;
	uint32_t i = search_find_cell(t->cumulative, t->interval_count, u);
	double a = t->density[i], b = t->density[i + 1], rest = (u - t->cumulative[i]) / t->interval_width;
	double root = sqrt(fmax(a * a + 2 * (b - a) * rest, 0));
	return -1 + t->interval_width * (i + (a + root > 0 ? fmin(2 * rest / (a + root), 1) : 0));
}

const struct phase_ops phase_ops_tabphase = {
	.decl = PLUGIN(PHASE, "tabphase", {"values", UNDERSTOOD(VALUE_STRING)}),
	.create = create,
	.eval = eval,
	.sample = sample,
};
