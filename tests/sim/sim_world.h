/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A farm in virtual time around the real core: workers that compute, crash, hang, come back, fail, send what is torn or
 * wrong, volunteer, or take what they can get and give nothing; a network that drops, repeats, delays and reorders; a
 * coordinator that dies and remembers what is merged; jobs with priorities and bounds, some cancelled, held, extended
 * while they run or when they are done. Everything follows from one seed. After `calm` seconds the trouble ends and
 * every job must end too.
 *
 * A lease's result is a number made from its key and from the result of the epoch before, as a chain state is, so an
 * epoch merged out of order or from a wrong state shows in the sums. Checked all the time: each lease is merged once
 * and in the order of its epochs; two rounds are open at most; an ended job's sum is that of the undisturbed run after
 * as many rounds, and the rounds are those of the undisturbed run unless a time ended it; of jobs of which everything
 * is verified no wrong result is merged while some workers lie, and nobody is asked twice; no lease goes to a worker of
 * another fingerprint, nor to more than two at once; progress never falls; every job ends.
 */
#ifndef TESTS_SIM_SIM_WORLD_H
#define TESTS_SIM_SIM_WORLD_H

#include <stddef.h>
#include <stdint.h>

struct sim_result {
	uint64_t steps, merged, repeats, refused, crashes, done, failed, cancelled, copies, timeouts, restarts,
		extended;
	uint64_t verified, mismatched, lies, quarantined; /* lies: wrong results that were found out */
	uint64_t hung, hoarded; /* times that a worker stood still; leases that went to workers that never answer */
	double time;		/* virtual seconds */
};

/* NULL, or what is wrong, in one sentence. */
const char *sim_run(uint64_t seed, int trace, struct sim_result *r);

#endif
