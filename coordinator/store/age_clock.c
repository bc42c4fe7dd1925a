/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/age_clock.h"

#include "common/base/crc.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

double age_clock_max_credit(double retention_seconds)
{
	return retention_seconds > 0 && retention_seconds < AGE_CLOCK_CREDIT_DIVISOR * AGE_CLOCK_CREDIT_MAX
		       ? retention_seconds / AGE_CLOCK_CREDIT_DIVISOR
		       : AGE_CLOCK_CREDIT_MAX;
}

void age_clock_advance(struct age_clock *now, const struct age_clock *previous, double max_credit)
{
	now->observed_seconds = previous ? previous->observed_seconds : 0;
	if (!previous)
		return;
	if (*now->boot_id && strcmp(now->boot_id, previous->boot_id) == 0)
		now->observed_seconds += fmax(0, now->uptime - previous->uptime);
	else
		now->observed_seconds += fmin(fmax(0, now->wall_time - previous->wall_time), max_credit);
}

size_t age_clock_to_text(const struct age_clock *s, char text[AGE_CLOCK_TEXT_MAX])
{
	int n = snprintf(text, AGE_CLOCK_TEXT_MAX, "seen %.3f up %.3f wall %.3f boot %s", s->observed_seconds,
			 s->uptime, s->wall_time, *s->boot_id ? s->boot_id : "-");
	n += snprintf(text + n, AGE_CLOCK_TEXT_MAX - (size_t)n, " crc32c %08x\n", (unsigned)crc32c(0, text, (size_t)n));
	return (size_t)n;
}

int age_clock_from_text(const char *text, size_t size, struct age_clock *s)
{
	char line[AGE_CLOCK_TEXT_MAX], boot[AGE_CLOCK_BOOT_ID_SIZE];
	unsigned check;
	if (size >= sizeof line)
		return -EBADMSG;
	memcpy(line, text, size);
	line[size] = 0;
	const char *end = strstr(line, " crc32c ");
	if (!end || sscanf(end, " crc32c %8x", &check) != 1 || check != crc32c(0, line, (size_t)(end - line)) ||
	    sscanf(line, "seen %lf up %lf wall %lf boot %39s", &s->observed_seconds, &s->uptime, &s->wall_time, boot) !=
		    4)
		return -EBADMSG;
	snprintf(s->boot_id, sizeof s->boot_id, "%s", strcmp(boot, "-") == 0 ? "" : boot);
	return isfinite(s->observed_seconds) && s->observed_seconds >= 0 ? 0 : -EBADMSG;
}
