/* SPDX-License-Identifier: Apache-2.0 */
/* hslt-submit sends exactly the bytes that it read when it checked the scene, from below the scene's folder, or
 * nothing; and it waits for the job that it submitted, and for no other. */
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/memory_assets.h"
#include "tests/support/scripted_peer.h"
#include "worker/cli/submit/reconnect.h"
#include "worker/render/render.h"

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
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char scene[96], mesh[128], secret[96], kept_mesh[96], address[32];
static pid_t pid;
static const struct output_files no_outputs; /* no output could replace an input */

static void run_server(const char *listen, const char *spool, const char *port_file)
{
	struct server_config c;
	struct error e;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	server_config_init(&c);
	c.listen_address = listen;
	c.spool_folder = spool;
	c.port_file = port_file;
	log_set_level(LOG_LEVEL_ERROR);
	_exit(server_run(&c, &e) ? 1 : 0);
}

/* Starts a coordinator and waits until it listens. */
static int start_coordinator(const char *listen, const char *spool_name)
{
	char spool[96], port_file[96];
	snprintf(spool, sizeof spool, "%s/%s", temporary_folder, spool_name);
	snprintf(port_file, sizeof port_file, "%s/port", temporary_folder);
	remove(port_file);
	fflush(NULL);
	pid = fork();
	if (pid == 0)
		run_server(listen, spool, port_file);
	uint16_t port = scripted_peer_read_port(port_file);
	snprintf(address, sizeof address, "127.0.0.1:%u", port);
	return port ? 0 : -1;
}

static int stop_coordinator(void)
{
	int status = -1;
	kill(pid, SIGTERM);
	waitpid(pid, &status, 0);
	return !WIFEXITED(status) || WEXITSTATUS(status);
}

static int set_up(void **state)
{
	char command[512];
	if (temporary_folder_set_up(state))
		return -1;
	snprintf(scene, sizeof scene, "%s/box/box.xml", temporary_folder);
	snprintf(mesh, sizeof mesh, "%s/box/meshes/wedge.obj", temporary_folder);
	snprintf(secret, sizeof secret, "%s/secret", temporary_folder);
	snprintf(kept_mesh, sizeof kept_mesh, "%s/kept", temporary_folder);
	snprintf(command, sizeof command, "cp -r tests/scenes/box '%s' && sed s/1/2/ '%s' >'%s'", temporary_folder,
		 mesh, secret);
	return start_coordinator("127.0.0.1:0", "spool") || system(command);
}

static int tear_down(void **state)
{
	return stop_coordinator() | temporary_folder_tear_down(state);
}

static struct client *connect_client(void)
{
	struct client *cl;
	struct error e;
	assert_int_equal(client_open(&cl, address, NULL, false, "test", &e), 0);
	return cl;
}

static int send_submission(struct client *cl, const struct scene_files *b, struct submitted_job *job, struct error *e)
{
	static struct render_arguments args;
	char text[PLAN_TEXT_MAX];
	struct submit_request r = {.name = "box", .output = "", .args = &args};
	args.plan = (struct plan_request){.integrator = "path", .width = 48, .height = 40, .spp = 1, .max_depth = 4};
	return submit_send(cl, &r, b, job, text, sizeof text, e);
}

/* Returns the error of submitting these files, or "" if the job was accepted. */
static const char *submit_error(const struct scene_files *b)
{
	static struct error e;
	struct submitted_job job = {0};
	struct client *cl = connect_client();
	int rc = send_submission(cl, b, &job, &e);
	client_close(cl);
	if (!rc)
		e.text[0] = 0;
	assert_true((rc == 0) == (job.job != 0));
	return e.text;
}

static void expect_error(const struct scene_files *b, const char *text)
{
	const char *message = submit_error(b);
	if (!strstr(message, text))
		fail_msg("'%s' is not in '%s'", text, message);
}

static void only_checked_bytes_are_sent(void **state)
{
	(void)state;
	struct scene_files b;
	static struct render_arguments o; /* too large for the stack */
	o.render.max_depth = 4;
	struct error e;
	assert_int_equal(scene_files_read(&b, scene, &o, &no_outputs, &e), 0);
	assert_int_equal(b.file_count, 2);
	assert_string_equal(b.files[0].name, "box.xml");
	assert_string_equal(b.files[1].name, "meshes/wedge.obj");
	assert_int_equal(rename(mesh, kept_mesh), 0);
	assert_int_equal(symlink(secret, mesh), 0);
	expect_error(&b, "meshes/wedge.obj: leads out of the scene's folder");
	assert_int_equal(unlink(mesh), 0);
	assert_int_equal(rename(secret, mesh), 0);
	expect_error(&b, "meshes/wedge.obj has changed meanwhile");
	assert_int_equal(rename(kept_mesh, mesh), 0);
	assert_string_equal(submit_error(&b), "");
	scene_files_fini(&b);
}

/* Meshes in a library folder beside the scene's folder (--path) are sent under the same name. */
static void files_in_search_folders_are_sent(void **state)
{
	(void)state;
	struct scene_files b;
	static struct render_arguments o; /* too large for the stack */
	struct error e;
	char library[256], moved[300];
	snprintf(library, sizeof library, "%s/library", temporary_folder);
	snprintf(moved, sizeof moved, "%s/meshes", library);
	assert_int_equal(mkdir(library, 0700), 0);
	assert_int_equal(mkdir(moved, 0700), 0);
	snprintf(moved, sizeof moved, "%s/meshes/wedge.obj", library);
	assert_int_equal(rename(mesh, moved), 0);
	o.render.max_depth = 4;
	assert_int_equal(scene_files_read(&b, scene, &o, &no_outputs, &e), -ENOENT);
	o.paths[o.path_count++] = library;
	assert_int_equal(scene_files_read(&b, scene, &o, &no_outputs, &e), 0);
	assert_int_equal(b.file_count, 2);
	assert_string_equal(b.files[1].name, "meshes/wedge.obj");
	assert_string_equal(submit_error(&b), "");
	scene_files_fini(&b);
	assert_int_equal(rename(moved, mesh), 0);
}

static void write_file(const char *name, const char *text)
{
	char path[256];
	snprintf(path, sizeof path, "%s/nested/%s", temporary_folder, name);
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	assert_true(fputs(text, f) >= 0);
	assert_int_equal(fclose(f), 0);
}

static const char *object_type(const struct scene *s, const char *id)
{
	for (uint32_t i = 0; i < s->object_count; i++)
		if (s->objects[i]->id && strcmp(s->objects[i]->id, id) == 0)
			return s->objects[i]->type;
	return "";
}

static bool has_file(const struct scene_files *b, const char *name)
{
	for (size_t i = 0; i < b->file_count; i++)
		if (strcmp(b->files[i].name, name) == 0)
			return true;
	return false;
}

#define SCENE_TEXT(x) "<scene version='3.0.0'>" x "</scene>"

/* Files named by included files lie in the folder of the included file, or in that of the scene. They are sent under
 * names by which a worker, which has only the sent files, finds them. */
static void files_of_included_files_are_sent(void **state)
{
	(void)state;
	char path[256];
	static const char *const folders[] = {"", "/parts", "/parts/deep"};
	for (int i = 0; i < 3; i++) {
		snprintf(path, sizeof path, "%s/nested%s", temporary_folder, folders[i]);
		assert_int_equal(mkdir(path, 0700), 0);
	}
	write_file("s.xml",
		   SCENE_TEXT("<include filename='parts/a.xml'/><shape type='sphere'/><emitter type='constant'/>"));
	write_file("parts/a.xml", SCENE_TEXT("<include filename='deep/b.xml'/><include filename='own.xml'/>"));
	write_file("parts/deep/b.xml", SCENE_TEXT("<include filename='both.xml'/><include filename='../up.xml'/>"
						  "<bsdf type='conductor'><spectrum name='eta' filename='eta.spd'/>"
						  "<float name='k' value='1'/></bsdf>"));
	write_file("parts/deep/both.xml", SCENE_TEXT("<bsdf type='conductor' id='both'/>"));
	write_file("parts/both.xml", SCENE_TEXT("<bsdf type='plastic' id='both'/>"));
	write_file("both.xml", SCENE_TEXT("<bsdf type='diffuse' id='both'/>"));
	write_file("parts/up.xml", SCENE_TEXT("<bsdf type='conductor' id='up'/>"));
	write_file("parts/eta.spd", "400 1\n700 2\n"); /* in the folder of the including file */
	write_file("own.xml", SCENE_TEXT("<bsdf type='diffuse' id='own'/>"));
	static const char *const sent_names[] = {
		"s.xml",	 "own.xml",	"parts/a.xml", "parts/deep/b.xml", "parts/deep/both.xml",
		"parts/eta.spd", "parts/up.xml"};
	enum { SENT = sizeof sent_names / sizeof *sent_names };
	struct scene_files b;
	static struct render_arguments o; /* too large for the stack */
	struct error e;
	o.render.max_depth = 4;
	snprintf(path, sizeof path, "%s/nested/s.xml", temporary_folder);
	if (scene_files_read(&b, path, &o, &(struct output_files){0}, &e))
		fail_msg("%s", e.text);
	struct memory_file files[SENT + 1] = {{0}};
	char *bytes[SENT];
	assert_int_equal(b.file_count, SENT);
	for (size_t i = 0; i < SENT; i++) {
		assert_true(has_file(&b, sent_names[i]));
		snprintf(path, sizeof path, "%s/nested/%s", temporary_folder, sent_names[i]);
		FILE *f = fopen(path, "r");
		assert_non_null(f);
		bytes[i] = calloc(1, 1024);
		files[i] = (struct memory_file){sent_names[i], bytes[i], fread(bytes[i], 1, 1023, f)};
		assert_int_equal(fclose(f), 0);
	}
	scene_files_fini(&b);
	struct scene s;
	struct asset_source store = memory_assets(files);
	if (scene_read(&s, &store, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	assert_string_equal(object_type(&s, "both"), "conductor");
	assert_string_equal(object_type(&s, "up"), "conductor");
	assert_string_equal(object_type(&s, "own"), "diffuse");
	assert_int_equal(s.asset_count, SENT - 1);
	/* An existing file outside the scene's folder must not be read. */
	write_file("parts/own.xml", SCENE_TEXT("<include filename='../../box/box.xml'/>"));
	snprintf(path, sizeof path, "%s/nested/s.xml", temporary_folder);
	assert_int_equal(scene_files_read(&b, path, &o, &(struct output_files){0}, &e), -EINVAL);
	assert_non_null(strstr(e.text, "../box/box.xml: leads out of the scene's folder"));
	scene_fini(&s);
	for (size_t i = 0; i < SENT; i++)
		free(bytes[i]);
}

static void cancel_job(uint64_t job)
{
	Farm__Cancel question;
	Farm__Envelope m;
	struct client_message answer;
	struct client *cl = connect_client();
	struct error e;
	farm__cancel__init(&question);
	farm__envelope__init(&m);
	question.job = job;
	m.body_case = FARM__ENVELOPE__BODY_CANCEL;
	m.cancel = &question;
	assert_int_equal(client_call(cl, &m, FARM__ENVELOPE__BODY_DONE, &answer, &e), 0);
	assert_true(answer.envelope.message->done->ok);
	client_message_fini(&answer);
	client_close(cl);
}

static int wait_for_job(struct client **cl, const struct submitted_job *job, struct submit_outcome *end,
			struct error *e)
{
	char output[96];
	snprintf(output, sizeof output, "%s/image.exr", temporary_folder);
	return reconnect_job(cl, &(struct reconnect){.coordinator = address, .patience_seconds = 60}, job, output, end,
			     e);
}

/* The coordinator restarts, with its own spool or with another one, in which the job's number belongs to another job.
 */
static void only_the_submitted_job_is_waited_for(void **state)
{
	(void)state;
	struct scene_files b;
	static struct render_arguments o; /* too large for the stack */
	o.render.max_depth = 4;
	struct submit_outcome end;
	struct submitted_job job, other;
	struct error e;
	char same[32];
	assert_int_equal(scene_files_read(&b, scene, &o, &no_outputs, &e), 0);
	struct client *cl = connect_client(), *later = connect_client();
	assert_int_equal(send_submission(cl, &b, &job, &e), 0);
	snprintf(same, sizeof same, "%s", address);
	assert_int_equal(stop_coordinator(), 0);
	assert_int_equal(start_coordinator(same, "spool"), 0);
	cancel_job(job.job);
	assert_int_equal(wait_for_job(&cl, &job, &end, &e), 0);
	assert_int_equal(end.exit_code, 3);
	assert_string_equal(end.state, "cancelled");
	assert_int_equal(stop_coordinator(), 0);
	assert_int_equal(start_coordinator(same, "other"), 0);
	do {
		struct client *guest = connect_client();
		assert_int_equal(send_submission(guest, &b, &other, &e), 0);
		client_close(guest);
		cancel_job(other.job);
	} while (other.job < job.job);
	assert_int_equal(other.job, job.job);
	assert_int_equal(wait_for_job(&later, &job, &end, &e), -ESTALE);
	assert_non_null(strstr(e.text, "is another job now"));
	assert_int_equal(client_exit_code(-ESTALE), 1);
	client_close(cl);
	client_close(later);
	scene_files_fini(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(only_checked_bytes_are_sent),
					   cmocka_unit_test(files_in_search_folders_are_sent),
					   cmocka_unit_test(files_of_included_files_are_sent),
					   cmocka_unit_test(only_the_submitted_job_is_waited_for)};
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
