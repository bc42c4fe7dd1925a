/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Power is lost at a random disk call, again and again, while a coordinator takes jobs, merges results, and writes
 * checkpoints and images; each restart continues with what the disk kept (tests/support/faulty_disk.h). All that was
 * acknowledged must be there: jobs, results of leases (an acknowledged lease is not handed out again) and images that
 * were announced. The final image must have the bits of an undisturbed run, which it would not have if a result were
 * missing or counted twice.
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
#include "tests/support/folder.h"
#include "tests/support/outage.h"
#include "tests/support/shares.h"

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

static struct sums { /* over all shares of the work */
	struct outage_found found;
	_Atomic uint64_t losses, acks, taken, runs[KINDS], refused[KINDS], failed[KINDS];
} * sums, *now; /* sums: one for each test; now: of the running test */
static unsigned share;

/* ---- runs ---- */

static void run_seed(uint64_t seed, uint64_t *losses, uint64_t *acks)
{
	static struct farm_run f;
	uint64_t draw = seed;
	outage_begin(&f, seed);
	bool power_cut = false;
	for (int start = 0;; start++) {
		struct lease_key k = {.kind = LEASE_RENDER, .epoch = draw++};
		atomic_store(&outage.counts[0], 0);
		atomic_store(&outage.counts[4], 0);
		f.disk.seed = seed * 100 + (uint64_t)start;
		f.disk.lose_at = start < STARTS_MAX && !power_cut
					 ? 1 + scripted_tag(&k) % (outage.quiet_calls + outage.quiet_calls / 4)
					 : 0;
		bool done = outage_start(&f) && outage_work(&f);
		if (done && power_cut)
			break;
		if (done) {
			outage_cut_power(&f);
			power_cut = true;
			continue;
		}
		outage_hang_up(&f);
		assert_int_equal(outage_gone(&f, true), FAULTY_DISK_EXIT);
		outage_swap_folders(&f);
	}
	outage_stop(&f);
	*losses += f.losses;
	*acks += f.acks;
}

/* Calls fail from the n-th on; then the disk works again, power is lost, and all that was acknowledged must be there.
 */
static void run_faults(uint64_t from, uint64_t count, int with, bool writes_only, uint64_t *refused, uint64_t *failed)
{
	static struct farm_run f;
	outage_begin(&f, from);
	f.disk.fail_from = from;
	f.disk.fail_count = count;
	f.disk.fail_with = with;
	f.disk.fail_writes_only = writes_only;
	f.disk.lose_after = from % 3 ? 1 + from % 23 : 0;
	f.faulty = true;
	for (int start = 0;; start++) {
		assert_true(start < 3);
		atomic_store(&outage.counts[4], 0);
		if (outage_start(&f) && outage_work(&f))
			break;
		outage_hang_up(&f);
		if (outage_gone(&f, true) == FAULTY_DISK_EXIT)
			outage_swap_folders(&f);
		else
			f.refused++; /* it did not start, and gave the reason */
		f.disk.fail_from = 0;
	}
	outage_cut_power(&f);
	f.disk.fail_from = 0;
	f.faulty = false;
	atomic_store(&outage.counts[4], 0);
	assert_true(outage_start(&f) && outage_work(&f));
	outage_stop(&f);
	*refused += f.refused;
	*failed += f.failed;
}

/* Power is lost in the middle of the work; then calls of the next start fail, from the n-th on. The coordinator starts
 * or says why not; no job fails because of it, and all that was acknowledged is there, after this start or another one.
 */
static bool begin_restart(struct farm_run *f, uint64_t from)
{
	outage_begin(f, from);
	f->disk.lose_at = outage.quiet_calls * 3 / 5;
	atomic_store(&outage.counts[4], 0);
	assert_false(outage_start(f) && outage_work(f));
	outage_hang_up(f);
	assert_int_equal(outage_gone(f, true), FAULTY_DISK_EXIT);
	outage_swap_folders(f);
	f->disk.lose_at = 0;
	return f->acks > 0;
}

static uint64_t restart_calls(void)
{
	static struct farm_run f;
	assert_true(begin_restart(&f, 1) && outage_start(&f));
	uint64_t calls = atomic_load(&outage.counts[1]);
	outage_stop(&f);
	return calls;
}

static void run_restart(uint64_t from, uint64_t count, int with, uint64_t *refused)
{
	static struct farm_run f;
	assert_true(begin_restart(&f, from));
	f.disk.fail_from = from;
	f.disk.fail_count = count;
	f.disk.fail_with = with;
	f.faulty = true;
	bool done = outage_start(&f) && outage_work(&f);
	assert_int_equal(f.failed, 0);
	if (!done) {
		outage_hang_up(&f);
		assert_int_equal(outage_gone(&f, true), 1);
		++*refused;
		f.disk.fail_from = 0;
		f.faulty = false;
		assert_true(outage_start(&f) && outage_work(&f));
	}
	outage_stop(&f);
}

static uint64_t env_number(const char *name, uint64_t otherwise)
{
	const char *text = getenv(name);
	return text && *text ? strtoull(text, NULL, 10) : otherwise;
}

/* ---- tests ---- */

static void begin_test(int number)
{
	now = &sums[number];
	outage.found = &now->found;
}

static void assert_no_harm(void)
{
	assert_true(!now->found.harm[LOST] && !now->found.harm[DOUBLED] && !now->found.harm[UNEQUAL]);
}

static void say_harm(const char *what, uint64_t times)
{
	if (share == 0) /* the last share to get here */
		printf("   %s: times=%llu lost=%llu doubled=%llu images=%llu unequal=%llu\n", what,
		       (unsigned long long)times, (unsigned long long)now->found.harm[LOST],
		       (unsigned long long)now->found.harm[DOUBLED], (unsigned long long)now->found.images,
		       (unsigned long long)now->found.harm[UNEQUAL]);
	assert_true(share || (times && now->found.images));
	assert_no_harm();
}

static void power_goes_at_any_time(void **state)
{
	(void)state;
	begin_test(0);
	uint64_t seeds = env_number("HSLT_POWER_SEEDS", env_number("FULL", 0) ? 4000 : 150),
		 one = env_number("HSLT_POWER_SEED", 0);
	seeds = seeds / env_number("HSLT_TEST_SCALE", 1) + 1;
	uint64_t losses = 0, acks = 0;
	outage_quiet_run();
	outage.loud = one != 0;
	atomic_store(&outage.counts[3], 0);
	for (uint64_t seed = one ? one : 1 + share; seed <= (one ? one : seeds); seed += one ? 1 : SHARES) {
		snprintf(outage.running, sizeof outage.running, "HSLT_POWER_SEED=%llu", (unsigned long long)seed);
		run_seed(seed, &losses, &acks);
	}
	outage.running[0] = 0;
	now->losses += losses;
	now->acks += acks;
	now->taken += atomic_load(&outage.counts[3]);
	bool pass = share || one || shares_pass();
	if (share == 0)
		printf("   %llu runs of %llu calls: %llu sectors and names were lost; %llu batches were acknowledged\n",
		       (unsigned long long)(one ? 1 : seeds), (unsigned long long)outage.quiet_calls,
		       (unsigned long long)now->taken, (unsigned long long)now->acks);
	say_harm("power", now->losses);
	assert_true(pass);
}

static void calls_fail_at_any_time(void **state)
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
	uint64_t one = env_number("HSLT_FAULT_AT", 0),
		 step = env_number("FULL", 0)
				? SHARES
				: env_number("HSLT_FAULT_STEP", 18 * SHARES * env_number("HSLT_TEST_SCALE", 1));
	if (env_number("HSLT_POWER_SEED", 0))
		skip();
	begin_test(1);
	outage_quiet_run();
	outage.loud = one != 0;
	uint64_t calls = atomic_load(&outage.counts[1]), times = 0;
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
		uint64_t refused = 0, failed = 0, runs = 0;
		if (getenv("HSLT_FAULT") && strcmp(getenv("HSLT_FAULT"), kinds[k].name) != 0)
			continue;
		for (uint64_t from = one ? one : 1 + share + SHARES * k; from < (one ? one + 1 : calls);
		     from += step, runs++) {
			snprintf(outage.running, sizeof outage.running, "HSLT_FAULT=%s HSLT_FAULT_AT=%llu",
				 kinds[k].name, (unsigned long long)from);
			run_faults(from, kinds[k].count, kinds[k].with, kinds[k].writes_only, &refused, &failed);
		}
		outage.running[0] = 0;
		now->refused[k] += refused;
		now->failed[k] += failed;
		times += atomic_fetch_add(&now->runs[k], runs) + runs;
		if (share == 0)
			printf("   %s at %llu of %llu calls: %llu refusals, %llu jobs failed and said so\n",
			       kinds[k].name, (unsigned long long)now->runs[k], (unsigned long long)calls,
			       (unsigned long long)now->refused[k], (unsigned long long)now->failed[k]);
	}
	say_harm("failing calls", times);
}

static void starts_fail_at_any_time(void **state)
{
	(void)state;
	static const struct {
		const char *name;
		int with;
		uint64_t count;
	} kinds[] = {{"EIO", EIO, 1}, {"EMFILE", EMFILE, 3}};
	uint64_t one = env_number("HSLT_FAULT_AT", 0),
		 step = env_number("FULL", 0)
				? SHARES
				: env_number("HSLT_FAULT_STEP", 5 * SHARES * env_number("HSLT_TEST_SCALE", 1));
	if (env_number("HSLT_POWER_SEED", 0))
		skip();
	begin_test(2);
	outage_quiet_run();
	uint64_t calls = restart_calls(), times = 0;
	outage.loud = one != 0;
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
		uint64_t refused = 0, runs = 0;
		if (getenv("HSLT_FAULT") && strcmp(getenv("HSLT_FAULT"), kinds[k].name) != 0)
			continue;
		for (uint64_t from = one ? one : 1 + share + SHARES * k; from < (one ? one + 1 : calls);
		     from += step, runs++) {
			snprintf(outage.running, sizeof outage.running,
				 "of a restart: HSLT_FAULT=%s HSLT_FAULT_AT=%llu", kinds[k].name,
				 (unsigned long long)from);
			run_restart(from, kinds[k].count, kinds[k].with, &refused);
		}
		outage.running[0] = 0;
		now->refused[k] += refused;
		times += atomic_fetch_add(&now->runs[k], runs) + runs;
		if (share == 0)
			printf("   %s at %llu of %llu calls of a restart: %llu did not start, none failed\n",
			       kinds[k].name, (unsigned long long)now->runs[k], (unsigned long long)calls,
			       (unsigned long long)now->refused[k]);
	}
	say_harm("failing starts", times);
}

/* ---- rows that another version wrote, and files that somebody removed ---- */

enum { FILE_MOST = 1 << 20 };

static size_t load(const char *path, unsigned char bytes[FILE_MOST])
{
	FILE *f = fopen(path, "rb");
	size_t n = f ? fread(bytes, 1, FILE_MOST, f) : 0;
	assert_true(f && n && n < FILE_MOST);
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
	static unsigned char submission[FILE_MOST];
	struct ledger *l;
	struct ledger_job j;
	struct error e;
	assert_int_equal(ledger_open(&l, outage.root, &e), 0);
	assert_int_equal(ledger_get(l, id, &j, &e), 1);
	memcpy(submission, j.submission, j.submission_size);
	submission[j.submission_size] = 0;
	j.submission = submission;
	j.submission_size += (size_t)more;
	j.version = version;
	j.revision++;
	assert_int_equal(ledger_put(l, &j, &e), 0);
	ledger_close(l);
}

/* Returns the number of files of that name; path becomes the last one's. */
static size_t last_file(uint64_t job, const char *name, char path[256])
{
	glob_t g;
	snprintf(path, 256, "%s/jobs/j%llu/%s", outage.root, (unsigned long long)job, name);
	size_t count = glob(path, 0, NULL, &g) ? 0 : g.gl_pathc;
	if (count) {
		snprintf(path, 256, "%s", g.gl_pathv[count - 1]);
		globfree(&g);
	}
	return count;
}

static bool is_done(uint64_t id)
{
	struct ledger *l;
	struct ledger_job j;
	struct error e;
	assert_int_equal(ledger_open(&l, outage.root, &e), 0);
	bool done = ledger_get(l, id, &j, &e) > 0 && j.ended > 0;
	ledger_close(l);
	return done;
}

/* Returns the first job that the next start continues from a checkpoint and a journal; 0: none. A second journal would
 * belong to a checkpoint that was not renamed: it is removed unread. */
static uint64_t living_job(void)
{
	char path[256];
	for (uint64_t id = 1; id < IDS_MAX; id++) {
		struct stat journal;
		if (!last_file(id, "checkpoint", path) || last_file(id, "journal.*", path) != 1 ||
		    stat(path, &journal) || !journal.st_size)
			continue;
		if (!is_done(id))
			return id;
	}
	return 0;
}

/* How far a job has come when power is lost is a matter of chance. */
static uint64_t begin_living_restart(struct farm_run *f)
{
	uint64_t id = 0;
	for (uint64_t from = 7; !id && from < 50; from++)
		id = begin_restart(f, from) ? living_job() : 0;
	assert_true(id && f->jobs[id].submitted);
	return id;
}

static void of_another_version(void **state)
{
	(void)state;
	static const char *const names[] = {"checkpoint", "journal.*"};
	static struct farm_run f;
	static unsigned char before[FILE_MOST], bytes[FILE_MOST];
	if (share || env_number("HSLT_POWER_SEED", 0) || env_number("HSLT_FAULT_AT", 0))
		skip();
	begin_test(3);
	outage_quiet_run();
	uint64_t id = begin_living_restart(&f);
	f.faulty = true;
	for (int i = 0; i < 2; i++) {
		char path[256];
		assert_true(last_file(id, names[i], path) > 0);
		size_t size = load(path, before);
		memcpy(bytes, before, size);
		memcpy(bytes + 5, "999", 3);
		write_file(path, bytes, size, i == 0);
		load(path, bytes);
		assert_false(outage_start(&f));
		assert_int_equal(f.code, 1);
		static unsigned char after_it[FILE_MOST];
		assert_int_equal(load(path, after_it), size);
		assert_memory_equal(bytes, after_it, size);
		write_file(path, before, size, false);
	}
	change_row(id, "99", 1);
	assert_false(outage_start(&f));
	assert_int_equal(f.code, 1);
	change_row(id, HSLT_VERSION, -1);
	f.faulty = false;
	assert_true(outage_start(&f) && outage_work(&f));
	outage_stop(&f);
	assert_no_harm();
}

/* The job's folder was removed: the job fails for good; the others go on. */
static void without_its_folder(void **state)
{
	(void)state;
	static struct farm_run f;
	if (share || env_number("HSLT_POWER_SEED", 0) || env_number("HSLT_FAULT_AT", 0))
		skip();
	begin_test(3);
	outage_quiet_run();
	uint64_t id = begin_living_restart(&f);
	char command[300];
	snprintf(command, sizeof command, "rm -r '%s/jobs/j%llu'", outage.root, (unsigned long long)id);
	assert_int_equal(system(command), 0);
	f.faulty = true;
	assert_true(outage_start(&f) && outage_work(&f)); /* outage_work submits another job in its place */
	assert_int_equal(f.failed, 1);
	assert_false(f.jobs[id].submitted);
	outage_stop(&f);
	assert_true(outage_start(&f) && outage_work(&f));
	assert_int_equal(f.failed, 1);
	outage_stop(&f);
	assert_no_harm();
}

static int tear_down(void **state)
{
	if (*outage.running)
		print_error("failed: %s\n", outage.running);
	outage.running[0] = 0;
	return folder_tear_down(state);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(power_goes_at_any_time, folder_set_up, tear_down),
		cmocka_unit_test_setup_teardown(calls_fail_at_any_time, folder_set_up, tear_down),
		cmocka_unit_test_setup_teardown(starts_fail_at_any_time, folder_set_up, tear_down),
		cmocka_unit_test_setup_teardown(of_another_version, folder_set_up, tear_down),
		cmocka_unit_test_setup_teardown(without_its_folder, folder_set_up, tear_down),
	};
	size_t size = TESTS * sizeof *sums + SHARES * FAULTY_DISK_COUNTS * sizeof *outage.counts;
	sums = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (sums == MAP_FAILED)
		return 1;
	outage.counts = (_Atomic uint64_t *)(sums + TESTS);
	if (!env_number("HSLT_POWER_SEED", 0))
		share = shares_begin();
	outage.counts += share * FAULTY_DISK_COUNTS;
	return cmocka_run_group_tests(tests, NULL, NULL);
}
