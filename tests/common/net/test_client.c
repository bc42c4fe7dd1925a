/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The client against a small malicious coordinator: names of files that lead elsewhere, and more data than was asked
 * for.
 */
#include "common/base/mem.h"
#include "common/net/client.h"
#include "common/wire/frame.h"
#include "tests/support/checksummed_frame.h"
#include "tests/support/failing_memory.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[64];
static const unsigned char image[] = "the image";

/* ---- a coordinator: takes one connection, says hello, then what the test prescribes ---- */

struct coordinator {
	pthread_t thread;
	int listener;
	char address[32];
	const char *host;    /* the client connects to this name; NULL: 127.0.0.1 */
	const char *name;    /* the name of the result in the answer to Fetch */
	uint64_t sizes[2];   /* size of the file in the first and second answer */
	bool answers_once;   /* stops answering after the first answer */
	int dropped_fetches; /* number of fetches that are dropped */
	/* Number and payload of unrequested messages, sent before the coordinator reads on. */
	size_t flood_count, flood_payload;
	atomic_bool is_flood_held; /* delays the flood */
	atomic_bool is_deaf;	   /* the coordinator does not read while this is set */
	atomic_bool is_flood_sent;
};

/* ---- a file system ---- */

static bool is_plain_file_system; /* a file system without hard links and without renames that refuse to replace */

int __real_link(const char *from, const char *to);
int __wrap_link(const char *from, const char *to);
int __real_renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags);
int __wrap_renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags);

int __wrap_link(const char *from, const char *to)
{
	errno = EPERM;
	return is_plain_file_system ? -1 : __real_link(from, to);
}

int __wrap_renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags)
{
	errno = EINVAL;
	return is_plain_file_system ? -1 : __real_renameat2(from_folder, from, to_folder, to, flags);
}

/* ---- a name server ---- */

int __real_getaddrinfo(const char *host, const char *port, const struct addrinfo *hints, struct addrinfo **found);
int __wrap_getaddrinfo(const char *host, const char *port, const struct addrinfo *hints, struct addrinfo **found);

/* No server listens at the first address of "two". */
int __wrap_getaddrinfo(const char *host, const char *port, const struct addrinfo *hints, struct addrinfo **found)
{
	if (strcmp(host, "two") != 0)
		return __real_getaddrinfo(host, port, hints, found);
	int rc = __real_getaddrinfo("127.0.0.2", port, hints, found);
	return rc ? rc : __real_getaddrinfo("127.0.0.1", port, hints, &(*found)->ai_next);
}

/* ---- messages ---- */

static void send_message(int fd, const Farm__Envelope *m, const void *payload, size_t payload_size)
{
	size_t size;
	unsigned char *frame = checksummed_frame_from_message(m, payload, payload_size, &size);
	for (size_t at = 0; at < size;) {
		ssize_t n = send(fd, frame + at, size - at, MSG_NOSIGNAL);
		if (n <= 0)
			break;
		at += (size_t)n;
	}
	free(frame);
}

static void send_hello(int fd)
{
	Farm__HelloAck ack;
	Farm__Envelope m;
	farm__hello_ack__init(&ack);
	farm__envelope__init(&m);
	ack.accepted = true;
	ack.version = FARM_VERSION;
	ack.heartbeat_ms = 5000;
	m.body_case = FARM__ENVELOPE__BODY_HELLO_ACK;
	m.hello_ack = &ack;
	send_message(fd, &m, NULL, 0);
}

static void send_dropped(int fd)
{
	Farm__FetchChunk chunk;
	Farm__Envelope m;
	char text[] = "dropped";
	farm__fetch_chunk__init(&chunk);
	farm__envelope__init(&m);
	chunk.offset = sizeof image;
	chunk.error = text;
	m.body_case = FARM__ENVELOPE__BODY_FETCH_CHUNK;
	m.fetch_chunk = &chunk;
	send_message(fd, &m, NULL, 0);
}

static void send_chunk(int fd, const char *name, uint64_t offset, uint64_t file_size)
{
	Farm__FetchChunk chunk;
	Farm__Envelope m;
	char output[2048];
	farm__fetch_chunk__init(&chunk);
	farm__envelope__init(&m);
	snprintf(output, sizeof output, "%s", name);
	chunk.offset = offset;
	chunk.size = file_size;
	chunk.output = output;
	m.body_case = FARM__ENVELOPE__BODY_FETCH_CHUNK;
	m.fetch_chunk = &chunk;
	send_message(fd, &m, image, sizeof image);
}

static void *run_coordinator(void *user)
{
	struct coordinator *c = user;
	char bytes[4096];
	unsigned char *zeros = calloc(1, c->flood_payload + 1);
	Farm__Done done;
	Farm__Envelope m;
	int fd = accept(c->listener, NULL, NULL);
	farm__done__init(&done);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_DONE;
	m.done = &done;
	if (recv(fd, bytes, sizeof bytes, 0) > 0)
		send_hello(fd);
	while (c->is_flood_held)
		usleep(1000);
	for (size_t i = 0; i < c->flood_count; i++)
		send_message(fd, &m, zeros, c->flood_payload);
	c->is_flood_sent = true;
	while (c->is_deaf)
		usleep(1000);
	if (c->name && recv(fd, bytes, sizeof bytes, 0) > 0)
		send_chunk(fd, c->name, 0, sizeof image);
	for (int i = 0; i < 2 * c->dropped_fetches && recv(fd, bytes, sizeof bytes, 0) > 0; i++)
		if (i % 2)
			send_dropped(fd);
		else
			send_chunk(fd, "", 0, 3 * sizeof image); /* of another image than before */
	for (int i = 0; i < (c->answers_once ? 1 : 2) && c->sizes[0] && recv(fd, bytes, sizeof bytes, 0) > 0; i++)
		send_chunk(fd, "", (uint64_t)i * sizeof image, c->sizes[i]);
	while (recv(fd, bytes, sizeof bytes, 0) > 0)
		continue;
	close(fd);
	free(zeros);
	return NULL;
}

static void start_coordinator(struct coordinator *c)
{
	struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
	socklen_t size = sizeof a;
	c->listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_int_equal(bind(c->listener, (struct sockaddr *)&a, size), 0);
	assert_int_equal(listen(c->listener, 1), 0);
	assert_int_equal(getsockname(c->listener, (struct sockaddr *)&a, &size), 0);
	snprintf(c->address, sizeof c->address, "%s:%u", c->host ? c->host : "127.0.0.1", ntohs(a.sin_port));
	assert_int_equal(pthread_create(&c->thread, NULL, run_coordinator, c), 0);
}

static struct client *connect_client(struct coordinator *c)
{
	struct client *cl;
	struct error e;
	start_coordinator(c);
	assert_int_equal(client_open(&cl, c->address, NULL, false, "test", &e), 0);
	return cl;
}

static void disconnect_client(struct coordinator *c, struct client *cl)
{
	client_close(cl);
	pthread_join(c->thread, NULL);
	close(c->listener);
}

/* ---- names ---- */

static int fetch_under_name(const char *name, char chosen_name[CLIENT_NAME_BYTES])
{
	struct coordinator c = {.name = name};
	struct client *cl = connect_client(&c);
	struct error e;
	int rc = client_fetch_to_current_folder(cl, 1, FARM__WHAT__WHAT_RESULT, chosen_name, &e);
	disconnect_client(&c, cl);
	return rc;
}

static bool file_has_content(const char *path, const void *bytes, size_t size)
{
	char content[64];
	FILE *f = fopen(path, "r");
	bool same = f && fread(content, 1, sizeof content, f) == size && memcmp(content, bytes, size) == 0;
	if (f)
		fclose(f);
	return same;
}

static void write_precious_file(const char *path)
{
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	assert_int_equal(fputs("precious", f) >= 0, 1);
	assert_int_equal(fclose(f), 0);
}

static unsigned count_files(void)
{
	unsigned count = 0;
	FILE *f = popen("ls -A | wc -l", "r");
	assert_non_null(f);
	assert_int_equal(fscanf(f, "%u", &count), 1);
	pclose(f);
	return count;
}

static void check_names_in_folder(const char *subfolder)
{
	char chosen_name[CLIENT_NAME_BYTES], path[128], longest[1024];
	struct stat st;
	write_precious_file("above.exr");
	assert_int_equal(mkdir(subfolder, 0700), 0);
	assert_int_equal(chdir(subfolder), 0);
	/* folders in the name are ignored */
	snprintf(path, sizeof path, "%s/above.exr", folder);
	assert_int_equal(fetch_under_name(path, chosen_name), 0);
	assert_string_equal(chosen_name, "above.exr");
	assert_true(file_has_content("above.exr", image, sizeof image) && file_has_content(path, "precious", 8));
	assert_int_equal(fetch_under_name("../room.exr", chosen_name), 0);
	assert_true(file_has_content("room.exr", image, sizeof image));
	assert_int_not_equal(stat("../room.exr", &st), 0);
	assert_int_equal(fetch_under_name("\xc3\xa4 b.exr", chosen_name), 0);
	/* names that no file can have, or that other programs look for */
	memset(longest, 'x', sizeof longest - 1);
	longest[sizeof longest - 1] = 0;
	const char *const bad[] = {"",	      ".",   "..",   "/",    "a/",	  "../..",    "/home/.profile",
				   ".bashrc", "-rf", "a/-o", "a\nb", "a\x1b[2Jb", "\xff\xfe", longest};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_int_equal(fetch_under_name(bad[i], chosen_name), -EEXIST);
	/* existing entries stay: files, links that lead nowhere, links that lead to files */
	write_precious_file("mine.exr");
	assert_int_equal(symlink("../nobody.exr", "link.exr"), 0);
	assert_int_equal(symlink("../above.exr", "other.exr"), 0);
	assert_int_equal(fetch_under_name("/tmp/mine.exr", chosen_name), -EEXIST);
	assert_int_equal(fetch_under_name("link.exr", chosen_name), -EEXIST);
	assert_int_equal(fetch_under_name("other.exr", chosen_name), -EEXIST);
	assert_true(file_has_content("mine.exr", "precious", 8) && file_has_content("../above.exr", "precious", 8));
	assert_int_not_equal(stat("../nobody.exr", &st), 0);
	assert_int_equal(count_files(), 6); /* and no temporary file */
	assert_int_equal(chdir(".."), 0);
}

static void file_names_cannot_leave_the_folder(void **state)
{
	(void)state;
	check_names_in_folder("here");
	is_plain_file_system = true;
	check_names_in_folder("there");
	is_plain_file_system = false;
}

/* The image's name stays free until the image is done, and a preview replaces no existing file either. */
static void preview_leaves_the_final_name_free(void **state)
{
	(void)state;
	static const char *const names[][2] = {
		{"/home/ann/soon.exr", "soon.preview.exr"}, {"plain", "plain.preview"}, {"a.b.exr", "a.b.preview.exr"}};
	char chosen_name[CLIENT_NAME_BYTES], longest[CLIENT_NAME_BYTES];
	struct error e;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		for (int second = 0; second < 2; second++) {
			struct coordinator c = {.name = names[i][0]};
			struct client *cl = connect_client(&c);
			int rc = client_fetch_to_current_folder(cl, 1, FARM__WHAT__WHAT_PREVIEW, chosen_name, &e);
			disconnect_client(&c, cl);
			assert_int_equal(rc, second ? -EEXIST : 0);
			assert_string_equal(chosen_name, names[i][1]);
			assert_true(file_has_content(chosen_name, image, sizeof image));
		}
	assert_int_not_equal(access("soon.exr", F_OK), 0);
	/* the longest name leaves no room for the addition */
	memset(longest, 'x', sizeof longest - 1);
	longest[sizeof longest - 1] = 0;
	struct coordinator c = {.name = longest};
	struct client *cl = connect_client(&c);
	assert_int_equal(client_fetch_to_current_folder(cl, 1, FARM__WHAT__WHAT_PREVIEW, chosen_name, &e), -EEXIST);
	disconnect_client(&c, cl);
}

static void named_output_file_is_replaced(void **state)
{
	(void)state;
	struct coordinator c = {.name = "/etc/passwd"};
	struct error e;
	write_precious_file("old.exr");
	struct client *cl = connect_client(&c);
	assert_int_equal(client_fetch(cl, 1, FARM__WHAT__WHAT_RESULT, "old.exr", &e), 0);
	disconnect_client(&c, cl);
	assert_true(file_has_content("old.exr", image, sizeof image));
}

/* Also if the preview's name is given, or leads to the final name by a link: the final name is for the image. */
static void preview_never_takes_the_final_name(void **state)
{
	(void)state;
	static const struct {
		const char *path, *file;
		bool kept;
	} rows[] = {{"final.exr", "final.preview.exr", true},
		    {"./final.exr", "./final.preview.exr", true},
		    {"to-final.exr", "to-final.preview.exr", true},
		    {"finals/final.exr", "finals/final.preview.exr", true},
		    {"another.exr", "another.exr", false}};
	struct error e;
	write_precious_file("final.exr");
	assert_int_equal(symlink("final.exr", "to-final.exr"), 0);
	assert_int_equal(mkdir("finals", 0700), 0);
	assert_int_equal(symlink("../another.exr", "finals/final.exr"), 0);
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		struct coordinator c = {.name = "/home/ann/final.exr"};
		struct client *cl = connect_client(&c);
		bool kept = !rows[i].kept;
		int rc = client_fetch_preview(cl, 1, rows[i].path, &kept, &e);
		disconnect_client(&c, cl);
		assert_int_equal(rc, 0);
		assert_int_equal(kept, rows[i].kept);
		assert_true(file_has_content(rows[i].file, image, sizeof image));
		assert_false(file_has_content("final.exr", image, sizeof image));
	}
}

/* The preview's own name may also be a link to the final name. */
static void preview_does_not_follow_a_link_to_the_final_name(void **state)
{
	(void)state;
	struct coordinator c = {.name = "linked.exr"};
	struct error e;
	bool kept;
	write_precious_file("linked.exr");
	assert_int_equal(symlink("linked.exr", "linked.preview.exr"), 0);
	struct client *cl = connect_client(&c);
	int rc = client_fetch_preview(cl, 1, "linked.exr", &kept, &e);
	disconnect_client(&c, cl);
	assert_int_equal(rc, -EEXIST);
	assert_string_equal(e.text, "linked.preview.exr: leads to linked.exr, which is for the final image");
	assert_false(file_has_content("linked.exr", image, sizeof image));
}

static void file_whose_size_changes_fails_the_fetch(void **state)
{
	(void)state;
	static const uint64_t sizes[] = {3 * sizeof image, 2 * sizeof image - 1, 2 * sizeof image};
	for (size_t i = 0; i < 3; i++) {
		struct coordinator c = {.sizes = {2 * sizeof image, sizes[i]}};
		struct client *cl = connect_client(&c);
		struct error e;
		int rc = client_fetch(cl, 1, FARM__WHAT__WHAT_RESULT, "two.exr", &e);
		disconnect_client(&c, cl);
		assert_int_equal(rc == 0, i == 2);
		assert_int_equal(access("two.exr", F_OK) == 0, i == 2);
	}
}

/* Returns the signal that ends a process in the middle of a fetch. */
static int signal_ending_a_fetch(int number, void (*handling)(int))
{
	struct coordinator c = {.sizes = {2 * sizeof image}, .answers_once = true};
	int status;
	start_coordinator(&c);
	pid_t p = fork();
	assert_true(p >= 0);
	if (p == 0) {
		struct client *cl;
		struct error e;
		signal(number, handling);
		if (!client_open(&cl, c.address, NULL, false, "test", &e))
			client_fetch(cl, 1, FARM__WHAT__WHAT_RESULT, "cut.exr", &e);
		_exit(1);
	}
	while (system("ls cut.exr.* >/dev/null 2>&1") != 0)
		usleep(10000);
	kill(p, number);
	if (handling == SIG_IGN)
		kill(p, SIGTERM);
	assert_int_equal(waitpid(p, &status, 0), p);
	pthread_join(c.thread, NULL);
	close(c.listener);
	assert_true(WIFSIGNALED(status));
	return WTERMSIG(status);
}

static void signal_leaves_no_temporary_file(void **state)
{
	(void)state;
	static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
	unsigned before = count_files();
	for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
		assert_int_equal(signal_ending_a_fetch(numbers[i], SIG_DFL), numbers[i]);
		assert_int_equal(count_files(), before);
	}
	assert_int_equal(signal_ending_a_fetch(SIGHUP, SIG_IGN), SIGTERM); /* as under nohup */
	assert_int_equal(count_files(), before);
}

static void dropped_fetch_is_retried(void **state)
{
	(void)state;
	static const char twice[] = "the image\0the image";
	for (int drops = 1; drops <= 5; drops += 2) {
		struct coordinator c = {.dropped_fetches = drops, .sizes = {2 * sizeof image, 2 * sizeof image}};
		struct client *cl = connect_client(&c);
		struct error e;
		int rc = client_fetch(cl, 1, FARM__WHAT__WHAT_RESULT, "dropped.exr", &e);
		disconnect_client(&c, cl);
		assert_int_equal(rc, drops < 5 ? 0 : -EAGAIN);
		if (rc)
			assert_string_equal(e.text, "given up after 5 attempts: dropped");
		else
			assert_true(file_has_content("dropped.exr", twice, sizeof twice));
		assert_int_equal(unlink("dropped.exr"), rc ? -1 : 0);
	}
	assert_int_equal(client_exit_code(-EAGAIN), 1);
}

/* A dropped log stream begins again, too, and no line is printed twice or in part. */
static void dropped_log_stream_is_retried(void **state)
{
	(void)state;
	static const char twice[] = "the image\0the image";
	for (int drops = 0; drops < 2; drops++) {
		struct coordinator c = {.dropped_fetches = drops, .sizes = {2 * sizeof image, 2 * sizeof image}};
		struct client *cl = connect_client(&c);
		struct error e;
		int fd = open("stream", O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
		int rc = client_fetch_log(cl, 1, fd, &e);
		disconnect_client(&c, cl);
		close(fd);
		assert_int_equal(rc, 0);
		assert_true(file_has_content("stream", twice, sizeof twice));
	}
	assert_int_equal(unlink("stream"), 0);
}

/* An error of the client's own files is not reported as the coordinator's refusal or absence, whatever errno is. */
static void local_file_error_is_not_blamed_on_the_coordinator(void **state)
{
	(void)state;
	bool root = geteuid() == 0;
	if (root && (seteuid(65534) || seteuid(0))) {
		print_message("skipped: there is no other user in this name space\n");
		skip();
	}
	struct coordinator c = {.name = "room.exr"};
	struct client *cl = connect_client(&c);
	struct error e;
	assert_int_equal(mkdir("closed", 0500), 0);
	assert_true(!root || seteuid(65534) == 0);
	int rc = client_fetch(cl, 1, FARM__WHAT__WHAT_RESULT, "closed/room.exr", &e);
	assert_true(!root || seteuid(0) == 0);
	disconnect_client(&c, cl);
	assert_non_null(strstr(e.text, "closed/room.exr: cannot make a file there: Permission denied"));
	assert_int_equal(client_exit_code(rc), 1);
}

/* ---- more data than was asked for ---- */

/* Takes all messages that have arrived, and returns their total size. */
static size_t receive_all(struct client *cl)
{
	struct client_message m;
	struct error e;
	size_t sum = 0, count = 0;
	int rc;
	while ((rc = client_receive(cl, 5, &m, &e)) == 0) {
		sum += m.payload.size;
		count++;
		client_message_fini(&m);
	}
	assert_int_equal(rc, -ECONNRESET);
	if (!strstr(e.text, "sends more than was requested"))
		fail_msg("%s", e.text);
	return sum ? sum : count;
}

static void unrequested_data_is_limited(void **state)
{
	(void)state;
	static const struct {
		size_t count, payload, max_received;
	} floods[] = {{5000, 0, 4096}, {80, 1 << 20, 1 << 26}};
	for (int i = 0; i < 2; i++) {
		struct coordinator c = {
			.flood_count = floods[i].count, .flood_payload = floods[i].payload, .is_deaf = true};
		struct client *cl = connect_client(&c);
		struct error e;
		unsigned char *question = calloc(1, 1 << 22);
		/* Nobody takes the messages, and they exceed the buffers of the system: one of these calls blocks and
		 * receives the flood until it exceeds the limit. The other calls return at once. */
		for (int k = 0; k < 32; k++)
			assert_int_equal(client_send(cl, ENVELOPE(BYE, bye), question, 1 << 22, &e), 0);
		free(question);
		size_t received = receive_all(cl);
		assert_true(received <= floods[i].max_received && received > floods[i].max_received / 2);
		c.is_deaf = false;
		disconnect_client(&c, cl);
	}
}

static void second_address_is_tried(void **state)
{
	(void)state;
	struct coordinator c = {.host = "two"};
	disconnect_client(&c, connect_client(&c));
}

/* Each allocation fails in turn: the client never waits for a message that was lost. */
static void lack_of_memory_for_a_message_closes_the_connection(void **state)
{
	(void)state;
	int rc = -1;
	for (long n = 0; rc; n++) {
		struct coordinator c = {.flood_count = 1, .is_flood_held = true};
		struct client *cl = connect_client(&c);
		struct client_message m;
		struct error e;
		c.is_flood_held = false;
		while (!c.is_flood_sent)
			usleep(1000);
		mem_fail_after(n);
		rc = client_receive(cl, 60, &m, &e);
		mem_fail_after(-1);
		assert_true(rc == 0 || rc == -ECONNRESET);
		client_message_fini(&m);
		disconnect_client(&c, cl);
	}
}

static int set_up(void **state)
{
	(void)state;
	strcpy(folder, "/tmp/hslt-client.XXXXXX");
	return mkdtemp(folder) ? chdir(folder) : -1;
}

static int tear_down(void **state)
{
	(void)state;
	char command[96];
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return chdir("/") || system(command);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(file_names_cannot_leave_the_folder),
		cmocka_unit_test(preview_leaves_the_final_name_free),
		cmocka_unit_test(named_output_file_is_replaced),
		cmocka_unit_test(preview_never_takes_the_final_name),
		cmocka_unit_test(preview_does_not_follow_a_link_to_the_final_name),
		cmocka_unit_test(file_whose_size_changes_fails_the_fetch),
		cmocka_unit_test(signal_leaves_no_temporary_file),
		cmocka_unit_test(dropped_fetch_is_retried),
		cmocka_unit_test(dropped_log_stream_is_retried),
		cmocka_unit_test(local_file_error_is_not_blamed_on_the_coordinator),
		cmocka_unit_test(unrequested_data_is_limited),
		cmocka_unit_test(lack_of_memory_for_a_message_closes_the_connection),
		cmocka_unit_test(second_address_is_tried),
	};
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
