/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One client sends orders whose records are flushed slowly, or asks for lists of many jobs, as fast as it can: other
 * clients are answered meanwhile, and the requests of one client are answered in their order.
 */
#include "tests/support/child_server.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <sqlite3.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { ORDERS = 100, COMMIT_US = 10000 };

static struct {
	_Atomic unsigned count, microseconds;
} * commits; /* shared with the server */

static int slow_commit(void *unused)
{
	(void)unused;
	++commits->count;
	usleep(commits->microseconds);
	return 0;
}

static int hook_commits(sqlite3 *db, char **text, const struct sqlite3_api_routines *api)
{
	(void)text, (void)api;
	sqlite3_commit_hook(db, slow_commit, NULL);
	return SQLITE_OK;
}

static void slow_down_commits(const char *spool)
{
	(void)spool;
	sqlite3_auto_extension((void (*)(void))hook_commits);
}

static int set_up(void **state)
{
	(void)state;
	commits = mmap(NULL, sizeof *commits, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	assert_true(commits != MAP_FAILED);
	commits->microseconds = COMMIT_US;
	child_server_set_spool_maker(slow_down_commits);
	return child_server_start(60, 60, 60);
}

static struct scripted_peer *connect_client(void)
{
	struct scripted_peer *client = child_server_connect();
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	return client;
}

static void send_order(struct scripted_peer *client, Farm__Verb verb, int priority)
{
	Farm__Control c;
	Farm__Envelope m;
	farm__control__init(&c);
	farm__envelope__init(&m);
	c.job = 1;
	c.verb = verb;
	c.priority = priority;
	m.body_case = FARM__ENVELOPE__BODY_CONTROL;
	m.control = &c;
	child_server_send(client, &m, NULL, 0);
}

/* Returns the priority of the first job; the list must have `jobs` jobs. */
static int hear_list(struct scripted_peer *client, unsigned jobs)
{
	const Farm__Envelope *m = scripted_peer_receive(client);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	assert_int_equal(m->job_list_answer->n_jobs, jobs);
	for (unsigned i = 0; i < jobs; i++)
		if (m->job_list_answer->jobs[i]->job == 1)
			return m->job_list_answer->jobs[i]->priority;
	fail();
	return 0;
}

static int ask_for_list(struct scripted_peer *client, unsigned jobs)
{
	child_server_send_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	return hear_list(client, jobs);
}

static void expect_done(struct scripted_peer *client)
{
	const Farm__Envelope *m = scripted_peer_receive(client);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_DONE);
	assert_true(m->done->ok);
}

static void client_with_many_orders_delays_no_other(void **state)
{
	(void)state;
	struct scripted_peer *master = connect_client(), *other = connect_client();
	child_server_submit(master, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(master)->n_missing, 1);
	child_server_send_blob(master, "<scene/>", "<scene/>");
	assert_int_equal(child_server_receive_submit_answer(master)->job, 1);
	unsigned before = commits->count, list_count = 0;
	for (int i = 1; i <= ORDERS; i++)
		send_order(master, FARM__VERB__VERB_PRIORITY, i);
	child_server_send_empty(master, FARM__ENVELOPE__BODY_JOB_LIST);
	for (int last = 0; last < ORDERS; list_count++) { /* some looks come in the middle of the orders */
		int now = ask_for_list(other, 1);
		assert_in_range(now, last, ORDERS);
		last = now;
	}
	assert_true(list_count > 1); /* a server that first answers all orders of one client would give 0 or 1 */
	assert_in_range(commits->count - before, ORDERS, 3 * ORDERS);
	for (int i = 0; i < ORDERS; i++)
		expect_done(master);
	hear_list(master, 1);
	scripted_peer_disconnect(master);
	scripted_peer_disconnect(other);
}

/* The lists take some hundred milliseconds together, and fewer bytes than may wait for a client. */
static void client_that_asks_for_lists_delays_no_other(void **state)
{
	(void)state;
	enum { JOBS = 240, LISTS = 45, PRIORITY = 7 };
	struct scripted_peer *master = connect_client(), *other = connect_client();
	commits->microseconds = 0;
	for (int i = 2; i <= JOBS; i++) {
		child_server_submit(master, NULL, "<scene/>", "s.xml", "s.xml");
		assert_int_equal(child_server_receive_submit_answer(master)->job, i);
	}
	ask_for_list(other, JOBS);
	for (int i = 0; i < LISTS; i++)
		child_server_send_empty(master, FARM__ENVELOPE__BODY_JOB_LIST);
	send_order(master, FARM__VERB__VERB_PRIORITY, PRIORITY);
	unsigned list_count = 0;
	while (ask_for_list(other, JOBS) != PRIORITY)
		list_count++;
	print_message("%u lists for another client during %d\n", list_count, LISTS);
	assert_true(list_count > 1); /* a server that first answers all requests of one client would give 0 or 1 */
	for (int i = 0; i < LISTS; i++)
		assert_true(hear_list(master, JOBS) != PRIORITY);
	expect_done(master);
	scripted_peer_disconnect(master);
	scripted_peer_disconnect(other);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(client_with_many_orders_delays_no_other),
					   cmocka_unit_test(client_that_asks_for_lists_delays_no_other)};
	return cmocka_run_group_tests(tests, set_up, child_server_stop);
}
