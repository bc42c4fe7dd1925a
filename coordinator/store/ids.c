/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/ids.h"

#include "common/base/mem.h"

bool ids_add(uint64_t **ids, size_t *count, uint64_t id)
{
	size_t n = *count;
	if ((n & (n - 1)) == 0) { /* grows at powers of two */
		uint64_t *more = mem_grow(*ids, n * sizeof *more, (n ? 2 * n : 1) * sizeof *more);
		if (!more)
			return false;
		*ids = more;
	}
	(*ids)[n] = id;
	*count = n + 1;
	return true;
}
