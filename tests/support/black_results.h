/* SPDX-License-Identifier: Apache-2.0 */
/* Results as long as the plan says, of a scene in which there is no light: what tests begin with that need no renderer.
 */
#ifndef TESTS_SUPPORT_BLACK_RESULTS_H
#define TESTS_SUPPORT_BLACK_RESULTS_H

#include "common/wire/batch_wire.h"

/* Weights of 0, or chains that did what an epoch asks for, with states of so many bytes; no tiles. Of a plan of
 * samples: its rows. */
struct batch black_batch(const struct lease_key *k, const struct plan *plan, uint32_t state_bytes);

#endif
