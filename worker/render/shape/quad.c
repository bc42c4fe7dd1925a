/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/quad.h"

#include <string.h>

const double quad_corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

void quad_set(struct mesh *m, uint32_t triangle, uint32_t first)
{
	memcpy(m->index[triangle], (uint32_t[3]){first, first + 1, first + 2}, sizeof m->index[0]);
	memcpy(m->index[triangle + 1], (uint32_t[3]){first, first + 2, first + 3}, sizeof m->index[0]);
}
