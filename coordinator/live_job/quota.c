/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/live_job/quota.h"

#include "common/film/canvas.h"

#include <inttypes.h>

static uint64_t multiply_saturating(uint64_t a, uint64_t b)
{
	uint64_t product;
	return __builtin_mul_overflow(a, b, &product) ? UINT64_MAX : product;
}

int quota_check(const struct quota *q, const struct quota_usage *usage, const struct plan *p, uint64_t asset_bytes,
		struct error *e)
{
	uint64_t films = canvas_bytes(p);
	uint64_t mutations = multiply_saturating(p->rounds, plan_round_mutations(p));
	if (q->max_jobs && usage->jobs >= q->max_jobs)
		return error_set(e, EDQUOT, "quota: at most %" PRIu64 " live jobs", q->max_jobs);
	if (q->max_asset_bytes &&
	    (usage->asset_bytes > q->max_asset_bytes || asset_bytes > q->max_asset_bytes - usage->asset_bytes))
		return error_set(e, EDQUOT,
				 "quota: its files have %.3f MB, those of other jobs %.3f MB; the limit is %.3f MB",
				 1e-6 * (double)asset_bytes, 1e-6 * (double)usage->asset_bytes,
				 1e-6 * (double)q->max_asset_bytes);
	if (q->max_film_bytes && films > q->max_film_bytes)
		return error_set(
			e, EDQUOT,
			"quota: the films need %.0f MB; the limit is %.0f MB: a smaller --size or --crop, or fewer --groups",
			1e-6 * (double)films, 1e-6 * (double)q->max_film_bytes);
	if (q->max_mutations && p->rounds == UINT64_MAX)
		return error_set(e, EDQUOT,
				 "quota: at most %" PRIu64 " mutations or samples per job; set --spp or --mutations",
				 q->max_mutations);
	if (q->max_mutations && mutations > q->max_mutations)
		return error_set(e, EDQUOT, "quota: %" PRIu64 " mutations or samples; the limit is %" PRIu64, mutations,
				 q->max_mutations);
	return 0;
}
