/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/world.h"

#include "worker/render/math/search.h"

int32_t world_pick_emitter(const struct world *w, double u)
{
	uint32_t n = w->emitter_count;
	if (n == 0 || !(w->emitter_cdf[n] > 0))
		return -1;
	u *= w->emitter_cdf[n];
	uint32_t i = search_find_cell(w->emitter_cdf, n, u);
	while (w->emitter_pdf[i] == 0 && i > 0)
		i--;
	return (int32_t)i;
}
