/* SPDX-License-Identifier: Apache-2.0 */
#ifndef WORKER_RENDER_MATH_SEARCH_H
#define WORKER_RENDER_MATH_SEARCH_H

#include <stdint.h>

/* Returns the last index i < n with edge[i] <= x, or 0. The n > 0 cells lie between ascending edges. */
#define SEARCH(name, type)                                                  \
	static inline uint32_t name(const type *edge, uint32_t n, double x) \
	{                                                                   \
		uint32_t low = 0, high = n;                                 \
		while (high - low > 1) {                                    \
			uint32_t middle = low + (high - low) / 2;           \
			if (edge[middle] <= x)                              \
				low = middle;                               \
			else                                                \
				high = middle;                              \
		}                                                           \
		return low;                                                 \
	}
SEARCH(search_find_cell, double)
SEARCH(search_count, uint32_t)
#undef SEARCH

#endif
