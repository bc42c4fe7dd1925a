/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/ages.h"

#include "common/base/clock.h"
#include "common/base/disk.h"
#include "common/base/mem.h"

#include <fcntl.h>
#include <string.h>

static const char note[] = "clock"; /* name of the note in the ledger */

static struct age_clock read_clocks(void)
{
	struct age_clock now = {.up = clock_seconds_of(CLOCK_BOOTTIME), .wall = clock_wall_seconds()};
	int fd = disk_open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC, 0);
	ssize_t n = fd < 0 ? 0 : disk_read(fd, now.boot, sizeof now.boot - 1);
	if (fd >= 0)
		disk_close(fd);
	now.boot[n > 0 ? n : 0] = 0;
	now.boot[strcspn(now.boot, " \n")] = 0;
	return now;
}

void ages_open(struct jobs *jobs)
{
	struct age_clock last;
	struct error e = {""};
	char *text;
	int rc = ledger_note(jobs->ledger, note, &text, &e);
	if (!rc) {
		if ((rc = age_clock_from_text(text, strlen(text), &last)))
			error_set(&e, EBADMSG,
				  "the note %s in jobs.db is damaged: finished jobs count as if they had just ended",
				  note);
		mem_free(text);
	}
	if (rc && rc != -ENOENT)
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	jobs->seen = read_clocks();
	age_clock_advance(&jobs->seen, rc ? NULL : &last, age_clock_credit(jobs->config.clear_seconds));
	ages_keep(jobs);
}

double ages_now(const struct jobs *jobs)
{
	double since = clock_seconds_of(CLOCK_BOOTTIME) - jobs->seen.up;
	return jobs->seen.seconds + (since > 0 ? since : 0);
}

void ages_keep(const struct jobs *jobs)
{
	char text[AGE_CLOCK_TEXT];
	struct error e;
	struct age_clock now = read_clocks();
	now.seconds = ages_now(jobs);
	age_clock_to_text(&now, text);
	if (ledger_set(jobs->ledger, note, text, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"it will be tried again\"", log_quote(e.text).text);
}
