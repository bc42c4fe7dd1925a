/* SPDX-License-Identifier: Apache-2.0 */
/*
 * SHA-256 of everything in a worker's result that affects bits: of the values, not of the message's bytes, which
 * another compressor may pack differently. The time that the result took is not included. Any thread; allocates only
 * one list.
 */
#ifndef COORDINATOR_LIVE_JOB_DIGEST_H
#define COORDINATOR_LIVE_JOB_DIGEST_H

#include "common/film/batch.h"
#include "coordinator/core/event.h"

int digest_batch(const struct batch *b, struct batch_digest *out, struct error *e); /* -ENOMEM */

#endif
