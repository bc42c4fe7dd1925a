/* SPDX-License-Identifier: Apache-2.0 */
/* A spool has one master, never gives an id twice, and remembers its jobs. */
#include "coordinator/store/spool.h"
#include "common/base/mem.h"
#include "common/base/mem.h"
#include "tests/support/folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void one_master(void **state)
{
	(void)state;
	struct spool *a, *b;
	struct error e;
	assert_int_equal(spool_open(&a, folder, &e), 0);
	assert_int_equal(spool_open(&b, folder, &e), -EBUSY);
	spool_close(a);
	assert_int_equal(spool_open(&b, folder, &e), 0);
	spool_close(b);
}

static void ids_are_never_given_twice(void **state)
{
	(void)state;
	struct spool *s;
	struct error e;
	char command[256];
	assert_int_equal(spool_open(&s, folder, &e), 0);
	assert_int_equal(spool_next_job(s), 1);
	assert_int_equal(spool_take_job(s, 1, &e), 0);
	assert_int_equal(spool_take_job(s, 2, &e), 0);
	spool_close(s);
	snprintf(command, sizeof command, "rm -rf '%s/jobs/j2'", folder); /* the counter remembers */
	assert_int_equal(system(command), 0);
	assert_int_equal(spool_open(&s, folder, &e), 0);
	assert_int_equal(spool_next_job(s), 3);
	spool_close(s);
	snprintf(command, sizeof command, "rm '%s/next-job' && mkdir '%s/jobs/j41'", folder,
		 folder); /* the folders, too */
	assert_int_equal(system(command), 0);
	assert_int_equal(spool_open(&s, folder, &e), 0);
	assert_int_equal(spool_next_job(s), 42);
	uint64_t *ids;
	size_t count;
	assert_int_equal(spool_jobs(s, &ids, &count, &e), 0);
	assert_int_equal(count, 2);
	assert_int_equal(ids[0], 1);
	assert_int_equal(ids[1], 41);
	mem_free(ids);
	spool_close(s);
}

static void records_come_back(void **state)
{
	(void)state;
	struct spool *s;
	struct error e;
	struct job_record r = {.id = 7,
			       .priority = -3,
			       .exit_code = 4,
			       .has_result = true,
			       .submitted = 1.5e9,
			       .ended = 1.5e9 + 1,
			       .progress = 0.1,
			       .rel_error = 1.0 / 3,
			       .rounds = 12,
			       .mutations = 1u << 31};
	struct job_record back;
	strcpy(r.name, "gr\xc3\xbcn \"quoted\"");
	strcpy(r.state, "done");
	strcpy(r.reason, "time");
	strcpy(r.output, "a b.exr");
	strcpy(r.mixture, "independent=0.1,hslt=0.9");
	strcpy(r.note, "3 of 8 \"times\"");
	strcpy(r.rel_error_doubt, "the chains are too short to be judged");
	record_take_effects(
		&r, json_pack("[{s:s s:b s:s}]", "name", "dispersion", "on", 0, "why", "`glass` has constant eta"));
	r.stuck = 3;
	r.longest_stuck = 5210;
	for (uint64_t i = 0; i < 2 * STRATEGY_COUNTERS; i++)
		r.strategy[i / STRATEGY_COUNTERS][i % STRATEGY_COUNTERS] = i * i;
	record_begin_convergence(&r);
	r.agreement = (struct convergence){
		CHAINS_DISAGREE,      12, 3, 0.125, 1.01, 2.5, 64, 128, 1U << 7 | 1, 1U << 19 | 2, 0.25,
		"chains \"disagree\""};
	r.b = 1.0 / 7;
	r.classes[7] = (struct path_class_energy){0.1, 0.01, 0.2, 0.02, -12.5};
	r.classes[0] = (struct path_class_energy){0.3, NAN, 0.4, NAN, NAN};
	r.target_error = 0.02;
	r.cpu_seconds = 100.0 / 3;
	r.bootstrap_cpu_seconds = 1.0 / 3;
	r.bootstrap_seconds = 0.25;
	for (int i = 1; i < 200; i++)
		forecast_add_look(&r.looks,
				  &(struct forecast_look){1e5 * i, 0.1 * i, 0.05 * i, 0.3 / i, 0.4 / i, 20, 0});
	assert_int_equal(spool_open(&s, folder, &e), 0);
	assert_int_equal(spool_take_job(s, 7, &e), 0);
	assert_int_equal(spool_write_record(s, &r, &e), 0);
	assert_int_equal(spool_read_record(s, 7, &back, &e), 0);
	assert_string_equal(back.name, r.name);
	assert_string_equal(back.output, r.output);
	assert_true(back.rel_error == r.rel_error && back.progress == r.progress && back.ended == r.ended);
	assert_true(back.target_error == r.target_error && back.cpu_seconds == r.cpu_seconds);
	assert_true(back.bootstrap_cpu_seconds == r.bootstrap_cpu_seconds &&
		    back.bootstrap_seconds == r.bootstrap_seconds);
	assert_memory_equal(&back.looks, &r.looks, sizeof r.looks);
	assert_true(back.rounds == 12 && back.mutations == 1u << 31 && back.priority == -3 && back.exit_code == 4);
	assert_true(back.has_result && record_is_ended(&back));
	assert_string_equal(back.mixture, r.mixture);
	assert_string_equal(back.note, r.note);
	assert_string_equal(back.rel_error_doubt, r.rel_error_doubt);
	assert_true(*r.effects != 0);
	assert_string_equal(back.effects, r.effects);
	assert_true(back.stuck == 3 && back.longest_stuck == 5210);
	assert_memory_equal(back.strategy, r.strategy, sizeof r.strategy);
	const struct convergence *a = &back.agreement;
	assert_true(a->verdict == CHAINS_DISAGREE && a->tiles == 12 && a->tiles_flagged == 3 &&
		    a->energy_flagged == 0.125);
	assert_true(a->r_hat_median == 1.01 && a->r_hat_worst == 2.5 && a->worst_x == 64 && a->worst_y == 128);
	assert_true(a->classes_flagged == r.agreement.classes_flagged &&
		    a->classes_apart == r.agreement.classes_apart && a->stuck_share == 0.25 && back.b == r.b);
	assert_string_equal(a->text, r.agreement.text);
	assert_memory_equal(&back.classes[7], &r.classes[7], sizeof *r.classes);
	assert_true(back.classes[0].chains == 0.4 && isnan(back.classes[0].difference_t) &&
		    isnan(back.classes[0].chains_error));
	assert_true(back.classes[1].chains == 0 && isnan(back.classes[1].difference_t));
	strcpy(r.output, "caf\xe9"); /* no memory is missing */
	assert_int_equal(spool_write_record(s, &r, &e), -EINVAL);
	assert_non_null(strstr(e.text, "the record of job j7 cannot be written: Invalid UTF-8"));
	/* Of an earlier version, and of a hand that wrote too much. */
	static const char old[] = "{\"schema\":1,\"id\":7,\"name\":\"a\"}",
			  many[] = "{\"schema\":1,\"id\":7,\"mixture\":\"a,,b\",\"strategies\":7}";
	assert_int_equal(spool_write(s, 7, "job.json", old, sizeof old - 1, &e), 0);
	assert_int_equal(spool_read_record(s, 7, &back, &e), 0);
	assert_true(*back.mixture == 0 && *back.note == 0 && back.stuck == 0);
	assert_true(back.agreement.verdict == CHAINS_AGREE && isnan(back.agreement.r_hat_worst) && back.b == 0);
	assert_int_equal(spool_write(s, 7, "job.json", many, sizeof many - 1, &e), 0);
	assert_int_equal(spool_read_record(s, 7, &back, &e), 0);
	assert_true(*back.mixture == 0);
	assert_int_equal(spool_read_record(s, 8, &back, &e), -ENOENT);
	assert_int_equal(spool_write(s, 7, "job.json", "{}", 2, &e), 0);
	assert_int_equal(spool_read_record(s, 7, &back, &e), -EBADMSG);
	assert_int_equal(spool_write(s, 7, "job.json", "{\"schema\":2}", 12, &e), 0);
	assert_int_equal(spool_read_record(s, 7, &back, &e), -EPROTO);
	assert_non_null(strstr(e.text, "version 2"));
	assert_int_equal(spool_write(s, 7, "job.json", "[", 1, &e), 0);
	assert_int_equal(spool_read_record(s, 7, &back, &e), -EBADMSG);
	spool_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(one_master, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(ids_are_never_given_twice, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(records_come_back, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
