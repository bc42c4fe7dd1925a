/*
 * The power goes at a random call of the disk, again and again, while a coordinator takes jobs, merges, writes checkpoints and
 * results; each life goes on with what the disk kept (tests/support/lossy.h). Whatever was acknowledged is there: jobs, batches (a
 * lease whose result was acknowledged is not handed out again), results that were said to be there; and the image has the bits of
 * an undisturbed run, which it has not if a batch is missing or counted twice.
 *
 * Then single calls fail, the n-th one of a run, in several ways: nothing crashes, what is refused is refused with a sentence and taken
 * later, what was acknowledged stays, and the images have the same bits. So do calls of a start that finds jobs half done.
 *
 * What must not be is counted, and each of the two tests ends with a line of what it did and counted: tests/e2e/faults/disk.sh makes
 * rows of a table of them.
 *
 * HSLT_POWER_SEEDS: so many runs (default 150; FULL=1: 4000). HSLT_POWER_SEED: this one alone, with the coordinator's log.
 * HSLT_FAULT, HSLT_FAULT_AT: this kind, at this call alone. HSLT_FAULT_STEP: every so many calls (default 72; FULL=1: each).
 */
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/sealed.h"
#include "common/film/exr.h"
#include "coordinator/shell/server.h"
#include "tests/support/folder.h"
#include "tests/support/lossy.h"
#include "tests/support/scripted.h"
#include "tests/support/shares.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <glob.h>
#include <math.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum { JOBS = 2, IDS_MAX = 64, LEASES_MAX = 256, LIVES_MAX = 12, STATE_BYTES = 3000 };
static const char scene[] = "<scene/>";

struct job {
	bool submitted, announced; /* acknowledged; its result was said to be there */
	bool acked[LEASES_MAX];
};

struct farm_run {
	struct lossy disk;
	struct plan plan;
	struct plan_request request;
	pid_t pid;
	int code; /* of its end */
	uint16_t port;
	struct job jobs[IDS_MAX];
	uint64_t accepted;
	struct scripted *client, *worker;
	uint64_t losses, acks, refused, failed;
	bool faulty; /* calls fail: what is refused with a sentence is tried again */
};

enum harm { LOST, DOUBLED, UNEQUAL, HARMS };
enum { KINDS = 4 }; /* of calls that fail */

struct sums { /* of all shares */
	_Atomic uint64_t losses, acks, taken, images, harm[HARMS], runs[KINDS], refused[KINDS], failed[KINDS];
};

static _Atomic uint64_t *counts; /* of this share */
static struct sums *sums, *now;  /* of the two tests; of the one that runs */
static unsigned share;
static struct exr_image reference;
static uint64_t reference_results; /* that its film holds */
static bool has_reference, loud;
static uint64_t quiet_calls; /* of an undisturbed run, that change something */
static char running[64]; /* the run that is under way; "": none */
static char port_file[80], root[80], after[80];

/* ---- a life ---- */

static void serve(const struct farm_run *f)
{
	struct server_config c;
	struct error e = {""};
	prctl(PR_SET_PDEATHSIG, SIGKILL); /* a test that fails leaves nobody behind */
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = root;
	c.port_file = port_file;
	c.journal_bytes = 2000;
	c.blob_bytes = 1 << 20;
	c.retry_seconds = 0.01;
	c.film_bytes = 0; /* more files that can fail */
	log_set_level(LOG_LEVEL_DEBUG);
	if (!loud && !freopen("/dev/null", "w", stderr))
		_exit(1);
	lossy_begin(&f->disk);
	int rc = server_run(&c, &e);
	if (rc)
		fprintf(stderr, "%s\n", e.text);
	_exit(rc ? 1 : 0);
}

/* 0: it runs; else its exit code, -1 for 0: it is gone. */
static int gone(struct farm_run *f, bool wait)
{
	int status;
	if (!f->code && waitpid(f->pid, &status, wait ? 0 : WNOHANG) == f->pid) {
		assert_true(WIFEXITED(status));
		f->code = WEXITSTATUS(status) ? WEXITSTATUS(status) : -1;
	}
	return f->code;
}

/* false: the power went before it listened. */
static bool start(struct farm_run *f)
{
	unlink(port_file);
	fflush(NULL);
	f->code = 0;
	f->pid = fork();
	if (f->pid == 0)
		serve(f);
	for (unsigned number = 0, i = 0; i < 120000; i++) {
		FILE *file = fopen(port_file, "r");
		bool has = file && fscanf(file, "%u", &number) == 1;
		if (file)
			fclose(file);
		if (has) {
			f->port = (uint16_t)number;
			return true;
		}
		int code = gone(f, false);
		if (code) {
			assert_true(code == LOSSY_EXIT || (f->faulty && code == 1));
			return false;
		}
		usleep(500);
	}
	fail_msg("the coordinator does not start");
	return false;
}

/* What the disk kept becomes the spool. */
static void swap_folders(struct farm_run *f)
{
	char command[512];
	snprintf(command, sizeof command, "rm -rf '%s' && mv '%s' '%s'", root, after, root);
	assert_int_equal(system(command), 0);
	f->losses++;
}

static void hang_up(struct farm_run *f)
{
	scripted_hang_up(f->client);
	scripted_hang_up(f->worker);
	f->client = f->worker = NULL;
}

/* ---- what it must say ---- */

static void count_harm(enum harm what, uint64_t times, const char *text)
{
	print_error("%s: %s\n", running, text);
	now->harm[what] += times;
}

static size_t lease_index(const struct plan *p, const struct lease_key *k)
{
	size_t i = k->kind == LEASE_BOOTSTRAP ? 0 : 1 + (size_t)k->epoch;
	i = (i * p->groups + k->group) * p->parts + k->part;
	assert_true(i < LEASES_MAX);
	return i;
}

static const Farm__Envelope *ask(struct scripted *p, bool said)
{
	return said ? scripted_hear(p) : NULL;
}

/* Every result of these plans brings as many accepted mutations as any other. */
static uint64_t results_in(const struct exr_image *img, const struct plan *p)
{
	struct lease_key k = {.kind = LEASE_RENDER};
	struct batch b = scripted_batch(&k, p, STATE_BYTES);
	uint64_t one = b.counters[COUNT_ACCEPTED], all = 0;
	batch_fini(&b);
	for (size_t i = 0; i < img->attribute_count; i++)
		if (strcmp(img->attributes[i].name, "hslt:accepted") == 0)
			all = strtoull(img->attributes[i].string, NULL, 10);
	assert_true(one && all % one == 0);
	return all / one;
}

static void check_image(const unsigned char *bytes, size_t size, const struct plan *p)
{
	struct exr_image img;
	struct error e;
	bool equal = true;
	assert_int_equal(exr_read(bytes, size, &img, &e), 0);
	uint64_t results = results_in(&img, p);
	if (!has_reference) {
		reference = img;
		reference_results = results;
		has_reference = true;
		assert_int_equal(results, p->rounds * p->groups * p->parts);
		return;
	}
	assert_int_equal(img.channel_count, reference.channel_count);
	for (uint32_t i = 0; i < img.channel_count; i++)
		equal = equal && memcmp(img.planes[i], reference.planes[i], sizeof(float) * img.width * img.height) == 0;
	exr_image_fini(&img);
	now->images++;
	if (results != reference_results)
		count_harm(results < reference_results ? LOST : DOUBLED, (uint64_t)llabs((long long)(results - reference_results)), "a film holds too few or too many");
	if (!equal)
		count_harm(UNEQUAL, 1, "an image has other bits");
}

/* false: it hung up. */
static bool fetch(struct farm_run *f, uint64_t id, bool *there)
{
	const Farm__Envelope *m = ask(f->client, scripted_fetch(f->client, id, FARM__WHAT__WHAT_RESULT));
	if (!m)
		return false;
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_FETCH_CHUNK);
	if (f->faulty && *m->fetch_chunk->error) {
		*there = false;
		f->refused++;
		return true;
	}
	assert_string_equal(m->fetch_chunk->error, "");
	check_image(f->client->reader.payload.bytes, f->client->reader.payload.size, &f->plan);
	return true;
}

/* All that were acknowledged are there, none failed, and those that were said to be done are. false: it hung up. */
static bool look(struct farm_run *f)
{
	bool seen[IDS_MAX] = {false}, done[IDS_MAX] = {false};
	const Farm__Envelope *m = ask(f->client, scripted_list(f->client));
	if (!m)
		return false;
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	for (size_t i = 0; i < m->job_list_answer->n_jobs; i++) {
		const Farm__JobStatus *j = m->job_list_answer->jobs[i];
		assert_true(j->job < IDS_MAX);
		if (f->faulty && f->jobs[j->job].submitted && strcmp(j->state, "failed") == 0) {
			print_message("j%llu failed: %s\n", (unsigned long long)j->job, j->why);
			assert_true(*j->why != 0);
			f->jobs[j->job].submitted = false;
			f->accepted--;
			f->failed++;
		}
		if (f->jobs[j->job].submitted && (strcmp(j->state, "failed") == 0 || strcmp(j->state, "cancelled") == 0))
			fail_msg("j%llu is %s: %s", (unsigned long long)j->job, j->state, j->why);
		seen[j->job] = true;
		done[j->job] = strcmp(j->state, "done") == 0 && j->fetchable;
	}
	for (uint64_t id = 0; id < IDS_MAX; id++) {
		struct job *j = &f->jobs[id];
		if (j->submitted && !seen[id]) {
			count_harm(LOST, 1, "a job is lost");
			j->submitted = false;
			f->accepted--;
		} else if (j->announced && !done[id]) {
			count_harm(LOST, 1, "a job was done and is not");
		}
		if (done[id] && !fetch(f, id, &done[id]))
			return false;
		j->announced = done[id] && j->submitted;
	}
	return true;
}

/* ---- the work of a life; false: the power went ---- */

static bool submit(struct farm_run *f)
{
	const Farm__Envelope *m = ask(f->client, scripted_submit(f->client, &f->request, scene));
	if (m && m->body_case == FARM__ENVELOPE__BODY_SUBMIT_ANSWER && m->submit_answer->n_missing)
		m = ask(f->client, scripted_send_scene(f->client, scene));
	if (!m)
		return false;
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_SUBMIT_ANSWER);
	if (*m->submit_answer->refusal && f->faulty) {
		f->refused++;
		return true;
	}
	if (*m->submit_answer->refusal)
		fail_msg("%s", m->submit_answer->refusal);
	assert_in_range(m->submit_answer->job, 1, IDS_MAX - 1);
	struct job *j = &f->jobs[m->submit_answer->job];
	assert_false(j->submitted); /* an id is given out once */
	j->submitted = true;
	f->accepted++;
	return true;
}

static bool answer_lease(struct farm_run *f, const Farm__LeaseGrant *g)
{
	struct grant grant;
	struct error e;
	assert_int_equal(grant_unpack(&grant, g, f->worker->reader.payload.bytes, f->worker->reader.payload.size, &e), 0);
	struct lease_key before = grant.key;
	assert_true(before.job < IDS_MAX);
	bool *acked = &f->jobs[before.job].acked[lease_index(&f->plan, &before)];
	if (*acked)
		count_harm(LOST, 1, "a result was acknowledged, and its lease is handed out again");
	*acked = false;
	before.epoch--;
	for (uint32_t i = 0; grant.states && i < grant.chain_count; i++) {
		uint64_t tag;
		memcpy(&tag, grant.states[i].bytes, sizeof tag);
		assert_true(tag == scripted_tag(&before));
	}
	struct batch b = scripted_batch(&grant.key, &f->plan, STATE_BYTES);
	bool said = scripted_send(f->worker, &b, &f->plan);
	batch_fini(&b);
	grant_fini(&grant);
	return said;
}

static void take_ack(struct farm_run *f, const Farm__LeaseAck *a)
{
	struct lease_key k;
	struct error e;
	assert_int_equal(lease_key_from_wire(a->key, &k, &e), 0);
	if (a->verdict == FARM__VERDICT__VERDICT_REFUSED && f->faulty) {
		f->refused++;
		return;
	}
	if (a->verdict == FARM__VERDICT__VERDICT_REFUSED)
		fail_msg("refused: %s", a->text);
	f->jobs[k.job].acked[lease_index(&f->plan, &k)] = true;
	f->acks++;
}

static bool all_announced(const struct farm_run *f)
{
	for (int i = 0; i < IDS_MAX; i++)
		if (f->jobs[i].submitted && !f->jobs[i].announced)
			return false;
	return true;
}

static bool work(struct farm_run *f)
{
	f->client = scripted_call(f->port, FARM__ROLE__ROLE_CLIENT);
	f->worker = f->client ? scripted_call(f->port, FARM__ROLE__ROLE_WORKER) : NULL;
	if (!f->worker || !look(f))
		return false;
	while (f->accepted < JOBS)
		if (!submit(f))
			return false;
	if (!scripted_want(f->worker, 3))
		return false;
	for (int turns = 0; !all_announced(f) || f->accepted < JOBS; turns++) {
		assert_true(turns < 40000);
		while (f->accepted < JOBS)
			if (!submit(f))
				return false;
		if (!scripted_has(f->worker, 5)) {
			if (!look(f))
				return false;
			continue;
		}
		const Farm__Envelope *m = scripted_hear(f->worker);
		if (!m)
			return false;
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK)
			take_ack(f, m->lease_ack);
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT && !answer_lease(f, m->lease_grant))
			return false;
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END && !look(f))
			return false;
	}
	return true;
}

/* ---- runs ---- */

static void begin(struct farm_run *f, uint64_t seed)
{
	struct error e;
	memset(f, 0, sizeof *f);
	f->request = (struct plan_request){.integrator = "pssmlt", .kind = PLAN_CHAINS, .width = 20, .height = 10, .mutations = 3200,
					   .max_depth = 5, .groups = 2, .chains = 8, .epoch = 100, .bootstrap = 64};
	assert_int_equal(plan_make(&f->request, &f->plan, &e), 0);
	f->disk = (struct lossy){.root = root, .after = after, .seed = seed, .counts = counts};
	if (getenv("HSLT_POWER_FORGET"))
		f->disk.forget = (enum lossy_forget)atoi(getenv("HSLT_POWER_FORGET"));
	f->disk.forget_name = getenv("HSLT_POWER_FORGET_NAME");
	snprintf(root, sizeof root, "%s/spool", folder);
	snprintf(after, sizeof after, "%s/after", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	char command[512];
	snprintf(command, sizeof command, "rm -rf '%s' '%s' && mkdir '%s'", root, after, root);
	assert_int_equal(system(command), 0);
}

static void stop(struct farm_run *f)
{
	hang_up(f);
	kill(f->pid, SIGTERM);
	assert_int_equal(gone(f, true), -1);
}

/* All is done and the coordinator idle: another job, and at its first call the power goes. */
static void stop_in_the_dark(struct farm_run *f)
{
	atomic_store(&counts[4], 1);
	scripted_submit(f->client, &f->request, "<scene version='2'/>");
	const Farm__Envelope *m = scripted_hear(f->client);
	if (m)
		scripted_send_scene(f->client, "<scene version='2'/>");
	hang_up(f);
	assert_int_equal(gone(f, true), LOSSY_EXIT);
	swap_folders(f);
}

static void run_seed(uint64_t seed, uint64_t *losses, uint64_t *acks)
{
	static struct farm_run f;
	uint64_t draw = seed;
	begin(&f, seed);
	bool dark = false;
	for (int life = 0;; life++) {
		struct lease_key k = {.kind = LEASE_RENDER, .epoch = draw++};
		atomic_store(&counts[0], 0);
		atomic_store(&counts[4], 0);
		f.disk.seed = seed * 100 + (uint64_t)life;
		f.disk.lose_at = life < LIVES_MAX && !dark ? 1 + scripted_tag(&k) % (quiet_calls + quiet_calls / 4) : 0;
		bool done = start(&f) && work(&f);
		if (done && dark)
			break;
		if (done) {
			stop_in_the_dark(&f);
			dark = true;
			continue;
		}
		hang_up(&f);
		assert_int_equal(gone(&f, true), LOSSY_EXIT);
		swap_folders(&f);
	}
	stop(&f);
	*losses += f.losses;
	*acks += f.acks;
}

static void quiet_run(void)
{
	static struct farm_run f;
	begin(&f, 1);
	atomic_store(&counts[0], 0);
	assert_true(start(&f) && work(&f));
	stop(&f);
	quiet_calls = atomic_load(&counts[0]);
	assert_true(has_reference && f.acks > 0);
}

/* Calls fail, from the n-th on; then all is well again, the power goes, and all that was acknowledged is there. */
static void run_faults(uint64_t from, uint64_t count, int with, bool writes_only, uint64_t *refused, uint64_t *failed)
{
	static struct farm_run f;
	begin(&f, from);
	f.disk.fail_from = from;
	f.disk.fail_count = count;
	f.disk.fail_with = with;
	f.disk.fail_writes_only = writes_only;
	f.disk.lose_after = from % 3 ? 1 + from % 23 : 0;
	f.faulty = true;
	for (int life = 0;; life++) {
		assert_true(life < 3);
		atomic_store(&counts[4], 0);
		if (start(&f) && work(&f))
			break;
		hang_up(&f);
		if (gone(&f, true) == LOSSY_EXIT)
			swap_folders(&f);
		else
			f.refused++; /* it did not start, and said why */
		f.disk.fail_from = 0;
	}
	stop_in_the_dark(&f);
	f.disk.fail_from = 0;
	f.faulty = false;
	atomic_store(&counts[4], 0);
	assert_true(start(&f) && work(&f));
	stop(&f);
	*refused += f.refused;
	*failed += f.failed;
}

/* The power goes in the middle of the work; calls of the next start fail, from the n-th on. It starts or says why not; no job fails of
 * it, and all that was acknowledged is there, then or after another start. */
static bool begin_restart(struct farm_run *f, uint64_t from)
{
	begin(f, from);
	f->disk.lose_at = quiet_calls * 3 / 5;
	atomic_store(&counts[4], 0);
	assert_false(start(f) && work(f));
	hang_up(f);
	assert_int_equal(gone(f, true), LOSSY_EXIT);
	swap_folders(f);
	f->disk.lose_at = 0;
	return f->acks > 0;
}

static uint64_t restart_calls(void)
{
	static struct farm_run f;
	assert_true(begin_restart(&f, 1) && start(&f));
	uint64_t calls = atomic_load(&counts[1]);
	stop(&f);
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
	bool done = start(&f) && work(&f);
	assert_int_equal(f.failed, 0);
	if (!done) {
		hang_up(&f);
		assert_int_equal(gone(&f, true), 1);
		++*refused;
		f.disk.fail_from = 0;
		f.faulty = false;
		assert_true(start(&f) && work(&f));
	}
	stop(&f);
}

static uint64_t number(const char *name, uint64_t otherwise)
{
	const char *text = getenv(name);
	return text && *text ? strtoull(text, NULL, 10) : otherwise;
}

/* ---- tests ---- */

static void say_harm(const char *what, uint64_t times)
{
	if (share == 0) /* the last to come here */
		printf("   %s: times=%llu lost=%llu doubled=%llu images=%llu unequal=%llu\n", what, (unsigned long long)times,
		       (unsigned long long)now->harm[LOST], (unsigned long long)now->harm[DOUBLED], (unsigned long long)now->images,
		       (unsigned long long)now->harm[UNEQUAL]);
	assert_true(share || (times && now->images));
	assert_true(!now->harm[LOST] && !now->harm[DOUBLED] && !now->harm[UNEQUAL]);
}

static void power_goes_at_any_time(void **state)
{
	(void)state;
	now = &sums[0];
	uint64_t seeds = number("HSLT_POWER_SEEDS", number("FULL", 0) ? 4000 : 150), one = number("HSLT_POWER_SEED", 0);
	seeds = seeds / number("HSLT_TEST_SCALE", 1) + 1;
	uint64_t losses = 0, acks = 0;
	quiet_run();
	loud = one != 0;
	atomic_store(&counts[3], 0);
	for (uint64_t seed = one ? one : 1 + share; seed <= (one ? one : seeds); seed += one ? 1 : SHARES) {
		snprintf(running, sizeof running, "HSLT_POWER_SEED=%llu", (unsigned long long)seed);
		run_seed(seed, &losses, &acks);
	}
	running[0] = 0;
	now->losses += losses;
	now->acks += acks;
	now->taken += atomic_load(&counts[3]);
	bool pass = share || one || shares_pass();
	if (share == 0)
		printf("   %llu runs of %llu calls: the power took %llu sectors and names; %llu batches were acknowledged\n",
		       (unsigned long long)(one ? 1 : seeds), (unsigned long long)quiet_calls, (unsigned long long)now->taken, (unsigned long long)now->acks);
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
	} kinds[KINDS] = {{"EIO", EIO, 1, false}, {"ENOSPC", ENOSPC, 40, true}, {"EMFILE", EMFILE, 1, false}, {"EROFS", EROFS, 10, false}};
	uint64_t one = number("HSLT_FAULT_AT", 0), step = number("FULL", 0) ? SHARES : number("HSLT_FAULT_STEP", 18 * SHARES * number("HSLT_TEST_SCALE", 1));
	if (number("HSLT_POWER_SEED", 0))
		skip();
	now = &sums[1];
	quiet_run();
	loud = one != 0;
	uint64_t calls = atomic_load(&counts[1]), times = 0;
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
		uint64_t refused = 0, failed = 0, runs = 0;
		if (getenv("HSLT_FAULT") && strcmp(getenv("HSLT_FAULT"), kinds[k].name) != 0)
			continue;
		for (uint64_t from = one ? one : 1 + share + SHARES * k; from < (one ? one + 1 : calls); from += step, runs++) {
			snprintf(running, sizeof running, "HSLT_FAULT=%s HSLT_FAULT_AT=%llu", kinds[k].name, (unsigned long long)from);
			run_faults(from, kinds[k].count, kinds[k].with, kinds[k].writes_only, &refused, &failed);
		}
		running[0] = 0;
		now->refused[k] += refused;
		now->failed[k] += failed;
		times += now->runs[k] += runs;
		if (share == 0)
			printf("   %s at %llu of %llu calls: %llu refusals, %llu jobs failed and said so\n", kinds[k].name, (unsigned long long)now->runs[k],
			       (unsigned long long)calls, (unsigned long long)now->refused[k], (unsigned long long)now->failed[k]);
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
	uint64_t one = number("HSLT_FAULT_AT", 0), step = number("FULL", 0) ? SHARES : number("HSLT_FAULT_STEP", 5 * SHARES * number("HSLT_TEST_SCALE", 1));
	if (number("HSLT_POWER_SEED", 0))
		skip();
	quiet_run();
	uint64_t calls = restart_calls();
	loud = one != 0;
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
		uint64_t refused = 0, runs = 0;
		if (getenv("HSLT_FAULT") && strcmp(getenv("HSLT_FAULT"), kinds[k].name) != 0)
			continue;
		for (uint64_t from = one ? one : 1 + share + SHARES * k; from < (one ? one + 1 : calls); from += step, runs++) {
			snprintf(running, sizeof running, "of a restart: HSLT_FAULT=%s HSLT_FAULT_AT=%llu", kinds[k].name, (unsigned long long)from);
			run_restart(from, kinds[k].count, kinds[k].with, &refused);
		}
		running[0] = 0;
		print_message("   %s at %llu of %llu calls of a restart: %llu did not start, none failed\n", kinds[k].name, (unsigned long long)runs,
			      (unsigned long long)calls, (unsigned long long)refused);
	}
}

/* ---- what another coordinator wrote, and what somebody removed ---- */

enum { FILE_MOST = 1 << 20 };

static size_t load(const char *path, unsigned char bytes[FILE_MOST])
{
	FILE *f = fopen(path, "rb");
	size_t n = f ? fread(bytes, 1, FILE_MOST, f) : 0;
	assert_true(f && n && n < FILE_MOST);
	fclose(f);
	return n;
}

static void store(const char *path, const unsigned char *bytes, size_t size, bool seal)
{
	struct sealed out;
	struct error e;
	FILE *f = fopen(path, "wb");
	assert_true(f && fwrite(bytes, 1, size, f) == size && fclose(f) == 0);
	if (!seal)
		return;
	assert_int_equal(sealed_create(&out, path, &e), 0);
	assert_int_equal(sealed_write(&out, bytes, size - sizeof(uint32_t), &e), 0);
	assert_int_equal(sealed_finish(&out, &e), 0);
	sealed_close(&out);
}

static void of_another_version(void **state)
{
	(void)state;
	static const char *const names[] = {"checkpoint", "journal.*"};
	static struct farm_run f;
	static unsigned char before[FILE_MOST], bytes[FILE_MOST];
	if (share || number("HSLT_POWER_SEED", 0) || number("HSLT_FAULT_AT", 0))
		skip();
	quiet_run();
	assert_true(begin_restart(&f, 7));
	f.faulty = true;
	for (int i = 0; i < 2; i++) {
		glob_t g;
		char pattern[256];
		snprintf(pattern, sizeof pattern, "%s/jobs/*/%s", root, names[i]);
		assert_int_equal(glob(pattern, 0, NULL, &g), 0);
		size_t size = load(g.gl_pathv[0], before);
		memcpy(bytes, before, size);
		memcpy(bytes + 5, "999", 3);
		store(g.gl_pathv[0], bytes, size, i == 0);
		load(g.gl_pathv[0], bytes);
		assert_false(start(&f));
		assert_int_equal(f.code, 1);
		static unsigned char after_it[FILE_MOST];
		assert_int_equal(load(g.gl_pathv[0], after_it), size);
		assert_memory_equal(bytes, after_it, size);
		store(g.gl_pathv[0], before, size, false);
		globfree(&g);
	}
	f.faulty = false;
	assert_true(start(&f) && work(&f));
	stop(&f);
}

/* Its folder was removed: it fails, once and for all; the others go on. */
static void without_its_folder(void **state)
{
	(void)state;
	static struct farm_run f;
	if (share || number("HSLT_POWER_SEED", 0) || number("HSLT_FAULT_AT", 0))
		skip();
	quiet_run();
	assert_true(begin_restart(&f, 7));
	uint64_t id = 1;
	while (!f.jobs[id].submitted)
		id++;
	char command[300];
	snprintf(command, sizeof command, "rm -r '%s/jobs/j%llu'", root, (unsigned long long)id);
	assert_int_equal(system(command), 0);
	f.faulty = true;
	assert_true(start(&f) && work(&f)); /* which submits another in its place */
	assert_int_equal(f.failed, 1);
	assert_false(f.jobs[id].submitted);
	stop(&f);
	assert_true(start(&f) && work(&f));
	assert_int_equal(f.failed, 1);
	stop(&f);
}

static int tear_down(void **state)
{
	if (*running)
		print_error("failed: %s\n", running);
	running[0] = 0;
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
	size_t size = 2 * sizeof *sums + SHARES * LOSSY_COUNTS * sizeof *counts;
	sums = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (sums == MAP_FAILED)
		return 1;
	counts = (_Atomic uint64_t *)(sums + 2);
	if (!number("HSLT_POWER_SEED", 0))
		share = shares_begin();
	counts += share * LOSSY_COUNTS;
	return cmocka_run_group_tests(tests, NULL, NULL);
}
