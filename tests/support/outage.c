/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Runs of a coordinator, one after the other, on a faulty disk (outage.h). outage_run_jobs submits jobs, answers leases
 * and records every acknowledgement until the process has ended; the next run starts from what the disk has kept. Each
 * run begins by fetching all images: their counters show how many results each contains, and their pixels must have the
 * bits of the undisturbed run.
 */
#include "tests/support/outage.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/exr/exr_read.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/temporary_folder.h"

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
static char port_file[80], listening_port_file[80], remains_folder[80];

/* ---- a run ---- */

static void run_coordinator(const struct outage_run *f)
{
	struct server_config c;
	struct error e = {""};
	prctl(PR_SET_PDEATHSIG, SIGKILL); /* a failing test leaves no process behind */
	server_config_init(&c);
	c.listen_address = "127.0.0.1:0";
	c.spool_folder = outage.spool;
	c.port_file = listening_port_file;
	c.max_journal_bytes = outage.journal_bytes ? outage.journal_bytes : 2000;
	c.accept_loss = outage.accept_loss;
	c.max_blob_bytes = 1 << 20;
	c.retry_seconds = 0.01;
	c.max_film_bytes = 0; /* more files that can fail */
	log_set_level(LOG_LEVEL_DEBUG);
	if (!outage.prints_log && !freopen("/dev/null", "w", stderr))
		_exit(1);
	faulty_disk_begin(&f->disk);
	struct server *s;
	int rc = server_open(&s, &c, &e);
	if (!rc)
		rc = server_await_jobs(s, &e);
	if (!rc && rename(listening_port_file, port_file))
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
int outage_exit_code(struct outage_run *f, bool wait)
{
	int status;
	if (!f->exit_code && waitpid(f->pid, &status, wait ? 0 : WNOHANG) == f->pid) {
		assert_true(WIFEXITED(status));
		f->exit_code = WEXITSTATUS(status) ? WEXITSTATUS(status) : -1;
	}
	return f->exit_code;
}

/* Returns false if power was lost while it read its jobs, or if it did not start. */
bool outage_start(struct outage_run *f)
{
	unlink(port_file);
	fflush(NULL);
	f->exit_code = 0;
	f->pid = fork();
	if (f->pid == 0)
		run_coordinator(f);
	for (unsigned number = 0, i = 0; i < 120000; i++) {
		FILE *file = fopen(port_file, "r");
		bool is_written = file && fscanf(file, "%u", &number) == 1;
		if (file)
			fclose(file);
		if (is_written) {
			f->port = (uint16_t)number;
			return true;
		}
		int code = outage_exit_code(f, false);
		if (code) {
			if (code != FAULTY_DISK_EXIT_CODE && !(f->has_failing_calls && code == 1))
				fail_msg("%s: the coordinator ends with %d at its start", outage.run_name, code);
			return false;
		}
		usleep(500);
	}
	fail_msg("the coordinator does not start");
	return false;
}

/* Makes what the disk kept the spool. */
void outage_swap_folders(struct outage_run *f)
{
	char command[512];
	snprintf(command, sizeof command, "rm -rf '%s' && mv '%s' '%s'", outage.spool, remains_folder, outage.spool);
	assert_int_equal(system(command), 0);
	f->power_losses++;
}

void outage_disconnect(struct outage_run *f)
{
	scripted_peer_disconnect(f->client);
	scripted_peer_disconnect(f->worker);
	f->client = f->worker = NULL;
}

/* ---- checks of its answers */

static void count_violation(enum outage_violation violation, uint64_t times, const char *text)
{
	print_error("%s: %s\n", outage.run_name, text);
	outage.findings->violations[violation] += times;
}

static size_t lease_index(const struct plan *p, const struct lease_key *k)
{
	size_t i = k->kind == LEASE_BOOTSTRAP ? 0 : 1 + (size_t)k->epoch;
	i = (i * p->groups + k->group) * p->parts + k->part;
	assert_true(i < OUTAGE_LEASES_MAX);
	return i;
}

static const Farm__Envelope *receive_answer(struct scripted_peer *p, bool sent)
{
	return sent ? scripted_peer_receive(p) : NULL;
}

/* Each result of these plans has the same number of accepted mutations. */
static uint64_t count_results(const struct exr_image *img, const struct plan *p)
{
	struct lease_key k = {.kind = LEASE_RENDER};
	struct batch b = scripted_peer_make_batch(&k, p, STATE_BYTES);
	uint64_t per_result = b.counters[COUNT_ACCEPTED], total = 0;
	batch_fini(&b);
	const struct exr_attribute *accepted = exr_find_attribute(img, "hslt:accepted");
	if (accepted)
		total = strtoull(accepted->string, NULL, 10);
	assert_true(per_result && total % per_result == 0);
	return total / per_result;
}

static void check_image(const unsigned char *bytes, size_t size, const struct plan *p)
{
	struct exr_image img;
	struct error e;
	bool equal = true;
	assert_int_equal(exr_read(bytes, size, &img, &e), 0);
	uint64_t results = count_results(&img, p);
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
	outage.findings->images_compared++;
	if (results != reference_results)
		count_violation(results < reference_results ? OUTAGE_LOST : OUTAGE_DUPLICATED,
				(uint64_t)llabs((long long)(results - reference_results)),
				"a film holds too few or too many");
	if (!equal)
		count_violation(OUTAGE_DIFFERENT, 1, "an image has other bits");
}

/* Returns false if the coordinator hung up. */
static bool fetch_result(struct outage_run *f, uint64_t id, bool *exists)
{
	const Farm__Envelope *m =
		receive_answer(f->client, scripted_peer_fetch(f->client, id, FARM__WHAT__WHAT_RESULT, 0));
	if (!m)
		return false;
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_FETCH_CHUNK);
	if (f->has_failing_calls && *m->fetch_chunk->error) {
		*exists = false;
		f->refusals++;
		return true;
	}
	assert_string_equal(m->fetch_chunk->error, "");
	check_image(f->client->reader.payload.bytes, f->client->reader.payload.size, &f->plan);
	return true;
}

/* Checks that all acknowledged jobs exist, that none failed, and that those reported as done are done. Returns false
 * if the coordinator hung up. */
static bool check_jobs(struct outage_run *f)
{
	bool seen[OUTAGE_JOBS_MAX] = {false}, done[OUTAGE_JOBS_MAX] = {false};
	const Farm__Envelope *m = receive_answer(f->client, scripted_peer_request_job_list(f->client));
	if (!m)
		return false;
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	for (size_t i = 0; i < m->job_list_answer->n_jobs; i++) {
		const Farm__JobStatus *j = m->job_list_answer->jobs[i];
		assert_true(j->job < OUTAGE_JOBS_MAX);
		if (f->has_failing_calls && f->jobs[j->job].submitted && strcmp(j->state, "failed") == 0) {
			print_message("j%llu failed: %s\n", (unsigned long long)j->job, j->why);
			assert_true(*j->why != 0);
			f->jobs[j->job].submitted = false;
			f->accepted_jobs--;
			f->failed_jobs++;
		}
		if (f->jobs[j->job].submitted &&
		    (strcmp(j->state, "failed") == 0 || strcmp(j->state, "cancelled") == 0))
			fail_msg("j%llu is %s: %s", (unsigned long long)j->job, j->state, j->why);
		seen[j->job] = true;
		done[j->job] = strcmp(j->state, "done") == 0 && j->fetchable;
	}
	for (uint64_t id = 0; id < OUTAGE_JOBS_MAX; id++) {
		struct outage_job *j = &f->jobs[id];
		if (j->submitted && !seen[id]) {
			count_violation(OUTAGE_LOST, 1, "a job is lost");
			j->submitted = false;
			f->accepted_jobs--;
		} else if (j->announced && !done[id]) {
			count_violation(OUTAGE_LOST, 1, "a job was done and is not");
		}
		if (done[id] && !fetch_result(f, id, &done[id]))
			return false;
		j->announced = done[id] && j->submitted;
	}
	return true;
}

/* ---- the work of a run; functions return false if power was lost */

static bool submit_job(struct outage_run *f)
{
	const Farm__Envelope *m = receive_answer(f->client, scripted_peer_submit(f->client, &f->request, scene));
	if (m && m->body_case == FARM__ENVELOPE__BODY_SUBMIT_ANSWER && m->submit_answer->n_missing)
		m = receive_answer(f->client, scripted_peer_send_scene(f->client, scene));
	if (!m)
		return false;
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_SUBMIT_ANSWER);
	if (*m->submit_answer->refusal && f->has_failing_calls) {
		f->refusals++;
		return true;
	}
	if (*m->submit_answer->refusal)
		fail_msg("%s", m->submit_answer->refusal);
	assert_in_range(m->submit_answer->job, 1, OUTAGE_JOBS_MAX - 1);
	struct outage_job *j = &f->jobs[m->submit_answer->job];
	assert_false(j->submitted); /* an id is assigned only once */
	j->submitted = true;
	f->accepted_jobs++;
	return true;
}

static bool answer_lease(struct outage_run *f, const Farm__LeaseGrant *g)
{
	struct grant grant;
	struct error e;
	assert_int_equal(grant_unpack(&grant, g, f->worker->reader.payload.bytes, f->worker->reader.payload.size, &e),
			 0);
	struct lease_key previous = grant.key;
	assert_true(previous.job < OUTAGE_JOBS_MAX);
	bool *acked = &f->jobs[previous.job].acked[lease_index(&f->plan, &previous)];
	if (*acked)
		count_violation(OUTAGE_LOST, 1, "a result was acknowledged, and its lease is handed out again");
	*acked = false;
	previous.epoch--;
	for (uint32_t i = 0; grant.states && i < grant.chain_count; i++) {
		uint64_t tag;
		memcpy(&tag, grant.states[i].bytes, sizeof tag);
		assert_true(tag == scripted_peer_lease_tag(&previous));
	}
	struct batch b = scripted_peer_make_batch(&grant.key, &f->plan, STATE_BYTES);
	bool sent = scripted_peer_send_batch(f->worker, &b, &f->plan);
	batch_fini(&b);
	grant_fini(&grant);
	return sent;
}

static void record_ack(struct outage_run *f, const Farm__LeaseAck *a)
{
	struct lease_key k;
	struct error e;
	assert_int_equal(lease_key_from_wire(a->key, &k, &e), 0);
	if (a->verdict == FARM__VERDICT__VERDICT_REFUSED && f->has_failing_calls) {
		f->refusals++;
		return;
	}
	if (a->verdict == FARM__VERDICT__VERDICT_REFUSED)
		fail_msg("refused: %s", a->text);
	f->jobs[k.job].acked[lease_index(&f->plan, &k)] = true;
	f->acks++;
}

static bool all_announced(const struct outage_run *f)
{
	for (int i = 0; i < OUTAGE_JOBS_MAX; i++)
		if (f->jobs[i].submitted && !f->jobs[i].announced)
			return false;
	return true;
}

bool outage_run_jobs(struct outage_run *f)
{
	f->client = scripted_peer_connect_as(f->port, FARM__ROLE__ROLE_CLIENT);
	f->worker = f->client ? scripted_peer_connect_as(f->port, FARM__ROLE__ROLE_WORKER) : NULL;
	if (!f->worker || !check_jobs(f))
		return false;
	while (f->accepted_jobs < JOBS)
		if (!submit_job(f))
			return false;
	if (!scripted_peer_request_leases(f->worker, 3))
		return false;
	for (int turns = 0; !all_announced(f) || f->accepted_jobs < JOBS; turns++) {
		assert_true(turns < 40000);
		while (f->accepted_jobs < JOBS)
			if (!submit_job(f))
				return false;
		if (!scripted_peer_is_readable(f->worker, 5)) {
			if (!check_jobs(f))
				return false;
			continue;
		}
		const Farm__Envelope *m = scripted_peer_receive(f->worker);
		if (!m)
			return false;
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK)
			record_ack(f, m->lease_ack);
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT && !answer_lease(f, m->lease_grant))
			return false;
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END && !check_jobs(f))
			return false;
	}
	return true;
}

/* ---- runs ---- */

void outage_begin(struct outage_run *f, uint64_t seed)
{
	struct error e;
	memset(f, 0, sizeof *f);
	f->request = scripted_peer_plan_request;
	assert_int_equal(plan_make(&f->request, &f->plan, &e), 0);
	f->disk = (struct faulty_disk_options){
		.root = outage.spool, .remains = remains_folder, .seed = seed, .counts = outage.disk_counts};
	if (getenv("HSLT_POWER_FORGET"))
		f->disk.forget = (enum faulty_disk_forget)atoi(getenv("HSLT_POWER_FORGET"));
	f->disk.forget_name = getenv("HSLT_POWER_FORGET_NAME");
	snprintf(outage.spool, sizeof outage.spool, "%s/spool", temporary_folder);
	snprintf(remains_folder, sizeof remains_folder, "%s/after", temporary_folder);
	snprintf(port_file, sizeof port_file, "%s/port", temporary_folder);
	snprintf(listening_port_file, sizeof listening_port_file, "%s/listens", temporary_folder);
	char command[512];
	snprintf(command, sizeof command, "rm -rf '%s' '%s' && mkdir '%s'", outage.spool, remains_folder, outage.spool);
	assert_int_equal(system(command), 0);
}

void outage_stop(struct outage_run *f)
{
	outage_disconnect(f);
	kill(f->pid, SIGTERM);
	assert_int_equal(outage_exit_code(f, true), -1);
}

/* Submits another job when everything is done and the coordinator is idle; power is lost at its first call. */
void outage_cut_power(struct outage_run *f)
{
	atomic_store(&outage.disk_counts[4], 1);
	scripted_peer_submit(f->client, &f->request, "<scene version='2'/>");
	const Farm__Envelope *m = scripted_peer_receive(f->client);
	if (m)
		scripted_peer_send_scene(f->client, "<scene version='2'/>");
	outage_disconnect(f);
	assert_int_equal(outage_exit_code(f, true), FAULTY_DISK_EXIT_CODE);
	outage_swap_folders(f);
}
void outage_run_undisturbed(void)
{
	static struct outage_run f;
	outage_begin(&f, 1);
	atomic_store(&outage.disk_counts[0], 0);
	assert_true(outage_start(&f) && outage_run_jobs(&f));
	outage_stop(&f);
	outage.undisturbed_calls = atomic_load(&outage.disk_counts[0]);
	assert_true(has_reference && f.acks > 0);
}
