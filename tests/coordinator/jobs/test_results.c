/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's shell with workers that answer every lease at once with whatever the test needs: results that count
 * once, come late, are useless, or failed; and extensions of jobs that are done. Slow connections are in
 * test_slow_links.c.
 */
#include "tests/support/served.h"

#include "common/base/mem.h"
#include "coordinator/store/ledger.h"
#include "tests/support/black_results.h"
#include "tests/support/checksummed_frame.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int set_up(void **state)
{
	(void)state;
	return served_start(60, 60, 60);
}

static void a_black_job_ends(void **state)
{
	(void)state;
	struct scripted *client = peer_call(), *worker = peer_call();
	struct plan plan;
	struct error e;
	struct plan_request r = peer_plan_request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(client)->n_missing, 1);
	peer_send_blob(client, "<scene/>", "<scene/>");
	const Farm__SubmitAnswer *a = peer_submit_answer(client);
	assert_int_equal(a->job, 1);
	assert_true(peer_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	peer_say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct lease_queue d = {.count = 0};
	bool first = true;
	while (!d.job_ended) {
		if (d.count == 0) {
			peer_attend(worker, &d);
			continue;
		}
		struct batch b = black_batch(&d.keys[--d.count], &plan, 0);
		if (first) { /* wrong results, then right ones, then a repeat */
			b.weights[0] = NAN;
			peer_send_batch(worker, &b, &plan);
			assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
			b.weights[0] = 0;
			peer_send_batch(worker, &b, &plan);
			assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
			peer_send_batch(worker, &b, &plan);
			assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
			first = false;
		} else {
			peer_send_batch(worker, &b, &plan);
		}
		batch_fini(&b);
	}
	peer_say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_hear(client);
	assert_non_null(m);
	assert_int_equal(m->job_list_answer->n_jobs, 1);
	assert_string_equal(m->job_list_answer->jobs[0]->state, "done");
	assert_true(m->job_list_answer->jobs[0]->fetchable);
	scripted_hang_up(client);
	scripted_hang_up(worker);
}

/* ---- fetching ---- */

enum { PIECE = 1 << 20, FILE_SIZE = 2 * PIECE + 5 };

/* Makes the preview as the coordinator does: the whole file, renamed over the previous one. */
static void make_preview(char letter)
{
	char path[96], temporary[112];
	static char bytes[FILE_SIZE];
	snprintf(path, sizeof path, "%s/spool/jobs/j1/preview.exr", served_folder());
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	memset(bytes, letter, sizeof bytes);
	FILE *f = fopen(temporary, "w");
	assert_non_null(f);
	assert_int_equal(fwrite(bytes, 1, sizeof bytes, f), sizeof bytes);
	assert_int_equal(fclose(f), 0);
	assert_int_equal(rename(temporary, path), 0);
}

static const Farm__FetchChunk *fetch_piece(struct scripted *p, uint64_t offset)
{
	assert_true(scripted_fetch(p, 1, FARM__WHAT__WHAT_PREVIEW, offset));
	const Farm__Envelope *answer = scripted_hear(p);
	assert_true(answer && answer->body_case == FARM__ENVELOPE__BODY_FETCH_CHUNK);
	return answer->fetch_chunk;
}

static void expect_piece(struct scripted *p, uint64_t offset, char letter)
{
	const Farm__FetchChunk *c = fetch_piece(p, offset);
	assert_string_equal(c->error, "");
	assert_int_equal(c->size, FILE_SIZE);
	assert_int_equal(p->reader.payload.size, FILE_SIZE - offset < PIECE ? FILE_SIZE - offset : PIECE);
	assert_int_equal(p->reader.payload.bytes[0], letter);
	assert_int_equal(p->reader.payload.bytes[p->reader.payload.size - 1], letter);
}

static void what_is_fetched_is_one_file(void **state)
{
	(void)state;
	struct scripted *client[3];
	for (int i = 0; i < 3; i++) {
		client[i] = peer_call();
		assert_true(peer_hello(client[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	}
	make_preview('a');
	assert_true(*fetch_piece(client[0], PIECE)->error); /* no fetch has begun */
	expect_piece(client[0], 0, 'a');
	make_preview('b');
	expect_piece(client[1], 0, 'b');
	expect_piece(client[0], PIECE, 'a');
	expect_piece(client[0], 2 * PIECE, 'a');
	assert_true(*fetch_piece(client[0], 2 * PIECE)->error); /* that was the last piece */
	expect_piece(client[1], PIECE, 'b');
	/* Of the two fetches that may be open, the silent one gives way, and no other. */
	expect_piece(client[0], 0, 'b');
	expect_piece(client[1], PIECE, 'b');
	expect_piece(client[2], 0, 'b');
	expect_piece(client[1], 2 * PIECE, 'b');
	assert_non_null(strstr(fetch_piece(client[0], PIECE)->error, "in favour of others"));
	expect_piece(client[0], 0, 'b');
	expect_piece(client[2], PIECE, 'b');
	for (int i = 0; i < 3; i++)
		scripted_hang_up(client[i]);
}

/* Result of a lease: chains that find no light; a bootstrap in uniform light. */
static struct batch counting_batch(const struct lease_key *k, const struct plan *plan)
{
	struct batch b = black_batch(k, plan, 4);
	if (k->kind == LEASE_BOOTSTRAP) {
		for (uint64_t i = 0; i < b.weight_count; i++)
			b.weights[i] = 1;
		b.independent_sum = b.independent_square = (double)b.weight_count;
		return b;
	}
	b.counters[COUNT_STUCK] = b.state_count;
	b.counters[COUNT_LONGEST_STUCK] = 1 + k->group;
	b.strategy_count = 2;
	b.strategy[0][STRATEGY_PROPOSED] = 3;
	b.strategy[1][STRATEGY_PROPOSED] = b.counters[COUNT_SAMPLES] - 3;
	b.strategy[1][STRATEGY_RAYS] = UINT64_C(1) << 40;
	b.strategy[1][STRATEGY_FAIL_MODE] = 7 + k->part;
	return b;
}

/* The value is finite, and larger than all mutations of the job can add up to. */
static void send_with_huge_pixel(struct scripted *worker, struct batch *b, const struct plan *plan)
{
	size_t count = (size_t)plan->crop_width * plan->crop_height * TILE_CHANNELS;
	struct tile tile = {plan->crop_x, plan->crop_y, plan->crop_width, plan->crop_height,
			    mem_alloc(count, sizeof(float))};
	struct batch with = *b;
	tile.xyz[count / 2] = 1e30f;
	with.tiles = &tile;
	with.tile_count = 1;
	peer_send_batch(worker, &with, plan);
	mem_free(tile.xyz);
}

static void expect_counts_in_spool(const struct plan *plan)
{
	struct job_record r;
	struct error e;
	char path[96], command[300];
	struct ledger *l;
	snprintf(path, sizeof path, "%s/read", served_folder()); /* the coordinator has its own file locked */
	snprintf(command, sizeof command, "mkdir '%s' && cp '%s/spool/jobs.db'* '%s'", path, served_folder(), path);
	assert_int_equal(system(command), 0);
	assert_int_equal(ledger_open(&l, path, &e), 0);
	assert_int_equal(ledger_read_record(l, 2, &r, &e), 0);
	ledger_close(l);
	uint64_t leases = plan->rounds * plan->groups * plan->parts, chains = plan->chains * plan->rounds;
	assert_int_equal(r.leases_merged, leases);
	assert_int_equal(r.counts.repeats, 1);
	assert_int_equal(r.counts.refused, 2);
	assert_string_equal(r.mixture, "independent=0.1,hslt=0.9");
	assert_int_equal(r.strategy[0][STRATEGY_PROPOSED], 3 * leases);
	assert_int_equal(r.strategy[1][STRATEGY_PROPOSED], plan->rounds * plan_round_mutations(plan) - 3 * leases);
	assert_true(r.strategy[1][STRATEGY_RAYS] == leases << 40);
	assert_int_equal(r.strategy[1][STRATEGY_FAIL_MODE],
			 plan->rounds * plan->groups * (7 * plan->parts + plan->parts * (plan->parts - 1) / 2));
	assert_int_equal(r.stuck, chains);
	assert_int_equal(r.longest_stuck, 2);
	assert_non_null(strstr(r.note, "the image is black: no sample found light; "));
	assert_non_null(strstr(r.note, "longest run: 2 rejections"));
}

static void strategies_are_counted_once(void **state)
{
	(void)state;
	struct scripted *client = peer_call(), *worker = peer_call();
	struct plan plan;
	struct error e;
	struct plan_request r = peer_plan_request("independent=0.1,hslt=0.9");
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(client, r.mixture, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(client)->job, 2); /* the scene is still stored */
	assert_true(peer_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	peer_say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct lease_queue d = {.count = 0};
	bool first = true;
	while (!d.job_ended) {
		if (d.count == 0) {
			peer_attend(worker, &d);
			continue;
		}
		struct batch b = counting_batch(&d.keys[--d.count], &plan);
		bool wrong = first && b.key.kind == LEASE_RENDER;
		if (wrong) {
			b.strategy[0][STRATEGY_ACCEPTED] = 4; /* accepted, of 3 proposals */
			peer_send_batch(worker, &b, &plan);
			assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
			b.strategy[0][STRATEGY_ACCEPTED] = 0;
			send_with_huge_pixel(worker, &b, &plan);
			assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
		}
		peer_send_batch(worker, &b, &plan);
		assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
		if (wrong) {
			peer_send_batch(worker, &b, &plan);
			assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
			first = false;
		}
		batch_fini(&b);
	}
	expect_counts_in_spool(&plan);
	scripted_hang_up(client);
	scripted_hang_up(worker);
}

/* ---- results that wait ---- */

static void send_bootstrap(struct scripted *p, const struct lease_key *k)
{
	struct plan plan;
	struct error e;
	struct plan_request r = peer_plan_request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	struct batch b = black_batch(k, &plan, 0);
	peer_send_batch(p, &b, &plan);
	batch_fini(&b);
}

static const Farm__JobStatus *list_job(struct scripted *client, uint64_t job)
{
	peer_say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_hear(client);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	for (size_t i = 0; i < m->job_list_answer->n_jobs; i++)
		if (m->job_list_answer->jobs[i]->job == job)
			return m->job_list_answer->jobs[i];
	fail_msg("no job %llu", (unsigned long long)job);
	return NULL;
}

/* While the film may not be read, only results that would be merged wait, each once; all other messages are answered at
 * once. */
static void what_is_useless_does_not_wait(void **state)
{
	(void)state;
	struct scripted *client = peer_call(), *worker = peer_call(), *other = peer_call();
	struct lease_queue d = {.count = 0}, none = {.count = 0};
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	uint64_t job = peer_submit_answer(client)->job;
	assert_true(job > 0);
	assert_true(peer_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	peer_say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (d.count < 2)
		peer_attend(worker, &d);
	send_bootstrap(worker, &d.keys[0]);
	assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	while (d.count < 3)
		peer_attend(worker, &d);
	assert_true(peer_hello(other, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	peer_say_job_get(other, job);
	assert_int_equal(scripted_hear(other)->body_case, FARM__ENVELOPE__BODY_JOB_INFO);
	served_set_busy(true);
	for (int i = 0; i < 3; i++)
		send_bootstrap(worker, &d.keys[1]);
	send_bootstrap(worker, &d.keys[0]);
	assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
	send_bootstrap(other, &d.keys[0]);
	assert_int_equal(peer_verdict(other, &none), FARM__VERDICT__VERDICT_REPEATED);
	send_bootstrap(other, &d.keys[1]); /* the result waits already */
	assert_int_equal(peer_verdict(other, &none), FARM__VERDICT__VERDICT_REFUSED);
	send_bootstrap(other, &d.keys[2]); /* open: the worker may have held the lease before it reconnected */
	send_bootstrap(other, &d.keys[2]);
	send_bootstrap(other, &d.keys[0]);
	assert_int_equal(peer_verdict(other, &none), FARM__VERDICT__VERDICT_REPEATED);
	served_at_once(); /* from other tests */
	served_set_busy(false);
	assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	assert_int_equal(peer_verdict(other, &none), FARM__VERDICT__VERDICT_MERGED);
	assert_int_equal(served_at_once(), 1); /* other connections are read in between */
	send_bootstrap(worker, &d.keys[0]);    /* no other result was kept */
	assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
	assert_true(d.count >= 4); /* a worker that leaves takes its waiting results with it */
	served_set_busy(true);
	send_bootstrap(worker, &d.keys[3]);
	scripted_hang_up(worker);
	while (list_job(client, job)->leases)
		usleep(1000);
	send_bootstrap(other, &d.keys[3]);
	served_set_busy(false);
	assert_int_equal(peer_verdict(other, &none), FARM__VERDICT__VERDICT_MERGED);
	scripted_hang_up(client);
	scripted_hang_up(other);
}

static void say_extend(const struct scripted *p, uint64_t job, uint64_t spp, int times)
{
	unsigned char all[512];
	size_t at = 0;
	Farm__Control c;
	Farm__Envelope m;
	farm__control__init(&c);
	farm__envelope__init(&m);
	c.job = job;
	c.verb = FARM__VERB__VERB_EXTEND;
	c.more_spp = spp;
	m.body_case = FARM__ENVELOPE__BODY_CONTROL;
	m.control = &c;
	for (int i = 0; i < times; i++) {
		size_t size;
		unsigned char *frame = checksummed_message(&m, NULL, 0, &size);
		memcpy(all + at, frame, size);
		at += size;
		free(frame);
	}
	peer_say_bytes(p, all, at);
}

static void hear_done(struct scripted *p, bool ok, const char *text)
{
	const Farm__Envelope *m = scripted_hear(p);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_DONE);
	assert_int_equal(m->done->ok, ok);
	if (!strstr(m->done->text, text))
		fail_msg("'%s' is not in '%s'", text, m->done->text);
}

/* The job that ended before: its films are read outside the loop, and each Extend gets one answer. */
static void extensions_wait_for_films(void **state)
{
	(void)state;
	struct scripted *a = peer_call(), *b = peer_call();
	assert_true(peer_hello(a, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	assert_true(peer_hello(b, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	say_extend(a, 2, 0, 1); /* this is no reason to wait */
	hear_done(a, false, "a bound is missing");
	say_extend(a, 2, 8, 3);
	say_extend(b, 2, 8, 1);
	hear_done(a, false, "one extension at a time");
	hear_done(a, false, "one extension at a time");
	hear_done(a, true, "continues after");
	hear_done(b, true, "continues after"); /* the job runs by then */
	say_extend(a, 1, 8, 1);
	hear_done(a, false, "it is black");
	scripted_hang_up(a);
	scripted_hang_up(b);
	a = peer_call();
	assert_true(peer_hello(a, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_say_empty(a, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_hear(a);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	assert_false(m->job_list_answer->jobs[1]->ended);
	scripted_hang_up(a);
}

static void say_failed(struct scripted *p, const struct lease_key *k, const char *text)
{
	Farm__LeaseKey key;
	Farm__LeaseFailed failed;
	Farm__Envelope m;
	char copy[64];
	lease_key_to_wire(k, &key);
	farm__lease_failed__init(&failed);
	farm__envelope__init(&m);
	strcpy(copy, text);
	failed.key = &key;
	failed.text = copy;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_FAILED;
	m.lease_failed = &failed;
	peer_say(p, &m, NULL, 0);
}

/* A failure counts against the scene or the worker, and never ends the connection because of bytes that a scene's
 * author chose. */
static void a_failure_counts_whatever_its_text(void **state)
{
	(void)state;
	struct scripted *client = peer_call(), *worker = peer_call();
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_true(peer_submit_answer(client)->job);
	assert_true(peer_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	peer_say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct lease_queue d = {.count = 0};
	while (d.count == 0)
		peer_attend(worker, &d);
	say_failed(worker, &d.keys[0], "half a letter \xc3\nof a file");
	peer_say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (!strstr(list_job(client, d.keys[0].job)->why, "scripted failed last: half a letter ? of a file"))
		usleep(1000);
	struct pollfd ready = {worker->fd, POLLIN, 0};
	while (poll(&ready, 1, 200) == 1) /* neither an error nor the end of the connection */
		assert_true(peer_attend(worker, &d) == FARM__VERDICT__VERDICT_NONE &&
			    worker->env.message->body_case != FARM__ENVELOPE__BODY_FAULT);
	scripted_hang_up(client);
	scripted_hang_up(worker);
}

static off_t size_of_log(uint64_t job)
{
	char path[128];
	struct stat st;
	snprintf(path, sizeof path, "%s/spool/jobs/j%llu/log", served_folder(), (unsigned long long)job);
	assert_int_equal(stat(path, &st), 0);
	return st.st_size;
}

/* A worker complains, as fast as it can, about a lease that it does not hold. */
static void complaints_do_not_fill_the_log(void **state)
{
	(void)state;
	enum { COMPLAINTS = 4000, MOST = 100000 /* bytes */ };
	const struct lease_key k = {.job = 3, .kind = LEASE_BOOTSTRAP};
	struct scripted *worker = peer_call();
	struct lease_queue d = {.count = 0};
	off_t before = size_of_log(k.job);
	assert_true(peer_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	for (int i = 0; i < COMPLAINTS; i++)
		say_failed(worker, &k, "I do not like it");
	peer_say_job_get(worker, 1000); /* answered once all complaints were read */
	while (!d.job_ended)
		peer_attend(worker, &d);
	assert_in_range(size_of_log(k.job) - before, 1, MOST);
	scripted_hang_up(worker);
}

/* Sends an extension of job 2 and waits until the coordinator has it. */
static void send_extension(struct scripted *p)
{
	say_extend(p, 2, 8, 1);
	peer_say_empty(p, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_hear(p);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
}

static void extensions_are_served_as_they_came(void **state)
{
	(void)state;
	enum { CLIENTS = 4 };
	static const unsigned order[CLIENTS] = {1, 3, 0, 2};
	struct scripted *p[CLIENTS];
	unsigned long long last = 0, rounds = 0;
	for (int i = 0; i < CLIENTS; i++)
		assert_true(peer_hello(p[i] = peer_call(), FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	served_set_busy(true);
	for (int i = 0; i < CLIENTS; i++)
		send_extension(p[order[i]]);
	scripted_hang_up(p[order[1]]);
	served_set_busy(false);
	for (int i = 0; i < CLIENTS; i++, last = rounds) {
		if (i == 1)
			continue;
		hear_done(p[order[i]], true, "continues after");
		const char *text = strstr(p[order[i]]->env.message->done->text, "until ");
		assert_int_equal(sscanf(text, "until %llu", &rounds), 1);
		assert_true(rounds > last);
		scripted_hang_up(p[order[i]]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_black_job_ends),
		cmocka_unit_test(what_is_fetched_is_one_file), /* uses that job */
		cmocka_unit_test(strategies_are_counted_once),
		cmocka_unit_test(what_is_useless_does_not_wait),
		cmocka_unit_test(extensions_wait_for_films), /* continues the job of strategies_are_counted_once */
		cmocka_unit_test(extensions_are_served_as_they_came),
		cmocka_unit_test(a_failure_counts_whatever_its_text),
		cmocka_unit_test(complaints_do_not_fill_the_log), /* uses that job */
	};
	return cmocka_run_group_tests(tests, set_up, served_stop);
}
