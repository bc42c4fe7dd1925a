/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/age_clock.h"

#include "common/base/crc.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

double age_clock_credit(double keep)
{
	return keep > 0 && keep < AGE_CLOCK_SHARE * AGE_CLOCK_CREDIT ? keep / AGE_CLOCK_SHARE : AGE_CLOCK_CREDIT;
}

void age_clock_advance(struct age_clock *now, const struct age_clock *last, double credit)
{
	now->seconds = last ? last->seconds : 0;
	if (!last)
		return;
	if (*now->boot && strcmp(now->boot, last->boot) == 0)
		now->seconds += fmax(0, now->up - last->up);
	else
		now->seconds += fmin(fmax(0, now->wall - last->wall), credit);
}

size_t age_clock_to_text(const struct age_clock *s, char text[AGE_CLOCK_TEXT])
{
	int n = snprintf(text, AGE_CLOCK_TEXT, "seen %.3f up %.3f wall %.3f boot %s", s->seconds, s->up, s->wall,
			 *s->boot ? s->boot : "-");
	n += snprintf(text + n, AGE_CLOCK_TEXT - (size_t)n, " crc32c %08x\n", (unsigned)crc32c(0, text, (size_t)n));
	return (size_t)n;
}

int age_clock_from_text(const char *text, size_t size, struct age_clock *s)
{
	char line[AGE_CLOCK_TEXT], boot[AGE_CLOCK_BOOT];
	unsigned check;
	if (size >= sizeof line)
		return -EBADMSG;
	memcpy(line, text, size);
	line[size] = 0;
	const char *end = strstr(line, " crc32c ");
	if (!end || sscanf(end, " crc32c %8x", &check) != 1 || check != crc32c(0, line, (size_t)(end - line)) ||
	    sscanf(line, "seen %lf up %lf wall %lf boot %39s", &s->seconds, &s->up, &s->wall, boot) != 4)
		return -EBADMSG;
	snprintf(s->boot, sizeof s->boot, "%s", strcmp(boot, "-") == 0 ? "" : boot);
	return isfinite(s->seconds) && s->seconds >= 0 ? 0 : -EBADMSG;
}
