/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/medium/phase_parts.h"

int phase_parts_create(struct phase *p, struct phase_parts **parts, const struct scene_node *n,
		       const struct volume_build *build, struct error *e)
{
	uint32_t count = 0;
	while (node_child(n, PLUGIN_PHASE, count))
		if (count++ == PHASE_PARTS_MAX)
			return node_error(n, e, ERANGE, "more than %d phase functions inside", PHASE_PARTS_MAX);
	if (count == 0)
		return node_error(n, e, EINVAL, "needs phase functions inside");
	struct phase_parts *made = arena_alloc(build->arena, 1, sizeof *made);
	if (!made)
		return node_error(n, e, ENOMEM, "out of memory");
	*made = (struct phase_parts){.count = count};
	for (uint32_t k = 0; k < count; k++) {
		const struct scene_node *inner = node_child(n, PLUGIN_PHASE, k);
		int rc = phase_create(&made->part[k], inner, build, e);
		if (!rc && made->part[k].absorbed_share > 0)
			rc = node_error(inner, e, ENOTSUP,
					"its weights must add up to 1 inside another phase function");
		if (!rc && made->part[k].ops->area)
			rc = node_error(inner, e, ENOTSUP,
					"microflakes are not supported inside another phase function");
		if (rc)
			return rc;
	}
	p->data = *parts = made;
	return 0;
}

/* Returns the weights of the parts at a point: the fixed ones, or those of the grid, stored in `storage`. */
static const double *weights_at(const struct phase_parts *m, vec3 position, double storage[2])
{
	double value[GRID_CHANNELS_MAX];
	if (!m->second_weight)
		return m->weight;
	grid_eval(m->second_weight, position, value);
	storage[1] = fmin(fmax(value[0], 0), 1); /* interpolated values may exceed 1 by a rounding error */
	storage[0] = 1 - storage[1];
	return storage;
}

double phase_parts_eval(const struct phase *p, vec3 position, double cosine)
{
	const struct phase_parts *m = p->data;
	double storage[2], sum = 0;
	const double *weight = weights_at(m, position, storage);
	for (uint32_t k = 0; k < m->count; k++)
		sum += weight[k] * m->part[k].ops->eval(&m->part[k], position, cosine);
	return sum;
}

/* u chooses the part; rescaled to [0,1), it then serves as the random number of that part. */
double phase_parts_sample(const struct phase *p, vec3 position, double u)
{
	const struct phase_parts *m = p->data;
	double storage[2];
	const double *weight = weights_at(m, position, storage);
	uint32_t k = 0, last = m->count - 1;
	while (last > 0 && !(weight[last] > 0)) /* rounding may leave u beyond all weights above 0 */
		last--;
	while (k < last && u >= weight[k])
		u -= weight[k++];
	return m->part[k].ops->sample(&m->part[k], position, fmin(u / weight[k], 1 - 0x1p-53));
}
