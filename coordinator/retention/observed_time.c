/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/observed_time.h"

#include "common/base/clock.h"
#include "common/base/disk.h"
#include "common/base/mem.h"

#include <fcntl.h>
#include <string.h>

static const char note_name[] = "clock"; /* name of the note in the ledger */

static struct age_clock read_clocks(void)
{
	struct age_clock now = {.uptime = clock_read_seconds(CLOCK_BOOTTIME), .wall_time = clock_wall_seconds()};
	int fd = disk_open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC, 0);
	ssize_t n = fd < 0 ? 0 : disk_read(fd, now.boot_id, sizeof now.boot_id - 1);
	if (fd >= 0)
		disk_close(fd);
	now.boot_id[n > 0 ? n : 0] = 0;
	now.boot_id[strcspn(now.boot_id, " \n")] = 0;
	return now;
}

void observed_time_open(struct jobs *jobs)
{
	struct age_clock last;
	struct error e = {""};
	char *text;
	int rc = ledger_get_note(jobs->ledger, note_name, &text, &e);
	if (!rc) {
		if ((rc = age_clock_from_text(text, strlen(text), &last)))
			error_set(&e, EBADMSG,
				  "the note %s in jobs.db is damaged: finished jobs count as if they had just ended",
				  note_name);
		mem_free(text);
	}
	if (rc && rc != -ENOENT)
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	jobs->observed_clock = read_clocks();
	age_clock_advance(&jobs->observed_clock, rc ? NULL : &last,
			  age_clock_max_credit(jobs->config.retention_seconds));
	observed_time_store(jobs);
}

double observed_time_now(const struct jobs *jobs)
{
	double since = clock_read_seconds(CLOCK_BOOTTIME) - jobs->observed_clock.uptime;
	return jobs->observed_clock.observed_seconds + (since > 0 ? since : 0);
}

void observed_time_store(const struct jobs *jobs)
{
	char text[AGE_CLOCK_TEXT_MAX];
	struct error e;
	struct age_clock now = read_clocks();
	now.observed_seconds = observed_time_now(jobs);
	age_clock_to_text(&now, text);
	if (ledger_set_note(jobs->ledger, note_name, text, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"it will be tried again\"", log_quote(e.text).text);
}
