/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Runs of a coordinator, one after the other, on a faulty disk (outage.h). outage_work submits jobs, answers leases and
 * records every acknowledgement until the process has ended; the next run starts from what the disk has kept. Each run
 * begins by fetching all images: their counters show how many results each contains, and their pixels must have the
 * bits of the undisturbed run.
 */
#include "tests/support/outage.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/exr/exr_read.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum { JOBS = 2, STATE_BYTES = 3000 };
static const char scene[] = "<scene/>";

struct outage outage;
static struct exr_image reference;
static uint64_t reference_results; /* number of results in its film */
static bool has_reference;
static char port_file[80], listens_file[80], after[80];

/* ---- a run ---- */

static void serve(const struct farm_run *f)
{
	struct server_config c;
	struct error e = {""};
	prctl(PR_SET_PDEATHSIG, SIGKILL); /* a failing test leaves no process behind */
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = outage.root;
	c.port_file = listens_file;
	c.journal_bytes = outage.journal_bytes ? outage.journal_bytes : 2000;
	c.accept_loss = outage.accept_loss;
	c.blob_bytes = 1 << 20;
	c.retry_seconds = 0.01;
	c.film_bytes = 0; /* more files that can fail */
	log_set_level(LOG_LEVEL_DEBUG);
	if (!outage.loud && !freopen("/dev/null", "w", stderr))
		_exit(1);
	faulty_disk_begin(&f->disk);
	struct server *s;
	int rc = server_open(&s, &c, &e);
	if (!rc)
		rc = server_await_jobs(s, &e);
	if (!rc && rename(listens_file, port_file))
		rc = -errno;
	if (!rc) {
		uv_run(&s->loop, UV_RUN_DEFAULT);
		server_close(s);
	}
	if (rc)
		fprintf(stderr, "%s\n", e.text);
	_exit(rc ? 1 : 0);
}

/* Returns 0 while the coordinator runs, otherwise its exit code, or -1 for exit code 0. */
int outage_gone(struct farm_run *f, bool wait)
{
	int status;
	if (!f->code && waitpid(f->pid, &status, wait ? 0 : WNOHANG) == f->pid) {
		assert_true(WIFEXITED(status));
		f->code = WEXITSTATUS(status) ? WEXITSTATUS(status) : -1;
	}
	return f->code;
}

/* Returns false if power was lost while it read its jobs, or if it did not start. */
bool outage_start(struct farm_run *f)
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
		int code = outage_gone(f, false);
		if (code) {
			if (code != FAULTY_DISK_EXIT && !(f->faulty && code == 1))
				fail_msg("%s: the coordinator ends with %d at its start", outage.running, code);
			return false;
		}
		usleep(500);
	}
	fail_msg("the coordinator does not start");
	return false;
}

/* Makes what the disk kept the spool. */
void outage_swap_folders(struct farm_run *f)
{
	char command[512];
	snprintf(command, sizeof command, "rm -rf '%s' && mv '%s' '%s'", outage.root, after, outage.root);
	assert_int_equal(system(command), 0);
	f->losses++;
}

void outage_hang_up(struct farm_run *f)
{
	scripted_hang_up(f->client);
	scripted_hang_up(f->worker);
	f->client = f->worker = NULL;
}

/* ---- checks of its answers */

static void count_harm(enum harm what, uint64_t times, const char *text)
{
	print_error("%s: %s\n", outage.running, text);
	outage.found->harm[what] += times;
}

static size_t lease_index(const struct plan *p, const struct lease_key *k)
{
	size_t i = k->kind == LEASE_BOOTSTRAP ? 0 : 1 + (size_t)k->epoch;
	i = (i * p->groups + k->group) * p->parts + k->part;
	assert_true(i < LEASES_MAX);
	return i;
}

static const Farm__Envelope *answer_to(struct scripted *p, bool said)
{
	return said ? scripted_hear(p) : NULL;
}

/* Each result of these plans has the same number of accepted mutations. */
static uint64_t results_in(const struct exr_image *img, const struct plan *p)
{
	struct lease_key k = {.kind = LEASE_RENDER};
	struct batch b = scripted_batch(&k, p, STATE_BYTES);
	uint64_t one = b.counters[COUNT_ACCEPTED], all = 0;
	batch_fini(&b);
	const struct exr_attribute *accepted = exr_attribute_find(img, "hslt:accepted");
	if (accepted)
		all = strtoull(accepted->string, NULL, 10);
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
		equal = equal &&
			memcmp(img.planes[i], reference.planes[i], sizeof(float) * img.width * img.height) == 0;
	exr_image_fini(&img);
	outage.found->images++;
	if (results != reference_results)
		count_harm(results < reference_results ? LOST : DOUBLED,
			   (uint64_t)llabs((long long)(results - reference_results)),
			   "a film holds too few or too many");
	if (!equal)
		count_harm(UNEQUAL, 1, "an image has other bits");
}

/* Returns false if the coordinator hung up. */
static bool fetch(struct farm_run *f, uint64_t id, bool *there)
{
	const Farm__Envelope *m = answer_to(f->client, scripted_fetch(f->client, id, FARM__WHAT__WHAT_RESULT, 0));
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

/* Checks that all acknowledged jobs exist, that none failed, and that those reported as done are done. Returns false
 * if the coordinator hung up. */
static bool check_jobs(struct farm_run *f)
{
	bool seen[IDS_MAX] = {false}, done[IDS_MAX] = {false};
	const Farm__Envelope *m = answer_to(f->client, scripted_list(f->client));
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
		if (f->jobs[j->job].submitted &&
		    (strcmp(j->state, "failed") == 0 || strcmp(j->state, "cancelled") == 0))
			fail_msg("j%llu is %s: %s", (unsigned long long)j->job, j->state, j->why);
		seen[j->job] = true;
		done[j->job] = strcmp(j->state, "done") == 0 && j->fetchable;
	}
	for (uint64_t id = 0; id < IDS_MAX; id++) {
		struct outage_job *j = &f->jobs[id];
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

/* ---- the work of a run; functions return false if power was lost */

static bool submit(struct farm_run *f)
{
	const Farm__Envelope *m = answer_to(f->client, scripted_submit(f->client, &f->request, scene));
	if (m && m->body_case == FARM__ENVELOPE__BODY_SUBMIT_ANSWER && m->submit_answer->n_missing)
		m = answer_to(f->client, scripted_send_scene(f->client, scene));
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
	struct outage_job *j = &f->jobs[m->submit_answer->job];
	assert_false(j->submitted); /* an id is assigned only once */
	j->submitted = true;
	f->accepted++;
	return true;
}

static bool answer_lease(struct farm_run *f, const Farm__LeaseGrant *g)
{
	struct grant grant;
	struct error e;
	assert_int_equal(grant_unpack(&grant, g, f->worker->reader.payload.bytes, f->worker->reader.payload.size, &e),
			 0);
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

bool outage_work(struct farm_run *f)
{
	f->client = scripted_call(f->port, FARM__ROLE__ROLE_CLIENT);
	f->worker = f->client ? scripted_call(f->port, FARM__ROLE__ROLE_WORKER) : NULL;
	if (!f->worker || !check_jobs(f))
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
			if (!check_jobs(f))
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
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END && !check_jobs(f))
			return false;
	}
	return true;
}

/* ---- runs ---- */

void outage_begin(struct farm_run *f, uint64_t seed)
{
	struct error e;
	memset(f, 0, sizeof *f);
	f->request = scripted_request;
	assert_int_equal(plan_make(&f->request, &f->plan, &e), 0);
	f->disk = (struct faulty_disk){.root = outage.root, .after = after, .seed = seed, .counts = outage.counts};
	if (getenv("HSLT_POWER_FORGET"))
		f->disk.forget = (enum faulty_disk_forget)atoi(getenv("HSLT_POWER_FORGET"));
	f->disk.forget_name = getenv("HSLT_POWER_FORGET_NAME");
	snprintf(outage.root, sizeof outage.root, "%s/spool", folder);
	snprintf(after, sizeof after, "%s/after", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	snprintf(listens_file, sizeof listens_file, "%s/listens", folder);
	char command[512];
	snprintf(command, sizeof command, "rm -rf '%s' '%s' && mkdir '%s'", outage.root, after, outage.root);
	assert_int_equal(system(command), 0);
}

void outage_stop(struct farm_run *f)
{
	outage_hang_up(f);
	kill(f->pid, SIGTERM);
	assert_int_equal(outage_gone(f, true), -1);
}

/* Submits another job when everything is done and the coordinator is idle; power is lost at its first call. */
void outage_cut_power(struct farm_run *f)
{
	atomic_store(&outage.counts[4], 1);
	scripted_submit(f->client, &f->request, "<scene version='2'/>");
	const Farm__Envelope *m = scripted_hear(f->client);
	if (m)
		scripted_send_scene(f->client, "<scene version='2'/>");
	outage_hang_up(f);
	assert_int_equal(outage_gone(f, true), FAULTY_DISK_EXIT);
	outage_swap_folders(f);
}
void outage_quiet_run(void)
{
	static struct farm_run f;
	outage_begin(&f, 1);
	atomic_store(&outage.counts[0], 0);
	assert_true(outage_start(&f) && outage_work(&f));
	outage_stop(&f);
	outage.quiet_calls = atomic_load(&outage.counts[0]);
	assert_true(has_reference && f.acks > 0);
}
