/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's shell with workers that answer every lease at once with whatever the test needs: results that count
 * once, come late, are useless, or failed; and extensions of jobs that are done. Slow connections are in
 * test_slow_links.c.
 */
#include "tests/support/child_server.h"

#include "common/base/mem.h"
#include "coordinator/store/ledger.h"
#include "tests/support/black_batch.h"
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
	return child_server_start(60, 60, 60);
}

static void a_black_job_ends(void **state)
{
	(void)state;
	struct scripted_peer *client = child_server_connect(), *worker = child_server_connect();
	struct plan plan;
	struct error e;
	struct plan_request r = child_server_plan_request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, 1);
	child_server_send_blob(client, "<scene/>", "<scene/>");
	const Farm__SubmitAnswer *a = child_server_receive_submit_answer(client);
	assert_int_equal(a->job, 1);
	assert_true(child_server_exchange_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	child_server_send_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct pending_leases d = {.count = 0};
	bool first = true;
	while (!d.job_ended) {
		if (d.count == 0) {
			child_server_handle_message(worker, &d);
			continue;
		}
		struct batch b = black_batch(&d.keys[--d.count], &plan, 0);
		if (first) { /* wrong results, then right ones, then a repeat */
			b.weights[0] = NAN;
			child_server_send_batch(worker, &b, &plan);
			assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
			b.weights[0] = 0;
			child_server_send_batch(worker, &b, &plan);
			assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
			child_server_send_batch(worker, &b, &plan);
			assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
			first = false;
		} else {
			child_server_send_batch(worker, &b, &plan);
		}
		batch_fini(&b);
	}
	child_server_send_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_peer_receive(client);
	assert_non_null(m);
	assert_int_equal(m->job_list_answer->n_jobs, 1);
	assert_string_equal(m->job_list_answer->jobs[0]->state, "done");
	assert_true(m->job_list_answer->jobs[0]->fetchable);
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(worker);
}

/* ---- fetching ---- */

enum { PIECE = 1 << 20, FILE_SIZE = 2 * PIECE + 5 };

/* Makes the preview as the coordinator does: the whole file, renamed over the previous one. */
static void make_preview(char letter)
{
	char path[96], temporary[112];
	static char bytes[FILE_SIZE];
	snprintf(path, sizeof path, "%s/spool/jobs/j1/preview.exr", child_server_folder());
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	memset(bytes, letter, sizeof bytes);
	FILE *f = fopen(temporary, "w");
	assert_non_null(f);
	assert_int_equal(fwrite(bytes, 1, sizeof bytes, f), sizeof bytes);
	assert_int_equal(fclose(f), 0);
	assert_int_equal(rename(temporary, path), 0);
}

static const Farm__FetchChunk *fetch_piece(struct scripted_peer *p, uint64_t offset)
{
	assert_true(scripted_peer_fetch(p, 1, FARM__WHAT__WHAT_PREVIEW, offset));
	const Farm__Envelope *answer = scripted_peer_receive(p);
	assert_true(answer && answer->body_case == FARM__ENVELOPE__BODY_FETCH_CHUNK);
	return answer->fetch_chunk;
}

static void expect_piece(struct scripted_peer *p, uint64_t offset, char letter)
{
	const Farm__FetchChunk *c = fetch_piece(p, offset);
	assert_string_equal(c->error, "");
	assert_int_equal(c->size, FILE_SIZE);
	assert_int_equal(p->reader.payload.size, FILE_SIZE - offset < PIECE ? FILE_SIZE - offset : PIECE);
	assert_int_equal(p->reader.payload.bytes[0], letter);
	assert_int_equal(p->reader.payload.bytes[p->reader.payload.size - 1], letter);
}

static void fetched_pieces_are_of_one_file(void **state)
{
	(void)state;
	struct scripted_peer *client[3];
	for (int i = 0; i < 3; i++) {
		client[i] = child_server_connect();
		assert_true(child_server_exchange_hello(client[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
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
		scripted_peer_disconnect(client[i]);
}

/* Result of a lease: chains that find no light; a bootstrap in uniform light. */
static struct batch make_counting_batch(const struct lease_key *k, const struct plan *plan)
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
	b.strategies[0][STRATEGY_PROPOSED] = 3;
	b.strategies[1][STRATEGY_PROPOSED] = b.counters[COUNT_SAMPLES] - 3;
	b.strategies[1][STRATEGY_RAYS] = UINT64_C(1) << 40;
	b.strategies[1][STRATEGY_FAIL_MODE] = 7 + k->part;
	return b;
}

/* The value is finite, and larger than all mutations of the job can add up to. */
static void send_with_huge_pixel(struct scripted_peer *worker, struct batch *b, const struct plan *plan)
{
	size_t count = (size_t)plan->crop_width * plan->crop_height * TILE_CHANNELS;
	struct tile tile = {plan->crop_x, plan->crop_y, plan->crop_width, plan->crop_height,
			    mem_alloc(count, sizeof(float))};
	struct batch batch_with_tile = *b;
	tile.xyz[count / 2] = 1e30f;
	batch_with_tile.tiles = &tile;
	batch_with_tile.tile_count = 1;
	child_server_send_batch(worker, &batch_with_tile, plan);
	mem_free(tile.xyz);
}

static void expect_counts_in_spool(const struct plan *plan)
{
	struct job_record r;
	struct error e;
	char path[96], command[300];
	struct ledger *l;
	snprintf(path, sizeof path, "%s/read", child_server_folder()); /* the coordinator has its own file locked */
	snprintf(command, sizeof command, "mkdir '%s' && cp '%s/spool/jobs.db'* '%s'", path, child_server_folder(),
		 path);
	assert_int_equal(system(command), 0);
	assert_int_equal(ledger_open(&l, path, &e), 0);
	assert_int_equal(ledger_read_record(l, 2, &r, &e), 0);
	ledger_close(l);
	uint64_t leases = plan->rounds * plan->groups * plan->parts, chains = plan->chains * plan->rounds;
	assert_int_equal(r.leases_merged, leases);
	assert_int_equal(r.counts.repeats, 1);
	assert_int_equal(r.counts.refused, 2);
	assert_string_equal(r.mixture, "independent=0.1,hslt=0.9");
	assert_int_equal(r.strategies[0][STRATEGY_PROPOSED], 3 * leases);
	assert_int_equal(r.strategies[1][STRATEGY_PROPOSED], plan->rounds * plan_round_mutations(plan) - 3 * leases);
	assert_true(r.strategies[1][STRATEGY_RAYS] == leases << 40);
	assert_int_equal(r.strategies[1][STRATEGY_FAIL_MODE],
			 plan->rounds * plan->groups * (7 * plan->parts + plan->parts * (plan->parts - 1) / 2));
	assert_int_equal(r.stuck, chains);
	assert_int_equal(r.longest_stuck, 2);
	assert_non_null(strstr(r.note, "the image is black: no sample found light; "));
	assert_non_null(strstr(r.note, "longest run: 2 rejections"));
}

static void strategies_of_a_result_are_counted_once(void **state)
{
	(void)state;
	struct scripted_peer *client = child_server_connect(), *worker = child_server_connect();
	struct plan plan;
	struct error e;
	struct plan_request r = child_server_plan_request("independent=0.1,hslt=0.9");
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(client, r.mixture, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(client)->job, 2); /* the scene is still stored */
	assert_true(child_server_exchange_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	child_server_send_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct pending_leases d = {.count = 0};
	bool first = true;
	while (!d.job_ended) {
		if (d.count == 0) {
			child_server_handle_message(worker, &d);
			continue;
		}
		struct batch b = make_counting_batch(&d.keys[--d.count], &plan);
		bool wrong = first && b.key.kind == LEASE_RENDER;
		if (wrong) {
			b.strategies[0][STRATEGY_ACCEPTED] = 4; /* accepted, of 3 proposals */
			child_server_send_batch(worker, &b, &plan);
			assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
			b.strategies[0][STRATEGY_ACCEPTED] = 0;
			send_with_huge_pixel(worker, &b, &plan);
			assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
		}
		child_server_send_batch(worker, &b, &plan);
		assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
		if (wrong) {
			child_server_send_batch(worker, &b, &plan);
			assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
			first = false;
		}
		batch_fini(&b);
	}
	expect_counts_in_spool(&plan);
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(worker);
}

/* ---- results that wait ---- */

static void send_bootstrap_result(struct scripted_peer *p, const struct lease_key *k)
{
	struct plan plan;
	struct error e;
	struct plan_request r = child_server_plan_request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	struct batch b = black_batch(k, &plan, 0);
	child_server_send_batch(p, &b, &plan);
	batch_fini(&b);
}

static const Farm__JobStatus *list_job(struct scripted_peer *client, uint64_t job)
{
	child_server_send_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_peer_receive(client);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	for (size_t i = 0; i < m->job_list_answer->n_jobs; i++)
		if (m->job_list_answer->jobs[i]->job == job)
			return m->job_list_answer->jobs[i];
	fail_msg("no job %llu", (unsigned long long)job);
	return NULL;
}

/* While the film may not be read, only results that would be merged wait, each once; all other messages are answered at
 * once. */
static void only_useful_results_wait_for_the_film(void **state)
{
	(void)state;
	struct scripted_peer *client = child_server_connect(), *worker = child_server_connect(),
			     *other = child_server_connect();
	struct pending_leases d = {.count = 0}, none = {.count = 0};
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	uint64_t job = child_server_receive_submit_answer(client)->job;
	assert_true(job > 0);
	assert_true(child_server_exchange_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	child_server_send_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (d.count < 2)
		child_server_handle_message(worker, &d);
	send_bootstrap_result(worker, &d.keys[0]);
	assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	while (d.count < 3)
		child_server_handle_message(worker, &d);
	assert_true(child_server_exchange_hello(other, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	child_server_send_job_get(other, job);
	assert_int_equal(scripted_peer_receive(other)->body_case, FARM__ENVELOPE__BODY_JOB_INFO);
	child_server_set_busy(true);
	for (int i = 0; i < 3; i++)
		send_bootstrap_result(worker, &d.keys[1]);
	send_bootstrap_result(worker, &d.keys[0]);
	assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
	send_bootstrap_result(other, &d.keys[0]);
	assert_int_equal(child_server_await_verdict(other, &none), FARM__VERDICT__VERDICT_REPEATED);
	send_bootstrap_result(other, &d.keys[1]); /* the result waits already */
	assert_int_equal(child_server_await_verdict(other, &none), FARM__VERDICT__VERDICT_REFUSED);
	send_bootstrap_result(other, &d.keys[2]); /* open: the worker may have held the lease before it reconnected */
	send_bootstrap_result(other, &d.keys[2]);
	send_bootstrap_result(other, &d.keys[0]);
	assert_int_equal(child_server_await_verdict(other, &none), FARM__VERDICT__VERDICT_REPEATED);
	child_server_max_batches_per_turn(); /* from other tests */
	child_server_set_busy(false);
	assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	assert_int_equal(child_server_await_verdict(other, &none), FARM__VERDICT__VERDICT_MERGED);
	assert_int_equal(child_server_max_batches_per_turn(), 1); /* other connections are read in between */
	send_bootstrap_result(worker, &d.keys[0]);		  /* no other result was kept */
	assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
	assert_true(d.count >= 4); /* a worker that leaves takes its waiting results with it */
	child_server_set_busy(true);
	send_bootstrap_result(worker, &d.keys[3]);
	scripted_peer_disconnect(worker);
	while (list_job(client, job)->leases)
		usleep(1000);
	send_bootstrap_result(other, &d.keys[3]);
	child_server_set_busy(false);
	assert_int_equal(child_server_await_verdict(other, &none), FARM__VERDICT__VERDICT_MERGED);
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(other);
}

static void send_extend(const struct scripted_peer *p, uint64_t job, uint64_t spp, int times)
{
	unsigned char frames[512];
	size_t total_size = 0;
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
		unsigned char *frame = checksummed_frame_from_message(&m, NULL, 0, &size);
		memcpy(frames + total_size, frame, size);
		total_size += size;
		free(frame);
	}
	child_server_send_bytes(p, frames, total_size);
}

static void expect_done(struct scripted_peer *p, bool ok, const char *text)
{
	const Farm__Envelope *m = scripted_peer_receive(p);
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
	struct scripted_peer *a = child_server_connect(), *b = child_server_connect();
	assert_true(child_server_exchange_hello(a, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	assert_true(child_server_exchange_hello(b, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	send_extend(a, 2, 0, 1); /* this is no reason to wait */
	expect_done(a, false, "a bound is missing");
	send_extend(a, 2, 8, 3);
	send_extend(b, 2, 8, 1);
	expect_done(a, false, "one extension at a time");
	expect_done(a, false, "one extension at a time");
	expect_done(a, true, "continues after");
	expect_done(b, true, "continues after"); /* the job runs by then */
	send_extend(a, 1, 8, 1);
	expect_done(a, false, "it is black");
	scripted_peer_disconnect(a);
	scripted_peer_disconnect(b);
	a = child_server_connect();
	assert_true(child_server_exchange_hello(a, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_send_empty(a, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_peer_receive(a);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	assert_false(m->job_list_answer->jobs[1]->ended);
	scripted_peer_disconnect(a);
}

static void send_failure(struct scripted_peer *p, const struct lease_key *k, const char *text)
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
	child_server_send(p, &m, NULL, 0);
}

/* A failure counts against the scene or the worker, and never ends the connection because of bytes that a scene's
 * author chose. */
static void a_failure_counts_whatever_its_text(void **state)
{
	(void)state;
	struct scripted_peer *client = child_server_connect(), *worker = child_server_connect();
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_true(child_server_receive_submit_answer(client)->job);
	assert_true(child_server_exchange_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	child_server_send_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct pending_leases d = {.count = 0};
	while (d.count == 0)
		child_server_handle_message(worker, &d);
	send_failure(worker, &d.keys[0], "half a letter \xc3\nof a file");
	child_server_send_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (!strstr(list_job(client, d.keys[0].job)->why, "scripted failed last: half a letter ? of a file"))
		usleep(1000);
	struct pollfd ready = {worker->fd, POLLIN, 0};
	while (poll(&ready, 1, 200) == 1) /* neither an error nor the end of the connection */
		assert_true(child_server_handle_message(worker, &d) == FARM__VERDICT__VERDICT_NONE &&
			    worker->env.message->body_case != FARM__ENVELOPE__BODY_FAULT);
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(worker);
}

static off_t log_size(uint64_t job)
{
	char path[128];
	struct stat st;
	snprintf(path, sizeof path, "%s/spool/jobs/j%llu/log", child_server_folder(), (unsigned long long)job);
	assert_int_equal(stat(path, &st), 0);
	return st.st_size;
}

/* A worker complains, as fast as it can, about a lease that it does not hold. */
static void complaints_do_not_fill_the_log(void **state)
{
	(void)state;
	enum { COMPLAINTS = 4000, LOG_BYTES_MAX = 100000 /* bytes */ };
	const struct lease_key k = {.job = 3, .kind = LEASE_BOOTSTRAP};
	struct scripted_peer *worker = child_server_connect();
	struct pending_leases d = {.count = 0};
	off_t before = log_size(k.job);
	assert_true(child_server_exchange_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	for (int i = 0; i < COMPLAINTS; i++)
		send_failure(worker, &k, "I do not like it");
	child_server_send_job_get(worker, 1000); /* answered once all complaints were read */
	while (!d.job_ended)
		child_server_handle_message(worker, &d);
	assert_in_range(log_size(k.job) - before, 1, LOG_BYTES_MAX);
	scripted_peer_disconnect(worker);
}

/* Sends an extension of job 2 and waits until the coordinator has it. */
static void send_extension(struct scripted_peer *p)
{
	send_extend(p, 2, 8, 1);
	child_server_send_empty(p, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_peer_receive(p);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
}

static void extensions_are_served_in_their_order(void **state)
{
	(void)state;
	enum { CLIENTS = 4 };
	static const unsigned order[CLIENTS] = {1, 3, 0, 2};
	struct scripted_peer *p[CLIENTS];
	unsigned long long last = 0, rounds = 0;
	for (int i = 0; i < CLIENTS; i++)
		assert_true(child_server_exchange_hello(p[i] = child_server_connect(), FARM_VERSION,
							FARM__ROLE__ROLE_CLIENT)
				    ->accepted);
	child_server_set_busy(true);
	for (int i = 0; i < CLIENTS; i++)
		send_extension(p[order[i]]);
	scripted_peer_disconnect(p[order[1]]);
	child_server_set_busy(false);
	for (int i = 0; i < CLIENTS; i++, last = rounds) {
		if (i == 1)
			continue;
		expect_done(p[order[i]], true, "continues after");
		const char *text = strstr(p[order[i]]->env.message->done->text, "until ");
		assert_int_equal(sscanf(text, "until %llu", &rounds), 1);
		assert_true(rounds > last);
		scripted_peer_disconnect(p[order[i]]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_black_job_ends),
		cmocka_unit_test(fetched_pieces_are_of_one_file), /* uses that job */
		cmocka_unit_test(strategies_of_a_result_are_counted_once),
		cmocka_unit_test(only_useful_results_wait_for_the_film),
		cmocka_unit_test(
			extensions_wait_for_films), /* continues the job of strategies_of_a_result_are_counted_once */
		cmocka_unit_test(extensions_are_served_in_their_order),
		cmocka_unit_test(a_failure_counts_whatever_its_text),
		cmocka_unit_test(complaints_do_not_fill_the_log), /* uses that job */
	};
	return cmocka_run_group_tests(tests, set_up, child_server_stop);
}
