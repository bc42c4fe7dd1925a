/* SPDX-License-Identifier: Apache-2.0 */
#include "common/plan/resample.h"

#include <Random123/threefry.h>

enum { STREAM_RESAMPLING = 5 }; /* the same number as the renderer's RNG_RESAMPLING, so that no other stream uses it */

double plan_resample_offset(const struct plan *p, uint32_t group)
{
	threefry4x64_key_t key = {{p->seed, STREAM_RESAMPLING, 0, 0}};
	threefry4x64_ctr_t counter = {{group, 0, 0, 0}};
	return (double)(threefry4x64(counter, key).v[0] >> 11) * 0x1p-53;
}

bool plan_resample(const struct plan *p, uint32_t group, const float *weight, uint64_t weight_count, double u,
		   uint32_t count, uint64_t *index)
{
	double total = 0;
	uint64_t last = 0;
	for (uint64_t i = 0; i < weight_count; i++) {
		total += (double)weight[i];
		if (weight[i] > 0)
			last = i;
	}
	if (!(total > 0))
		return false;
	uint64_t first = plan_bootstrap_range(p, group, 0).begin;
	double sum = (double)weight[0];
	uint64_t i = 0;
	for (uint32_t k = 0; k < count; k++) {
		double position = ((double)k + u) / count * total;
		/* `position` may be rounded up to the total: `last` then prevents running past the last index with a
		 * weight. An index of weight 0 is never chosen. */
		while (i < last && sum <= position)
			sum += (double)weight[++i];
		index[k] = first + i;
	}
	return true;
}
