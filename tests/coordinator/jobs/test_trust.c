/* SPDX-License-Identifier: Apache-2.0 */
/* The quarantine survives a restart, however long the list has become; a damaged list does not stop the farm. */
#include "common/base/mem.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/ledger_files.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>

static char *path_in_spool(const char *name)
{
	static char text[128];
	snprintf(text, sizeof text, "%s/spool/%s", temporary_folder, name);
	return text;
}

static struct server *start_server(void)
{
	static char spool[80];
	struct server_config c;
	struct server *s = NULL;
	struct error e = {""};
	snprintf(spool, sizeof spool, "%s/spool", temporary_folder);
	server_config_init(&c);
	c.listen_address = "127.0.0.1:0";
	c.spool_folder = spool;
	int saved_stderr = dup(2),
	    null_file = open("/dev/null", O_WRONLY); /* one line is logged for each quarantined worker */
	dup2(null_file, 2);
	int rc = server_open(&s, &c, &e);
	dup2(saved_stderr, 2);
	close(null_file);
	close(saved_stderr);
	if (rc)
		fail_msg("%s", e.text);
	return s;
}

static FILE *create_old_list(void)
{
	char spool[80];
	snprintf(spool, sizeof spool, "%s/spool", temporary_folder);
	assert_int_equal(mkdir(spool, 0700), 0);
	FILE *f = fopen(path_in_spool("aside"), "w");
	assert_non_null(f);
	return f;
}

/* A list far longer than 64 KB, as an earlier version could leave it. The last 64 names of one certificate are
 * remembered, and no name of another certificate is forgotten for them. */
static void long_list_is_remembered(void **state)
{
	(void)state;
	FILE *f = create_old_list();
	fputs("{\"schema\":1,\"workers\":[{\"certificate\":\"b\",\"name\":\"first\",\"home\":\"h\",\"restarts\":2,\"why\":\"torn\"}",
	      f);
	for (int i = 0; i < 200; i++)
		fprintf(f,
			",{\"certificate\":\"a\",\"name\":\"%0100d\",\"home\":\"%d\",\"restarts\":1,\"why\":\"%0250d\"}",
			i, i, i);
	fputs("]}", f);
	assert_true(ftell(f) > 1 << 16);
	assert_int_equal(fclose(f), 0);
	struct server *s = start_server();
	struct worker_status w;
	int count = 0, last = 0;
	for (uint64_t who = 0; (who = farm_next_quarantined(s->jobs.farm, who)); count++) {
		assert_true(farm_worker_status(s->jobs.farm, who, &w));
		if (count == 0)
			assert_true(strcmp(w.certificate, "b") == 0 && strcmp(w.name, "first") == 0 &&
				    strcmp(w.last_fault, "torn") == 0);
		else
			assert_int_equal(sscanf(w.home, "%d", &last), 1);
	}
	assert_int_equal(count, 65);
	assert_int_equal(last, 199);
	server_close(s);
}

static void damaged_list_does_not_stop_the_start(void **state)
{
	(void)state;
	FILE *f = create_old_list();
	fputs("{\"schema\":1,\"workers\":[{\"cert", f);
	assert_int_equal(fclose(f), 0);
	for (int i = 0; i < 2; i++) { /* also as the first start left the list */
		struct server *s = start_server();
		struct error e;
		char *text;
		assert_int_equal(farm_next_quarantined(s->jobs.farm, 0), 0);
		assert_int_equal(ledger_get_note(s->jobs.ledger, "quarantined-damaged", &text, &e), 0);
		assert_string_equal(text, "{\"schema\":1,\"workers\":[{\"cert");
		mem_free(text);
		server_close(s);
	}
	assert_int_equal(access(path_in_spool("aside"), F_OK), -1);
}

/* One name has been changed in both files: the coordinator does not guess the original. Changed in one file, it is
 * restored from the other. */
static void list_changed_in_one_file_is_restored(void **state)
{
	(void)state;
	static const char *const files[] = {"spool/jobs.db", "spool/jobs-copy.db"};
	static const char change[] =
		"UPDATE notes SET text = replace(text, 'anna', 'hanna') WHERE name = 'quarantined'";
	struct worker_status w;
	FILE *f = create_old_list();
	fputs("{\"schema\":1,\"workers\":[{\"certificate\":\"c\",\"name\":\"anna\",\"home\":\"h\",\"restarts\":1,"
	      "\"why\":\"torn\"}]}",
	      f);
	assert_int_equal(fclose(f), 0);
	for (int changed = 0; changed < 3; changed++) {
		for (int i = 0; i < changed; i++)
			ledger_files_execute(files[i], change);
		struct server *s = start_server();
		uint64_t who = farm_next_quarantined(s->jobs.farm, 0);
		assert_true((changed == 2) == !who);
		assert_true(!who || (farm_worker_status(s->jobs.farm, who, &w) && strcmp(w.name, "anna") == 0));
		server_close(s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(long_list_is_remembered, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(damaged_list_does_not_stop_the_start, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(list_changed_in_one_file_is_restored, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
