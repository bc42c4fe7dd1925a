/* SPDX-License-Identifier: Apache-2.0 */
/* Results as long as the plan demands, of a scene without light, for tests that need no renderer. */
#ifndef TESTS_SUPPORT_BLACK_BATCH_H
#define TESTS_SUPPORT_BLACK_BATCH_H

#include "common/wire/batch_wire.h"

/* Makes a batch: weights of 0, or chains that have made an epoch's steps, with states of state_bytes bytes; no
 * tiles. For a plan of samples: its rows. */
struct batch black_batch(const struct lease_key *k, const struct plan *plan, uint32_t state_bytes);

#endif
