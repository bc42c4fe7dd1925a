/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What of a worker's answer decides bits, as one SHA-256: the numbers themselves, not the bytes of the message, which
 * another compressor may pack otherwise. Left out: the time that it took. Any thread; allocates nothing but one list.
 */
#ifndef COORDINATOR_JOB_DIGEST_H
#define COORDINATOR_JOB_DIGEST_H

#include "common/film/batch.h"
#include "coordinator/core/event.h"

int digest_batch(const struct batch *b, struct batch_digest *out, struct error *e); /* -ENOMEM */

#endif
