/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One client sends orders whose records are flushed slowly, or asks for lists of many jobs, as fast as it can: other
 * clients are answered meanwhile, and the requests of one client are answered in their order.
 */
#include "tests/support/served.h"

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

static void slow_down(const char *spool)
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
	served_prepare(slow_down);
	return served_start(60, 60, 60);
}

static struct scripted *call_client(void)
{
	struct scripted *client = peer_call();
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	return client;
}

static void send_order(struct scripted *client, Farm__Verb verb, int priority)
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
	peer_say(client, &m, NULL, 0);
}

/* Returns the priority of the first job; the list must have `jobs` jobs. */
static int hear_list(struct scripted *client, unsigned jobs)
{
	const Farm__Envelope *m = scripted_hear(client);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	assert_int_equal(m->job_list_answer->n_jobs, jobs);
	for (unsigned i = 0; i < jobs; i++)
		if (m->job_list_answer->jobs[i]->job == 1)
			return m->job_list_answer->jobs[i]->priority;
	fail();
	return 0;
}

static int ask_for_list(struct scripted *client, unsigned jobs)
{
	peer_say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	return hear_list(client, jobs);
}

static void hear_done(struct scripted *client)
{
	const Farm__Envelope *m = scripted_hear(client);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_DONE);
	assert_true(m->done->ok);
}

static void who_gives_orders_stops_nobody(void **state)
{
	(void)state;
	struct scripted *master = call_client(), *other = call_client();
	peer_submit(master, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(master)->n_missing, 1);
	peer_send_blob(master, "<scene/>", "<scene/>");
	assert_int_equal(peer_submit_answer(master)->job, 1);
	unsigned before = commits->count, looks = 0;
	for (int i = 1; i <= ORDERS; i++)
		send_order(master, FARM__VERB__VERB_PRIORITY, i);
	peer_say_empty(master, FARM__ENVELOPE__BODY_JOB_LIST);
	for (int last = 0; last < ORDERS; looks++) { /* some looks come in the middle of the orders */
		int now = ask_for_list(other, 1);
		assert_in_range(now, last, ORDERS);
		last = now;
	}
	assert_true(looks > 1); /* a server that first answers all orders of one client would give 0 or 1 */
	assert_in_range(commits->count - before, ORDERS, 3 * ORDERS);
	for (int i = 0; i < ORDERS; i++)
		hear_done(master);
	hear_list(master, 1);
	scripted_hang_up(master);
	scripted_hang_up(other);
}

/* The lists take some hundred milliseconds together, and fewer bytes than may wait for a client. */
static void who_asks_for_lists_stops_nobody(void **state)
{
	(void)state;
	enum { JOBS = 240, LISTS = 45, PRIORITY = 7 };
	struct scripted *master = call_client(), *other = call_client();
	commits->microseconds = 0;
	for (int i = 2; i <= JOBS; i++) {
		peer_submit(master, NULL, "<scene/>", "s.xml", "s.xml");
		assert_int_equal(peer_submit_answer(master)->job, i);
	}
	ask_for_list(other, JOBS);
	for (int i = 0; i < LISTS; i++)
		peer_say_empty(master, FARM__ENVELOPE__BODY_JOB_LIST);
	send_order(master, FARM__VERB__VERB_PRIORITY, PRIORITY);
	unsigned looks = 0;
	while (ask_for_list(other, JOBS) != PRIORITY)
		looks++;
	print_message("%u lists for another client during %d\n", looks, LISTS);
	assert_true(looks > 1); /* a server that first answers all requests of one client would give 0 or 1 */
	for (int i = 0; i < LISTS; i++)
		assert_true(hear_list(master, JOBS) != PRIORITY);
	hear_done(master);
	scripted_hang_up(master);
	scripted_hang_up(other);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(who_gives_orders_stops_nobody),
					   cmocka_unit_test(who_asks_for_lists_stops_nobody)};
	return cmocka_run_group_tests(tests, set_up, served_stop);
}
