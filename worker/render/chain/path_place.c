/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/chain/path_place.h"

#include <float.h>

#define LOG_FLT_MAX (FLT_MAX_EXP * M_LN2)

void path_place_copy(struct full_path *to, const struct full_path *from)
{
	if (from->edges)
		full_path_copy(to, from, 0, from->edges);
	to->edges = from->edges;
}

void path_place_follow(struct full_path *proposal, const struct full_path *current, const struct move *move, bool all)
{
	if (all || proposal->edges != current->edges)
		path_place_copy(proposal, current);
	else
		full_path_copy(proposal, current, move->first, move->last);
}

bool path_place_is_sound(const struct path_context *c, double log_weight, bool bounded)
{
	if (isnan(log_weight))
		c->counters[COUNT_NAN]++;
	else if (log_weight == INFINITY || (bounded && log_weight > LOG_FLT_MAX))
		c->counters[COUNT_INFINITE]++;
	else
		return true;
	return false;
}
