/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Power is lost at a random disk call, again and again, while a coordinator takes jobs, merges results, and writes
 * checkpoints and images; each restart continues with what the disk kept (tests/support/faulty_disk.h). All
 * that was acknowledged must be there: jobs, results of leases (an acknowledged lease is not handed out again) and
 * images that were announced. The final image must have the bits of an undisturbed run, which it would not have if a
 * result were missing or counted twice.
 *
 * Then single disk calls fail, the n-th one of a run, in several ways: nothing crashes, a refused request gets a
 * sentence and succeeds later, what was acknowledged stays, and the images have the same bits. The same is done to the
 * disk calls of a start that finds jobs half done.
 *
 * Violations are counted, and each of the two tests ends with a line of what it did and counted:
 * tests/e2e/faults/disk.sh makes rows of a table from these lines.
 *
 * HSLT_POWER_SEEDS: the number of runs (default 150; FULL=1: 4000). HSLT_POWER_SEED: runs this seed alone, with the
 * coordinator's log. HSLT_FAULT, HSLT_FAULT_AT: only this kind of failure, only at this call. HSLT_FAULT_STEP: distance
 * between failing calls (default 72; FULL=1: 1).
 */
#include "common/base/checked_file.h"
#include "common/base/version.h"
#include "coordinator/store/ledger.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/outage.h"
#include "tests/support/shards.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>

enum { STARTS_MAX = 12, KINDS = 4 /* of calls that fail */, TESTS = 4 /* that count */ };

static struct totals { /* over all shares of the work */
	struct outage_findings found;
	_Atomic uint64_t losses, acks, lost_sectors, runs[KINDS], refused[KINDS], failed[KINDS];
} * totals, *current; /* totals: one for each test; current: of the running test */
static unsigned share;

/* ---- runs ---- */

static void run_with_power_losses(uint64_t seed, uint64_t *losses, uint64_t *acks)
{
	static struct outage_run f;
	uint64_t draw = seed;
	outage_begin(&f, seed);
	bool power_cut = false;
	for (int start = 0;; start++) {
		struct lease_key k = {.kind = LEASE_RENDER, .epoch = draw++};
		atomic_store(&outage.disk_counts[0], 0);
		atomic_store(&outage.disk_counts[4], 0);
		f.disk.seed = seed * 100 + (uint64_t)start;
		f.disk.power_loss_at = start < STARTS_MAX && !power_cut
					       ? 1 + scripted_peer_lease_tag(&k) % (outage.undisturbed_calls +
										    outage.undisturbed_calls / 4)
					       : 0;
		bool done = outage_start(&f) && outage_run_jobs(&f);
		if (done && power_cut)
			break;
		if (done) {
			outage_cut_power(&f);
			power_cut = true;
			continue;
		}
		outage_disconnect(&f);
		assert_int_equal(outage_exit_code(&f, true), FAULTY_DISK_EXIT_CODE);
		outage_swap_folders(&f);
	}
	outage_stop(&f);
	*losses += f.power_losses;
	*acks += f.acks;
}

/* Calls fail from the n-th on; then the disk works again, power is lost, and all that was acknowledged must be there.
 */
static void run_with_faults(uint64_t first_call, uint64_t count, int error_code, bool writes_only, uint64_t *refused,
			    uint64_t *failed)
{
	static struct outage_run f;
	outage_begin(&f, first_call);
	f.disk.first_failing_call = first_call;
	f.disk.failing_call_count = count;
	f.disk.failure_errno = error_code;
	f.disk.fail_writes_only = writes_only;
	f.disk.power_loss_after = first_call % 3 ? 1 + first_call % 23 : 0;
	f.has_failing_calls = true;
	for (int start = 0;; start++) {
		assert_true(start < 3);
		atomic_store(&outage.disk_counts[4], 0);
		if (outage_start(&f) && outage_run_jobs(&f))
			break;
		outage_disconnect(&f);
		if (outage_exit_code(&f, true) == FAULTY_DISK_EXIT_CODE)
			outage_swap_folders(&f);
		else
			f.refusals++; /* it did not start, and gave the reason */
		f.disk.first_failing_call = 0;
	}
	outage_cut_power(&f);
	f.disk.first_failing_call = 0;
	f.has_failing_calls = false;
	atomic_store(&outage.disk_counts[4], 0);
	assert_true(outage_start(&f) && outage_run_jobs(&f));
	outage_stop(&f);
	*refused += f.refusals;
	*failed += f.failed_jobs;
}

/* Power is lost in the middle of the work; then calls of the next start fail, from the n-th on. The coordinator starts
 * or says why not; no job fails because of it, and all that was acknowledged is there, after this start or another one.
 */
static bool begin_restart_with_loss(struct outage_run *f, uint64_t seed)
{
	outage_begin(f, seed);
	f->disk.power_loss_at = outage.undisturbed_calls * 3 / 5;
	atomic_store(&outage.disk_counts[4], 0);
	assert_false(outage_start(f) && outage_run_jobs(f));
	outage_disconnect(f);
	assert_int_equal(outage_exit_code(f, true), FAULTY_DISK_EXIT_CODE);
	outage_swap_folders(f);
	f->disk.power_loss_at = 0;
	return f->acks > 0;
}

static uint64_t count_restart_calls(void)
{
	static struct outage_run f;
	assert_true(begin_restart_with_loss(&f, 1) && outage_start(&f));
	uint64_t calls = atomic_load(&outage.disk_counts[1]);
	outage_stop(&f);
	return calls;
}

static void run_failing_restart(uint64_t first_call, uint64_t count, int error_code, uint64_t *refused)
{
	static struct outage_run f;
	assert_true(begin_restart_with_loss(&f, first_call));
	f.disk.first_failing_call = first_call;
	f.disk.failing_call_count = count;
	f.disk.failure_errno = error_code;
	f.has_failing_calls = true;
	bool done = outage_start(&f) && outage_run_jobs(&f);
	assert_int_equal(f.failed_jobs, 0);
	if (!done) {
		outage_disconnect(&f);
		assert_int_equal(outage_exit_code(&f, true), 1);
		++*refused;
		f.disk.first_failing_call = 0;
		f.has_failing_calls = false;
		assert_true(outage_start(&f) && outage_run_jobs(&f));
	}
	outage_stop(&f);
}

static uint64_t env_number(const char *name, uint64_t fallback)
{
	const char *text = getenv(name);
	return text && *text ? strtoull(text, NULL, 10) : fallback;
}

/* ---- tests ---- */

static void begin_test(int number)
{
	current = &totals[number];
	outage.findings = &current->found;
}

static void assert_no_harm(void)
{
	assert_true(!current->found.violations[OUTAGE_LOST] && !current->found.violations[OUTAGE_DUPLICATED] &&
		    !current->found.violations[OUTAGE_DIFFERENT]);
}

static void report_harm(const char *what, uint64_t times)
{
	if (share == 0) /* the last share to get here */
		printf("   %s: times=%llu lost=%llu doubled=%llu images=%llu unequal=%llu\n", what,
		       (unsigned long long)times, (unsigned long long)current->found.violations[OUTAGE_LOST],
		       (unsigned long long)current->found.violations[OUTAGE_DUPLICATED],
		       (unsigned long long)current->found.images_compared,
		       (unsigned long long)current->found.violations[OUTAGE_DIFFERENT]);
	assert_true(share || (times && current->found.images_compared));
	assert_no_harm();
}

static void power_loss_at_any_time_loses_nothing_acknowledged(void **state)
{
	(void)state;
	begin_test(0);
	uint64_t seeds = env_number("HSLT_POWER_SEEDS", env_number("FULL", 0) ? 4000 : 150),
		 only_seed = env_number("HSLT_POWER_SEED", 0);
	seeds = seeds / env_number("HSLT_TEST_SCALE", 1) + 1;
	uint64_t losses = 0, acks = 0;
	outage_run_undisturbed();
	outage.prints_log = only_seed != 0;
	atomic_store(&outage.disk_counts[3], 0);
	for (uint64_t seed = only_seed ? only_seed : 1 + share; seed <= (only_seed ? only_seed : seeds);
	     seed += only_seed ? 1 : SHARDS) {
		snprintf(outage.run_name, sizeof outage.run_name, "HSLT_POWER_SEED=%llu", (unsigned long long)seed);
		run_with_power_losses(seed, &losses, &acks);
	}
	outage.run_name[0] = 0;
	current->losses += losses;
	current->acks += acks;
	current->lost_sectors += atomic_load(&outage.disk_counts[3]);
	bool pass = share || only_seed || shards_wait();
	if (share == 0)
		printf("   %llu runs of %llu calls: %llu sectors and names were lost; %llu batches were acknowledged\n",
		       (unsigned long long)(only_seed ? 1 : seeds), (unsigned long long)outage.undisturbed_calls,
		       (unsigned long long)current->lost_sectors, (unsigned long long)current->acks);
	report_harm("power", current->losses);
	assert_true(pass);
}

static void failing_disk_calls_lose_nothing_acknowledged(void **state)
{
	(void)state;
	static const struct {
		const char *name;
		int with;
		uint64_t count;
		bool writes_only;
	} kinds[KINDS] = {{"EIO", EIO, 1, false},
			  {"ENOSPC", ENOSPC, 40, true},
			  {"EMFILE", EMFILE, 1, false},
			  {"EROFS", EROFS, 10, false}};
	uint64_t only_call = env_number("HSLT_FAULT_AT", 0),
		 step = env_number("FULL", 0)
				? SHARDS
				: env_number("HSLT_FAULT_STEP", 18 * SHARDS * env_number("HSLT_TEST_SCALE", 1));
	if (env_number("HSLT_POWER_SEED", 0))
		skip();
	begin_test(1);
	outage_run_undisturbed();
	outage.prints_log = only_call != 0;
	uint64_t calls = atomic_load(&outage.disk_counts[1]), times = 0;
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
		uint64_t refused = 0, failed = 0, runs = 0;
		if (getenv("HSLT_FAULT") && strcmp(getenv("HSLT_FAULT"), kinds[k].name) != 0)
			continue;
		for (uint64_t first_call = only_call ? only_call : 1 + share + SHARDS * k;
		     first_call < (only_call ? only_call + 1 : calls); first_call += step, runs++) {
			snprintf(outage.run_name, sizeof outage.run_name, "HSLT_FAULT=%s HSLT_FAULT_AT=%llu",
				 kinds[k].name, (unsigned long long)first_call);
			run_with_faults(first_call, kinds[k].count, kinds[k].with, kinds[k].writes_only, &refused,
					&failed);
		}
		outage.run_name[0] = 0;
		current->refused[k] += refused;
		current->failed[k] += failed;
		times += atomic_fetch_add(&current->runs[k], runs) + runs;
		if (share == 0)
			printf("   %s at %llu of %llu calls: %llu refusals, %llu jobs failed and said so\n",
			       kinds[k].name, (unsigned long long)current->runs[k], (unsigned long long)calls,
			       (unsigned long long)current->refused[k], (unsigned long long)current->failed[k]);
	}
	report_harm("failing calls", times);
}

static void failing_calls_of_a_start_lose_nothing_acknowledged(void **state)
{
	(void)state;
	static const struct {
		const char *name;
		int with;
		uint64_t count;
	} kinds[] = {{"EIO", EIO, 1}, {"EMFILE", EMFILE, 3}};
	uint64_t only_call = env_number("HSLT_FAULT_AT", 0),
		 step = env_number("FULL", 0)
				? SHARDS
				: env_number("HSLT_FAULT_STEP", 5 * SHARDS * env_number("HSLT_TEST_SCALE", 1));
	if (env_number("HSLT_POWER_SEED", 0))
		skip();
	begin_test(2);
	outage_run_undisturbed();
	uint64_t calls = count_restart_calls(), times = 0;
	outage.prints_log = only_call != 0;
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
		uint64_t refused = 0, runs = 0;
		if (getenv("HSLT_FAULT") && strcmp(getenv("HSLT_FAULT"), kinds[k].name) != 0)
			continue;
		for (uint64_t first_call = only_call ? only_call : 1 + share + SHARDS * k;
		     first_call < (only_call ? only_call + 1 : calls); first_call += step, runs++) {
			snprintf(outage.run_name, sizeof outage.run_name,
				 "of a restart: HSLT_FAULT=%s HSLT_FAULT_AT=%llu", kinds[k].name,
				 (unsigned long long)first_call);
			run_failing_restart(first_call, kinds[k].count, kinds[k].with, &refused);
		}
		outage.run_name[0] = 0;
		current->refused[k] += refused;
		times += atomic_fetch_add(&current->runs[k], runs) + runs;
		if (share == 0)
			printf("   %s at %llu of %llu calls of a restart: %llu did not start, none failed\n",
			       kinds[k].name, (unsigned long long)current->runs[k], (unsigned long long)calls,
			       (unsigned long long)current->refused[k]);
	}
	report_harm("failing starts", times);
}

/* ---- rows that another version wrote, and files that somebody removed ---- */

enum { FILE_SIZE_MAX = 1 << 20 };

static size_t load_file(const char *path, unsigned char bytes[FILE_SIZE_MAX])
{
	FILE *f = fopen(path, "rb");
	size_t n = f ? fread(bytes, 1, FILE_SIZE_MAX, f) : 0;
	assert_true(f && n && n < FILE_SIZE_MAX);
	fclose(f);
	return n;
}

static void write_file(const char *path, const unsigned char *bytes, size_t size, bool check)
{
	struct checked_file out;
	struct error e;
	FILE *f = fopen(path, "wb");
	assert_true(f && fwrite(bytes, 1, size, f) == size && fclose(f) == 0);
	if (!check)
		return;
	assert_int_equal(checked_file_create(&out, path, &e), 0);
	assert_int_equal(checked_file_write(&out, bytes, size - sizeof(uint32_t), &e), 0);
	assert_int_equal(checked_file_finish(&out, &e), 0);
	checked_file_close(&out);
}

/* Changes a submission to what another version may have written, longer by `more` bytes. */
static void change_row(uint64_t id, const char *version, int more)
{
	static unsigned char submission[FILE_SIZE_MAX];
	struct ledger *l;
	struct ledger_job j;
	struct error e;
	assert_int_equal(ledger_open(&l, outage.spool, &e), 0);
	assert_int_equal(ledger_read_row(l, id, &j, &e), 1);
	memcpy(submission, j.submission, j.submission_size);
	submission[j.submission_size] = 0;
	j.submission = submission;
	j.submission_size += (size_t)more;
	j.version = version;
	j.revision++;
	assert_int_equal(ledger_write_row(l, &j, &e), 0);
	ledger_close(l);
}

/* Returns the number of files of that name; path becomes the last one's. */
static size_t find_last_file(uint64_t job, const char *name, char path[256])
{
	glob_t g;
	snprintf(path, 256, "%s/jobs/j%llu/%s", outage.spool, (unsigned long long)job, name);
	size_t count = glob(path, 0, NULL, &g) ? 0 : g.gl_pathc;
	if (count) {
		snprintf(path, 256, "%s", g.gl_pathv[count - 1]);
		globfree(&g);
	}
	return count;
}

static bool job_is_ended(uint64_t id)
{
	struct ledger *l;
	struct ledger_job j;
	struct error e;
	assert_int_equal(ledger_open(&l, outage.spool, &e), 0);
	bool done = ledger_read_row(l, id, &j, &e) > 0 && j.end_time > 0;
	ledger_close(l);
	return done;
}

/* Returns the first job that the next start continues from a checkpoint and a journal; 0: none. A second journal would
 * belong to a checkpoint that was not renamed: it is removed unread. */
static uint64_t find_live_job(void)
{
	char path[256];
	for (uint64_t id = 1; id < OUTAGE_JOBS_MAX; id++) {
		struct stat journal;
		if (!find_last_file(id, "checkpoint", path) || find_last_file(id, "journal.*", path) != 1 ||
		    stat(path, &journal) || !journal.st_size)
			continue;
		if (!job_is_ended(id))
			return id;
	}
	return 0;
}

/* How far a job has come when power is lost is a matter of chance. */
static uint64_t begin_restart_with_live_job(struct outage_run *f)
{
	uint64_t id = 0;
	for (uint64_t seed = 7; !id && seed < 50; seed++)
		id = begin_restart_with_loss(f, seed) ? find_live_job() : 0;
	assert_true(id && f->jobs[id].submitted);
	return id;
}

static void files_of_another_version_stop_the_start(void **state)
{
	(void)state;
	static const char *const names[] = {"checkpoint", "journal.*"};
	static struct outage_run f;
	static unsigned char before[FILE_SIZE_MAX], bytes[FILE_SIZE_MAX];
	if (share || env_number("HSLT_POWER_SEED", 0) || env_number("HSLT_FAULT_AT", 0))
		skip();
	begin_test(3);
	outage_run_undisturbed();
	uint64_t id = begin_restart_with_live_job(&f);
	f.has_failing_calls = true;
	for (int i = 0; i < 2; i++) {
		char path[256];
		assert_true(find_last_file(id, names[i], path) > 0);
		size_t size = load_file(path, before);
		memcpy(bytes, before, size);
		memcpy(bytes + 5, "999", 3);
		write_file(path, bytes, size, i == 0);
		load_file(path, bytes);
		assert_false(outage_start(&f));
		assert_int_equal(f.exit_code, 1);
		static unsigned char after_it[FILE_SIZE_MAX];
		assert_int_equal(load_file(path, after_it), size);
		assert_memory_equal(bytes, after_it, size);
		write_file(path, before, size, false);
	}
	change_row(id, "99", 1);
	assert_false(outage_start(&f));
	assert_int_equal(f.exit_code, 1);
	change_row(id, HSLT_VERSION, -1);
	f.has_failing_calls = false;
	assert_true(outage_start(&f) && outage_run_jobs(&f));
	outage_stop(&f);
	assert_no_harm();
}

/* The job's folder was removed: the job fails for good; the others go on. */
static void job_whose_folder_was_removed_fails_alone(void **state)
{
	(void)state;
	static struct outage_run f;
	if (share || env_number("HSLT_POWER_SEED", 0) || env_number("HSLT_FAULT_AT", 0))
		skip();
	begin_test(3);
	outage_run_undisturbed();
	uint64_t id = begin_restart_with_live_job(&f);
	char command[300];
	snprintf(command, sizeof command, "rm -r '%s/jobs/j%llu'", outage.spool, (unsigned long long)id);
	assert_int_equal(system(command), 0);
	f.has_failing_calls = true;
	assert_true(outage_start(&f) && outage_run_jobs(&f)); /* outage_run_jobs submits another job in its place */
	assert_int_equal(f.failed_jobs, 1);
	assert_false(f.jobs[id].submitted);
	outage_stop(&f);
	assert_true(outage_start(&f) && outage_run_jobs(&f));
	assert_int_equal(f.failed_jobs, 1);
	outage_stop(&f);
	assert_no_harm();
}

static int tear_down(void **state)
{
	if (*outage.run_name)
		print_error("failed: %s\n", outage.run_name);
	outage.run_name[0] = 0;
	return temporary_folder_tear_down(state);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(power_loss_at_any_time_loses_nothing_acknowledged,
						temporary_folder_set_up, tear_down),
		cmocka_unit_test_setup_teardown(failing_disk_calls_lose_nothing_acknowledged, temporary_folder_set_up,
						tear_down),
		cmocka_unit_test_setup_teardown(failing_calls_of_a_start_lose_nothing_acknowledged,
						temporary_folder_set_up, tear_down),
		cmocka_unit_test_setup_teardown(files_of_another_version_stop_the_start, temporary_folder_set_up,
						tear_down),
		cmocka_unit_test_setup_teardown(job_whose_folder_was_removed_fails_alone, temporary_folder_set_up,
						tear_down),
	};
	size_t size = TESTS * sizeof *totals + SHARDS * FAULTY_DISK_COUNTS * sizeof *outage.disk_counts;
	totals = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (totals == MAP_FAILED)
		return 1;
	outage.disk_counts = (_Atomic uint64_t *)(totals + TESTS);
	if (!env_number("HSLT_POWER_SEED", 0))
		share = shards_begin();
	outage.disk_counts += share * FAULTY_DISK_COUNTS;
	return cmocka_run_group_tests(tests, NULL, NULL);
}
