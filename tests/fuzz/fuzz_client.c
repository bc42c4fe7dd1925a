/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A client against a coordinator that sends arbitrary bytes: all of them at once, whatever is asked, and then it hangs
 * up. The first byte chooses what the client does: list, submit, wait for a job, fetch a file.
 */
#include "common/base/mem.h"
#include "common/net/client.h"
#include "tests/fuzz/farm_world.h"
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

enum request_kind { LIST, SUBMIT, WAIT, FETCH, FETCH_FILE, REQUEST_KINDS };
enum { SPEAKERS = 1 };

static struct {
	int listener;
	char address[32], file[128];
	const struct step *steps;
	size_t count;
	bool sends_hello;
} client_state;

/* ---- the coordinator, on a thread of its own ---- */

static void send_bytes(int fd, const void *bytes, size_t size)
{
	const char *at = bytes;
	ssize_t n = 1;
	for (; size && n > 0; at += n, size -= (size_t)n)
		n = send(fd, at, size, MSG_NOSIGNAL);
}

static void send_hello_ack(int fd)
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
	int fd = accept(client_state.listener, NULL, NULL);
	if (client_state.sends_hello)
		send_hello_ack(fd);
	for (size_t i = 0; i < client_state.count; i++) {
		const struct step *s = &client_state.steps[i];
		size_t size;
		unsigned char *checked =
			checksummed_frame_from_parts(s->header, s->header_size, s->payload, s->payload_size,
						     i == 0 && !client_state.sends_hello, &size);
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
	client_state.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (bind(client_state.listener, (struct sockaddr *)&a, size) || listen(client_state.listener, 8) ||
	    getsockname(client_state.listener, (struct sockaddr *)&a, &size))
		abort();
	snprintf(client_state.address, sizeof client_state.address, "127.0.0.1:%u", ntohs(a.sin_port));
	snprintf(client_state.file, sizeof client_state.file, "%s/fetched", folders_base());
}

/* ---- the client ---- */

static void request_list(struct client *cl)
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

static void request_submit(struct client *cl)
{
	static char folder_name[] = "/dev/null", name[] = "s.xml";
	struct scene_file file = {.name = name, .size = strlen(farm_world_scene)};
	struct scene_files b = {.folder = folder_name,
				.folders = asset_folders_make(folder_name, NULL, 0),
				.scene = name,
				.file_count = 1,
				.files = &file};
	struct render_arguments args = {0};
	struct submit_request r = {.name = "n", .output = "", .args = &args};
	char text[PLAN_TEXT_MAX];
	struct submitted_job job;
	struct error e;
	blob_hash_bytes(farm_world_scene, strlen(farm_world_scene), &file.hash, &e);
	submit_send(cl, &r, &b, &job, text, sizeof text, &e);
}

static void make_request(struct client *cl, enum request_kind w)
{
	struct error e;
	struct submit_outcome end;
	int fd;
	switch (w) {
	case LIST:
		request_list(cl);
		break;
	case SUBMIT:
		request_submit(cl);
		break;
	case WAIT:
		submit_wait(cl, &(struct submitted_job){.job = 1}, &end, &e);
		break;
	case FETCH:
		fd = open("/dev/null", O_WRONLY | O_CLOEXEC);
		client_fetch_log(cl, 1, fd, &e);
		close(fd);
		break;
	default:
		client_fetch(cl, 1, FARM__WHAT__WHAT_RESULT, client_state.file, &e);
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
	if (!client_state.listener)
		start_listening();
	client_state.count = script_read(bytes + 1, size - 1, steps);
	client_state.steps = steps;
	client_state.sends_hello = *bytes / REQUEST_KINDS % 8 != 0;
	if (pthread_create(&thread, NULL, run_server, NULL))
		abort();
	if (client_open(&cl, client_state.address, NULL, false, "n", &e) == 0) {
		make_request(cl, *bytes % REQUEST_KINDS);
		client_close(cl);
	}
	pthread_join(thread, NULL);
	return 0;
}

size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t max_size, unsigned seed)
{
	if (size < 2 || seed % 64 == 0)
		return LLVMFuzzerMutate(bytes, size, max_size);
	return 1 + script_mutate(bytes + 1, size - 1, max_size - 1, seed, SPEAKERS);
}

/* ---- seeds ---- */

static void end_seed(struct seed *s, enum request_kind w, uint64_t number)
{
	memmove(s->bytes + 1, s->bytes, s->size);
	s->bytes[0] = (uint8_t)(REQUEST_KINDS + w);
	s->size++;
	seed_write(s, "want", number);
}

static void write_job_seeds(void)
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
	end_seed(&s, LIST, 0);
	SEED_SAY(&s, 0, JOB_STATUS, job_status, &status);
	status.ended = true;
	SEED_SAY(&s, 0, JOB_STATUS, job_status, &status);
	end_seed(&s, WAIT, 1);
}

static void write_answer_seeds(void)
{
	struct seed s = {0};
	struct blob_hash hash;
	struct error e;
	ProtobufCBinaryData missing[1] = {{BLOB_HASH_SIZE, hash.bytes}};
	Farm__SubmitAnswer answer;
	farm__submit_answer__init(&answer);
	blob_hash_bytes(farm_world_scene, strlen(farm_world_scene), &hash, &e);
	answer.n_missing = 1;
	answer.missing = missing;
	SEED_SAY(&s, 0, SUBMIT_ANSWER, submit_answer, &answer);
	answer.n_missing = 0;
	answer.job = 1;
	SEED_SAY(&s, 0, SUBMIT_ANSWER, submit_answer, &answer);
	end_seed(&s, SUBMIT, 2);
	for (enum request_kind w = FETCH; w <= FETCH_FILE; w++) {
		Farm__FetchChunk chunk;
		Farm__Envelope m;
		farm__fetch_chunk__init(&chunk);
		farm__envelope__init(&m);
		chunk.job = 1;
		chunk.size = 8;
		m.body_case = FARM__ENVELOPE__BODY_FETCH_CHUNK;
		m.fetch_chunk = &chunk;
		seed_add_message(&s, 0, &m, "abcde", 5);
		chunk.offset = 5;
		seed_add_message(&s, 0, &m, "fgh", 3);
		end_seed(&s, w, (uint64_t)w);
	}
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc;
	(void)argv;
	if (!seeds_are_requested())
		return 0;
	write_job_seeds();
	write_answer_seeds();
	exit(0);
}
