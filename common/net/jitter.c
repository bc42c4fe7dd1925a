/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/jitter.h"

#include <uv.h>

double jitter_seconds(double seconds)
{
	unsigned char random = 128; /* used if the system has no random numbers */
	uv_random(NULL, NULL, &random, 1, 0, NULL);
	return seconds * (0.5 + (double)random / 255);
}
