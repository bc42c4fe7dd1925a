/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/world.h"

int32_t world_pick_emitter(const struct world *w, double u)
{
	uint32_t n = w->emitter_count;
	if (n == 0 || !(w->emitter_cdf[n] > 0))
		return -1;
	u *= w->emitter_cdf[n];
	uint32_t i = 0;
	while (i + 1 < n && w->emitter_cdf[i + 1] <= u)
		i++;
	while (w->emitter_pdf[i] == 0 && i > 0)
		i--;
	return (int32_t)i;
}
