/* What hslt-submit sends: the bytes that it read when it checked the scene, from below the scene's folder, or nothing. */
#include "coordinator/shell/server.h"
#include "tests/support/folder.h"
#include "worker/cli/submit.h"

#include "common/base/log.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

static char scene[96], mesh[128], secret[96], kept[96], address[32];
static pid_t pid;

static void serve(const char *spool, const char *port_file)
{
	struct server_config c;
	struct error e;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = spool;
	c.port_file = port_file;
	log_set_level(LOG_LEVEL_ERROR);
	_exit(server_run(&c, &e) ? 1 : 0);
}

static int set_up(void **state)
{
	char spool[96], port_file[96], command[512];
	unsigned port = 0;
	if (folder_set_up(state))
		return -1;
	snprintf(spool, sizeof spool, "%s/spool", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	snprintf(scene, sizeof scene, "%s/box/box.xml", folder);
	snprintf(mesh, sizeof mesh, "%s/box/meshes/wedge.obj", folder);
	snprintf(secret, sizeof secret, "%s/secret", folder);
	snprintf(kept, sizeof kept, "%s/kept", folder);
	snprintf(command, sizeof command, "cp -r tests/scenes/box '%s' && sed s/1/2/ '%s' >'%s'", folder, mesh, secret);
	fflush(NULL);
	pid = fork();
	if (pid == 0)
		serve(spool, port_file);
	for (int i = 0; i < 5000 && !port; i++) {
		FILE *f = fopen(port_file, "r");
		if (f && fscanf(f, "%u", &port) != 1)
			port = 0;
		if (f)
			fclose(f);
		usleep(1000);
	}
	snprintf(address, sizeof address, "127.0.0.1:%u", port);
	return port ? system(command) : -1;
}

static int tear_down(void **state)
{
	int status = -1;
	kill(pid, SIGTERM);
	waitpid(pid, &status, 0);
	return folder_tear_down(state) || !WIFEXITED(status) || WEXITSTATUS(status);
}

/* The error, "" when it was taken. */
static const char *sent(const struct scene_bundle *b)
{
	static struct render_arguments args;
	static struct error e;
	char text[PLAN_TEXT];
	struct client *cl;
	uint64_t job = 0;
	struct submit_request r = {.name = "box", .output = "", .args = &args};
	args.plan = (struct plan_request){.integrator = "path", .width = 48, .height = 40, .spp = 1, .max_depth = 4};
	assert_int_equal(client_open(&cl, address, NULL, false, "test", &e), 0);
	int rc = submit_send(cl, &r, b, &job, text, sizeof text, &e);
	client_close(cl);
	if (!rc)
		e.text[0] = 0;
	assert_true((rc == 0) == (job != 0));
	return e.text;
}

static void says(const struct scene_bundle *b, const char *text)
{
	const char *said = sent(b);
	if (!strstr(said, text))
		fail_msg("'%s' is not in '%s'", text, said);
}

static void what_was_checked_is_sent(void **state)
{
	(void)state;
	struct scene_bundle b;
	struct render_options o = {.max_depth = 4};
	struct error e;
	assert_int_equal(scene_bundle_read(&b, scene, NULL, 0, &o, &e), 0);
	assert_int_equal(b.count, 2);
	assert_string_equal(b.files[0].name, "box.xml");
	assert_string_equal(b.files[1].name, "meshes/wedge.obj");
	assert_int_equal(rename(mesh, kept), 0);
	assert_int_equal(symlink(secret, mesh), 0);
	says(&b, "meshes/wedge.obj: leads out of the scene's folder");
	assert_int_equal(unlink(mesh), 0);
	assert_int_equal(rename(secret, mesh), 0);
	says(&b, "meshes/wedge.obj: it has changed meanwhile");
	assert_int_equal(rename(kept, mesh), 0);
	assert_string_equal(sent(&b), "");
	scene_bundle_fini(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(what_was_checked_is_sent)};
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
