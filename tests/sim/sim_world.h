/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A farm in virtual time around the real core. Its workers compute, crash, hang, come back, fail, send damaged or wrong
 * results, send results without a lease, or hoard leases without answering. Its network drops, repeats, delays and
 * reorders messages. Its coordinator dies and remembers what is merged. Its jobs have priorities and bounds; some are
 * cancelled, held, or extended while they run or after they are done. Everything follows from one seed. After
 * `calm_from` seconds the trouble ends, and then every job must end, too.
 *
 * The result of a lease is a number computed from its key and from the result of the previous epoch, as a chain state
 * is, so an epoch that is merged out of order or from a wrong state shows in the sums. The following is checked
 * throughout: each lease is merged once, in the order of epochs; at most two rounds are open; the sum of an ended job
 * is that of an undisturbed run after as many rounds, and the number of rounds is the undisturbed one unless the job
 * ended by time; if everything is verified while some workers lie, no wrong result is merged and no worker is asked
 * twice; no lease goes to a worker of another fingerprint, or to more than two workers at once; progress never falls;
 * every job ends.
 */
#ifndef TESTS_SIM_SIM_WORLD_H
#define TESTS_SIM_SIM_WORLD_H

#include <stddef.h>
#include <stdint.h>

struct sim_result {
	uint64_t steps, merged, repeats, refused, crashes, done, failed, cancelled, duplicates, timeouts, restarts,
		extended;
	uint64_t verified, mismatched, lies, quarantined; /* lies: wrong results that were detected */
	uint64_t hangs, hoarded; /* hangs: how often workers froze; hoarded: leases of workers that never answer */
	double time;		 /* virtual seconds */
};

/* Returns NULL, or a sentence that says what is wrong. */
const char *sim_run(uint64_t seed, int trace, struct sim_result *r);

#endif
