/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/live_job/quota.h"

#include "common/film/canvas.h"

#include <inttypes.h>

static uint64_t multiply_saturating(uint64_t a, uint64_t b)
{
	uint64_t product;
	return __builtin_mul_overflow(a, b, &product) ? UINT64_MAX : product;
}

int quota_check(const struct quota *q, const struct quota_use *has, const struct plan *p, uint64_t asset_bytes,
		struct error *e)
{
	uint64_t films = canvas_bytes(p);
	uint64_t mutations = multiply_saturating(p->rounds, plan_round_mutations(p));
	if (q->jobs && has->jobs >= q->jobs)
		return error_set(e, EDQUOT, "quota: at most %" PRIu64 " live jobs", q->jobs);
	if (q->asset_bytes && (has->asset_bytes > q->asset_bytes || asset_bytes > q->asset_bytes - has->asset_bytes))
		return error_set(
			e, EDQUOT, "quota: its files have %.3f MB, those of other jobs %.3f MB; the limit is %.3f MB",
			1e-6 * (double)asset_bytes, 1e-6 * (double)has->asset_bytes, 1e-6 * (double)q->asset_bytes);
	if (q->film_bytes && films > q->film_bytes)
		return error_set(
			e, EDQUOT,
			"quota: the films need %.0f MB; the limit is %.0f MB: a smaller --size or --crop, or fewer --groups",
			1e-6 * (double)films, 1e-6 * (double)q->film_bytes);
	if (q->mutations && p->rounds == UINT64_MAX)
		return error_set(e, EDQUOT,
				 "quota: at most %" PRIu64 " mutations or samples per job; set --spp or --mutations",
				 q->mutations);
	if (q->mutations && mutations > q->mutations)
		return error_set(e, EDQUOT, "quota: %" PRIu64 " mutations or samples; the limit is %" PRIu64, mutations,
				 q->mutations);
	return 0;
}
