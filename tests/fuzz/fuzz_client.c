/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A client against a coordinator that sends arbitrary bytes: all of them at once, whatever is asked, and then it hangs
 * up. The first byte chooses what the client does: list, submit, wait for a job, fetch a file.
 */
#include "common/base/mem.h"
#include "common/net/client.h"
#include "tests/fuzz/farm.h"
#include "tests/fuzz/folders.h"
#include "tests/fuzz/seeds.h"
#include "tests/support/checksummed_frame.h"
#include "worker/cli/submit/submit.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum want { LIST, SUBMIT, WAIT, FETCH, FETCH_FILE, WANTS };
enum { SPEAKERS = 1 };

static struct {
	int listener;
	char address[32], file[128];
	const struct step *steps;
	size_t count;
	bool hello;
} now;

/* ---- the coordinator, on a thread of its own ---- */

static void send_bytes(int fd, const void *bytes, size_t size)
{
	const char *at = bytes;
	ssize_t n = 1;
	for (; size && n > 0; at += n, size -= (size_t)n)
		n = send(fd, at, size, MSG_NOSIGNAL);
}

static void say_hello_ack(int fd)
{
	Farm__HelloAck ack;
	Farm__Envelope m;
	unsigned char *frame;
	size_t size;
	struct error e;
	farm__hello_ack__init(&ack);
	farm__envelope__init(&m);
	ack.accepted = true;
	ack.version = FARM_VERSION;
	ack.heartbeat_ms = 5000;
	m.body_case = FARM__ENVELOPE__BODY_HELLO_ACK;
	m.hello_ack = &ack;
	if (envelope_pack(&m, NULL, 0, &frame, &size, &e) == 0)
		send_bytes(fd, frame, size);
	mem_free(frame);
}

static void *run_server(void *user)
{
	char bytes[4096];
	(void)user;
	int fd = accept(now.listener, NULL, NULL);
	if (now.hello)
		say_hello_ack(fd);
	for (size_t i = 0; i < now.count; i++) {
		const struct step *s = &now.steps[i];
		size_t size;
		unsigned char *checked = checksummed_parts(s->header, s->header_size, s->payload, s->payload_size,
							   i == 0 && !now.hello, &size);
		send_bytes(fd, checked, size);
		free(checked);
	}
	shutdown(fd, SHUT_WR);
	while (recv(fd, bytes, sizeof bytes, 0) > 0)
		continue;
	close(fd);
	return NULL;
}

static void start_listening(void)
{
	struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
	socklen_t size = sizeof a;
	now.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (bind(now.listener, (struct sockaddr *)&a, size) || listen(now.listener, 8) ||
	    getsockname(now.listener, (struct sockaddr *)&a, &size))
		abort();
	snprintf(now.address, sizeof now.address, "127.0.0.1:%u", ntohs(a.sin_port));
	snprintf(now.file, sizeof now.file, "%s/fetched", folders_base());
}

/* ---- the client ---- */

static void list(struct client *cl)
{
	Farm__JobList question;
	Farm__Envelope m;
	struct client_message answer;
	struct error e;
	farm__job_list__init(&question);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_JOB_LIST;
	m.job_list = &question;
	if (client_call(cl, &m, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER, &answer, &e) == 0)
		client_message_fini(&answer);
}

static void submit(struct client *cl)
{
	static char folder_name[] = "/dev/null", name[] = "s.xml";
	struct scene_file file = {.name = name, .size = strlen(farm_scene)};
	struct scene_files b = {.folder = folder_name,
				.folders = asset_folders_of(folder_name, NULL, 0),
				.scene = name,
				.count = 1,
				.list = &file};
	struct render_arguments args = {0};
	struct submit_request r = {.name = "n", .output = "", .args = &args};
	char text[PLAN_TEXT];
	struct submitted job;
	struct error e;
	blob_hash_bytes(farm_scene, strlen(farm_scene), &file.hash, &e);
	submit_send(cl, &r, &b, &job, text, sizeof text, &e);
}

static void make_request(struct client *cl, enum want w)
{
	struct error e;
	struct submit_end end;
	int fd;
	switch (w) {
	case LIST:
		list(cl);
		break;
	case SUBMIT:
		submit(cl);
		break;
	case WAIT:
		submit_wait(cl, &(struct submitted){.job = 1}, &end, &e);
		break;
	case FETCH:
		fd = open("/dev/null", O_WRONLY | O_CLOEXEC);
		client_fetch_log(cl, 1, fd, &e);
		close(fd);
		break;
	default:
		client_fetch(cl, 1, FARM__WHAT__WHAT_RESULT, now.file, &e);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct step steps[SCRIPT_STEPS];
	pthread_t thread;
	struct client *cl;
	struct error e;
	if (!size)
		return 0;
	if (!now.listener)
		start_listening();
	now.count = script_read(bytes + 1, size - 1, steps);
	now.steps = steps;
	now.hello = *bytes / WANTS % 8 != 0;
	if (pthread_create(&thread, NULL, run_server, NULL))
		abort();
	if (client_open(&cl, now.address, NULL, false, "n", &e) == 0) {
		make_request(cl, *bytes % WANTS);
		client_close(cl);
	}
	pthread_join(thread, NULL);
	return 0;
}

size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t room, unsigned seed)
{
	if (size < 2 || seed % 64 == 0)
		return LLVMFuzzerMutate(bytes, size, room);
	return 1 + script_mutate(bytes + 1, size - 1, room - 1, seed, SPEAKERS);
}

/* ---- seeds ---- */

static void end(struct seed *s, enum want w, uint64_t number)
{
	memmove(s->bytes + 1, s->bytes, s->size);
	s->bytes[0] = (uint8_t)(WANTS + w);
	s->size++;
	seed_end(s, "want", number);
}

static void write_jobs(void)
{
	struct seed s = {0};
	char state[] = "running", none[] = "", mixture[] = "n";
	Farm__JobStatus status, *jobs[1] = {&status};
	Farm__JobListAnswer answer;
	Farm__Look look, *looks[1] = {&look};
	farm__job_status__init(&status);
	farm__job_list_answer__init(&answer);
	farm__look__init(&look);
	look.work = look.seconds = look.rel_mse = look.rel_mse_upper = look.degrees = 1;
	status.job = 1;
	status.name = mixture;
	status.state = state;
	status.why = none;
	status.progress = status.rate = status.eta = status.error = 0.5;
	status.n_looks = 1;
	status.looks = looks;
	answer.n_jobs = 1;
	answer.jobs = jobs;
	SEED_SAY(&s, 0, JOB_LIST_ANSWER, job_list_answer, &answer);
	end(&s, LIST, 0);
	SEED_SAY(&s, 0, JOB_STATUS, job_status, &status);
	status.ended = true;
	SEED_SAY(&s, 0, JOB_STATUS, job_status, &status);
	end(&s, WAIT, 1);
}

static void write_answers(void)
{
	struct seed s = {0};
	struct blob_hash hash;
	struct error e;
	ProtobufCBinaryData missing[1] = {{BLOB_HASH_SIZE, hash.bytes}};
	Farm__SubmitAnswer answer;
	farm__submit_answer__init(&answer);
	blob_hash_bytes(farm_scene, strlen(farm_scene), &hash, &e);
	answer.n_missing = 1;
	answer.missing = missing;
	SEED_SAY(&s, 0, SUBMIT_ANSWER, submit_answer, &answer);
	answer.n_missing = 0;
	answer.job = 1;
	SEED_SAY(&s, 0, SUBMIT_ANSWER, submit_answer, &answer);
	end(&s, SUBMIT, 2);
	for (enum want w = FETCH; w <= FETCH_FILE; w++) {
		Farm__FetchChunk chunk;
		Farm__Envelope m;
		farm__fetch_chunk__init(&chunk);
		farm__envelope__init(&m);
		chunk.job = 1;
		chunk.size = 8;
		m.body_case = FARM__ENVELOPE__BODY_FETCH_CHUNK;
		m.fetch_chunk = &chunk;
		seed_say(&s, 0, &m, "abcde", 5);
		chunk.offset = 5;
		seed_say(&s, 0, &m, "fgh", 3);
		end(&s, w, (uint64_t)w);
	}
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc;
	(void)argv;
	if (!seeds_wanted())
		return 0;
	write_jobs();
	write_answers();
	exit(0);
}
