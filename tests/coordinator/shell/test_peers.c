/*
 * The coordinator's shell against scripted peers over loopback: rubbish, liars, stragglers, and a whole job done by a worker
 * of a few lines that answers every lease with black.
 */
#include "common/base/mem.h"
#include "common/wire/batch_wire.h"
#include "common/wire/frame.h"
#include "coordinator/shell/server.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[64];
static pid_t server;
static uint16_t port;

/* While the folder has a file `busy` nobody may look at the films of jobs. */
static void on_look(uv_timer_t *t)
{
	static bool held;
	struct server *s = t->data;
	char path[96];
	snprintf(path, sizeof path, "%s/busy", folder);
	bool wanted = access(path, F_OK) == 0;
	snprintf(path, sizeof path, "%s/nomem", folder);
	if (remove(path) == 0)
		mem_fail_after(1); /* a caller's session is made, and its connection is not */
	if (held == wanted)
		return;
	held = wanted;
	snprintf(path, sizeof path, "%s/held", folder);
	for (struct order *o = s->orders; o; o = o->next)
		o->busy = wanted;
	if (!wanted)
		server_order_free_again(s);
	if (wanted && fclose(fopen(path, "w")))
		abort();
	if (!wanted && remove(path))
		abort();
}

static int serve(const struct server_config *c)
{
	struct server *s;
	struct error e;
	uv_timer_t look;
	if (server_open(&s, c, &e))
		return 1;
	look.data = s;
	uv_timer_init(&s->loop, &look);
	uv_timer_start(&look, on_look, 5, 5);
	uv_unref((uv_handle_t *)&look);
	uv_run(&s->loop, UV_RUN_DEFAULT);
	uv_close((uv_handle_t *)&look, NULL);
	server_close(s);
	return 0;
}

static void set_busy(bool busy)
{
	char path[96], held[96];
	snprintf(path, sizeof path, "%s/busy", folder);
	snprintf(held, sizeof held, "%s/held", folder);
	assert_int_equal(busy ? fclose(fopen(path, "w")) : remove(path), 0);
	for (int i = 0; i < 500 && (access(held, F_OK) == 0) != busy; i++)
		usleep(10000);
	assert_true((access(held, F_OK) == 0) == busy);
}

static int start_server(double heartbeat_seconds, double stall_seconds)
{
	char spool[96], port_file[96];
	strcpy(folder, "/tmp/hslt-peers.XXXXXX");
	if (!mkdtemp(folder))
		return -1;
	snprintf(spool, sizeof spool, "%s/spool", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	fflush(NULL);
	server = fork();
	if (server == 0) {
		struct server_config c;
		server_config_init(&c);
		c.listen = "127.0.0.1:0";
		c.spool = spool;
		c.port_file = port_file;
		c.max_connections = 8;
		c.hello_seconds = 1;
		c.heartbeat_seconds = heartbeat_seconds;
		c.stall_seconds = stall_seconds;
		log_set_level(LOG_LEVEL_ERROR);
		_exit(serve(&c));
	}
	unsigned number = 0;
	for (int i = 0; i < 500 && !number; i++) {
		FILE *f = fopen(port_file, "r");
		if (f && fscanf(f, "%u", &number) != 1)
			number = 0;
		if (f)
			fclose(f);
		usleep(10000);
	}
	port = (uint16_t)number;
	return port ? 0 : -1;
}

static int set_up(void **state)
{
	(void)state;
	return start_server(5, 1);
}

/* Who is silent for 1.2 s is hung up on. */
static int set_up_quick(void **state)
{
	(void)state;
	return start_server(0.2, 10);
}

static int tear_down(void **state)
{
	(void)state;
	char command[96];
	int status = -1;
	kill(server, SIGTERM);
	waitpid(server, &status, 0);
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return system(command) || !WIFEXITED(status) || WEXITSTATUS(status);
}

/* ---- a peer of our own ---- */

struct peer {
	int fd;
	struct frame_reader reader;
	unsigned char bytes[4096];
	size_t at, size;
	struct envelope env;
	unsigned heartbeats; /* heard */
};

static struct peer *call(void)
{
	struct sockaddr_in a = {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
	struct peer *p = calloc(1, sizeof *p);
	assert_non_null(p);
	p->fd = socket(AF_INET, SOCK_STREAM, 0);
	assert_int_equal(connect(p->fd, (struct sockaddr *)&a, sizeof a), 0);
	frame_reader_init(&p->reader, (struct frame_limits){1 << 22, 1 << 24});
	return p;
}

static void hang_up(struct peer *p)
{
	close(p->fd);
	frame_reader_fini(&p->reader);
	envelope_fini(&p->env);
	free(p);
}

static void say_bytes(const struct peer *p, const void *bytes, size_t size)
{
	assert_int_equal(send(p->fd, bytes, size, MSG_NOSIGNAL), size);
}

static void say(const struct peer *p, const Farm__Envelope *m, const void *payload, size_t payload_size)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	assert_int_equal(envelope_pack(m, payload, payload_size, &frame, &size, &e), 0);
	say_bytes(p, frame, size);
	mem_free(frame);
}

/* The next message but heartbeats; NULL when the coordinator hung up. Three seconds at most. */
static const Farm__Envelope *hear(struct peer *p)
{
	for (;;) {
		struct error e;
		if (p->at == p->size) {
			struct pollfd ready = {p->fd, POLLIN, 0};
			assert_int_equal(poll(&ready, 1, 3000), 1);
			ssize_t n = read(p->fd, p->bytes, sizeof p->bytes);
			if (n <= 0)
				return NULL;
			p->at = 0;
			p->size = (size_t)n;
		}
		size_t used;
		int rc = frame_reader_take(&p->reader, p->bytes + p->at, p->size - p->at, &used, &e);
		assert_true(rc >= 0);
		p->at += used;
		if (!rc)
			continue;
		envelope_fini(&p->env);
		assert_int_equal(envelope_unpack(&p->env, p->reader.header.bytes, p->reader.header.size, &e), 0);
		if (p->env.message->body_case != FARM__ENVELOPE__BODY_HEARTBEAT)
			return p->env.message;
		p->heartbeats++;
	}
}

static const Farm__HelloAck *hello(struct peer *p, uint32_t version, Farm__Role role)
{
	Farm__Hello h;
	Farm__Envelope m;
	char name[] = "scripted", print[] = "p1";
	farm__hello__init(&h);
	farm__envelope__init(&m);
	h.version = version;
	h.role = role;
	h.name = name;
	h.fingerprint = print;
	h.threads = 1;
	m.body_case = FARM__ENVELOPE__BODY_HELLO;
	m.hello = &h;
	say(p, &m, NULL, 0);
	const Farm__Envelope *answer = hear(p);
	assert_non_null(answer);
	assert_int_equal(answer->body_case, FARM__ENVELOPE__BODY_HELLO_ACK);
	return answer->hello_ack;
}

static void say_empty(struct peer *p, Farm__Envelope__BodyCase what)
{
	Farm__Envelope m;
	Farm__JobList list;
	Farm__LeaseRequest request;
	farm__envelope__init(&m);
	farm__job_list__init(&list);
	farm__lease_request__init(&request);
	request.want = 2;
	m.body_case = what;
	if (what == FARM__ENVELOPE__BODY_JOB_LIST)
		m.job_list = &list;
	else
		m.lease_request = &request;
	say(p, &m, NULL, 0);
}

static void say_job_get(const struct peer *p, uint64_t job)
{
	Farm__Envelope m;
	Farm__JobGet get;
	farm__envelope__init(&m);
	farm__job_get__init(&get);
	get.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_GET;
	m.job_get = &get;
	say(p, &m, NULL, 0);
}

static void it_still_works(void)
{
	struct peer *p = call();
	assert_true(hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	say_empty(p, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *answer = hear(p);
	assert_non_null(answer);
	assert_int_equal(answer->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	hang_up(p);
}

/* ---- rubbish ---- */

static void rubbish_is_hung_up_on(void **state)
{
	(void)state;
	static const struct {
		const char *bytes;
		size_t size;
	} rubbish[] = {
		{"GET / HTTP/1.1\r\n\r\n", 18},
		{"\xff\xff\xff\xff\xff\xff\xff\xff", 8},
		{"\0\0\0\0\0\0\0\0", 8},                 /* no header */
		{"\0\0\0\x04\0\0\0\x01", 8},             /* a payload before hello */
		{"\0\0\x10\x01\0\0\0\0", 8},             /* 4,097 bytes of hello */
		{"\0\0\0\x03\0\0\0\0\xff\xff\xff", 11},  /* does not parse */
		{"\0\0\0\x02\0\0\0\0\x1a\x00", 10},      /* a heartbeat before hello */
		{"\0\0\0\x05\0\0\0\0\x0a\0\x98\x06\x01", 13}, /* an unknown field beside hello */
	};
	for (size_t i = 0; i < sizeof rubbish / sizeof *rubbish; i++) {
		struct peer *p = call();
		say_bytes(p, rubbish[i].bytes, rubbish[i].size);
		const Farm__Envelope *m = hear(p);
		if (m) { /* who is understood is told what is wrong */
			assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_FAULT);
			assert_null(hear(p));
		}
		hang_up(p);
	}
	it_still_works();
}

static void stragglers_are_hung_up_on(void **state)
{
	(void)state;
	struct peer *silent = call(), *half = call(), *client = call();
	say_bytes(half, "\0\0\0\x20", 4);
	assert_true(hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	say_bytes(client, "\0\0\0\x20\0\0\0\0abc", 11); /* begun and never finished */
	assert_null(hear(silent));
	assert_null(hear(half));
	assert_null(hear(client));
	hang_up(silent);
	hang_up(half);
	hang_up(client);
	it_still_works();
}

static void crowds_are_turned_away(void **state)
{
	(void)state;
	struct peer *crowd[8];
	for (int i = 0; i < 8; i++) {
		crowd[i] = call();
		assert_true(hello(crowd[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	}
	struct peer *one_more = call();
	assert_null(hear(one_more));
	hang_up(one_more);
	for (int i = 0; i < 8; i++)
		hang_up(crowd[i]);
	usleep(50000);
	it_still_works();
}

/* There is no memory for a connection: nobody is let in before there is, and then all are. */
static void a_caller_waits_for_memory(void **state)
{
	(void)state;
	char path[96];
	snprintf(path, sizeof path, "%s/nomem", folder);
	assert_int_equal(fclose(fopen(path, "w")), 0);
	while (access(path, F_OK) == 0)
		usleep(1000);
	it_still_works();
	it_still_works();
}

/* Who says nothing gives way to who comes after, the first of them first; who has said hello stays. */
static void the_silent_give_way(void **state)
{
	(void)state;
	struct peer *first = call(), *crowd[7], *guests[7];
	assert_true(hello(first, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	for (int i = 0; i < 7; i++)
		crowd[i] = call();
	for (int i = 0; i < 7; i++) {
		guests[i] = call();
		assert_true(hello(guests[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
		assert_null(hear(crowd[i]));
	}
	struct peer *one_more = call();
	assert_null(hear(one_more));
	hang_up(one_more);
	hang_up(first);
	for (int i = 0; i < 7; i++) {
		hang_up(crowd[i]);
		hang_up(guests[i]);
	}
	usleep(50000);
	it_still_works();
}

static void hello_is_looked_at(void **state)
{
	(void)state;
	struct peer *p = call();
	const Farm__HelloAck *ack = hello(p, FARM_VERSION + 1, FARM__ROLE__ROLE_WORKER);
	assert_false(ack->accepted);
	assert_non_null(strstr(ack->text, "the coordinator is older"));
	assert_null(hear(p));
	hang_up(p);
	p = call();
	assert_false(hello(p, FARM_VERSION, FARM__ROLE__ROLE_NONE)->accepted);
	hang_up(p);
	p = call();
	assert_true(hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	say_empty(p, FARM__ENVELOPE__BODY_LEASE_REQUEST); /* clients get no leases */
	const Farm__Envelope *m = hear(p);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_FAULT);
	hang_up(p);
}

/* ---- a whole job ---- */

static struct plan_request request(const char *mixture)
{
	struct plan_request r = {.integrator = "pssmlt", .kind = PLAN_CHAINS, .width = 20, .height = 10, .spp = 4,
				 .max_depth = 5, .groups = 2, .bootstrap = 256};
	if (mixture)
		snprintf(r.mixture, sizeof r.mixture, "%s", mixture);
	return r;
}

/* mixture: NULL, or of the mutations. */
static void submit(struct peer *p, const char *mixture, const char *scene_text, const char *file_name, const char *scene_name)
{
	Farm__Submit s;
	Farm__PlanRequest plan;
	Farm__File file, *files[1] = {&file};
	Farm__Envelope m;
	struct blob_hash hash;
	struct error e;
	char name[] = "black", scene[64], file_text[64];
	struct plan_request r = request(mixture);
	plan_request_to_wire(&r, &plan);
	farm__submit__init(&s);
	farm__file__init(&file);
	farm__envelope__init(&m);
	assert_int_equal(blob_hash_bytes(scene_text, strlen(scene_text), &hash, &e), 0);
	snprintf(file_text, sizeof file_text, "%s", file_name);
	snprintf(scene, sizeof scene, "%s", scene_name);
	file.name = file_text;
	file.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
	file.size = strlen(scene_text);
	s.name = name;
	s.scene = scene;
	s.plan = &plan;
	s.n_files = 1;
	s.files = files;
	m.body_case = FARM__ENVELOPE__BODY_SUBMIT;
	m.submit = &s;
	say(p, &m, NULL, 0);
}

static void send_blob(struct peer *p, const char *true_text, const char *sent_text)
{
	Farm__BlobChunk c;
	Farm__Envelope m;
	struct blob_hash hash;
	struct error e;
	assert_int_equal(blob_hash_bytes(true_text, strlen(true_text), &hash, &e), 0);
	farm__blob_chunk__init(&c);
	farm__envelope__init(&m);
	c.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
	c.size = strlen(true_text);
	m.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
	m.blob_chunk = &c;
	say(p, &m, sent_text, strlen(sent_text));
}

static const Farm__SubmitAnswer *submit_answer(struct peer *p)
{
	const Farm__Envelope *m = hear(p);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_SUBMIT_ANSWER);
	return m->submit_answer;
}

static void submissions_are_looked_at(void **state)
{
	(void)state;
	struct peer *p = call();
	assert_true(hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	static const char *const names[] = {"../s.xml", "/s.xml", "a//s.xml", "", "a/./s.xml", "s.xml/", "a/..", "a\nb"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		submit(p, NULL, "<scene/>", names[i], names[i]);
		const Farm__SubmitAnswer *a = submit_answer(p);
		assert_true(a->job == 0 && a->n_missing == 0 && *a->refusal);
	}
	submit(p, NULL, "<scene/>", "other.xml", "s.xml");
	assert_true(*submit_answer(p)->refusal);
	submit(p, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(submit_answer(p)->n_missing, 1);
	send_blob(p, "<scene/>", "<SCENE/>"); /* other bytes than promised */
	const Farm__SubmitAnswer *a = submit_answer(p);
	assert_true(a->job == 0 && *a->refusal);
	send_blob(p, "<scene/>", "<scene/>"); /* nobody asked */
	hang_up(p);
	it_still_works();
}

static void send_batch(struct peer *p, const struct batch *b, const struct plan *plan)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	assert_int_equal(batch_pack(b, plan, &frame, &size, &e), 0);
	say_bytes(p, frame, size);
	mem_free(frame);
}

/* Leases that came and were not answered yet. */
struct desk {
	struct lease_key keys[64];
	size_t count;
	bool job_ended;
};

/* Hears one message. Its verdict, or VERDICT_NONE when it was none. */
static Farm__Verdict attend(struct peer *p, struct desk *d)
{
	struct error e;
	const Farm__Envelope *m = hear(p);
	assert_non_null(m);
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK)
		return m->lease_ack->verdict;
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT) {
		assert_true(d->count < 64);
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &d->keys[d->count++], &e), 0);
	}
	d->job_ended = d->job_ended || m->body_case == FARM__ENVELOPE__BODY_JOB_END;
	return FARM__VERDICT__VERDICT_NONE;
}

static Farm__Verdict verdict(struct peer *p, struct desk *d)
{
	Farm__Verdict v;
	while ((v = attend(p, d)) == FARM__VERDICT__VERDICT_NONE)
		continue;
	return v;
}

/* Black weights for a bootstrap lease. */
static struct batch black_batch(const struct lease_key *k, const struct plan *plan)
{
	struct batch b = {.key = *k};
	assert_int_equal(k->kind, LEASE_BOOTSTRAP); /* black ends before rounds */
	struct plan_range range = plan_bootstrap_range(plan, k->group, k->part);
	b.weight_count = b.counters[COUNT_INDEPENDENT] = b.counters[COUNT_SAMPLES] = range.end - range.begin;
	b.weights = mem_alloc(b.weight_count, sizeof *b.weights);
	return b;
}

static void a_black_job_ends(void **state)
{
	(void)state;
	struct peer *client = call(), *worker = call();
	struct plan plan;
	struct error e;
	struct plan_request r = request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(submit_answer(client)->n_missing, 1);
	send_blob(client, "<scene/>", "<scene/>");
	const Farm__SubmitAnswer *a = submit_answer(client);
	assert_int_equal(a->job, 1);
	assert_true(hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct desk d = {.count = 0};
	bool first = true;
	while (!d.job_ended) {
		if (d.count == 0) {
			attend(worker, &d);
			continue;
		}
		struct batch b = black_batch(&d.keys[--d.count], &plan);
		if (first) { /* wrong ones; then the right ones; then a repeat */
			b.weights[0] = NAN;
			send_batch(worker, &b, &plan);
			assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
			b.weights[0] = 0;
			send_batch(worker, &b, &plan);
			assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
			send_batch(worker, &b, &plan);
			assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
			first = false;
		} else {
			send_batch(worker, &b, &plan);
		}
		batch_fini(&b);
	}
	say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = hear(client);
	assert_non_null(m);
	assert_int_equal(m->job_list_answer->n_jobs, 1);
	assert_string_equal(m->job_list_answer->jobs[0]->state, "done");
	assert_true(m->job_list_answer->jobs[0]->fetchable);
	hang_up(client);
	hang_up(worker);
}

/* A lease of chains in the dark; of a bootstrap in even light. */
static struct batch counting_batch(const struct lease_key *k, const struct plan *plan)
{
	struct batch b = {.key = *k};
	if (k->kind == LEASE_BOOTSTRAP) {
		b = black_batch(k, plan);
		for (uint64_t i = 0; i < b.weight_count; i++)
			b.weights[i] = 1;
		b.independent_sum = (double)b.weight_count;
		return b;
	}
	struct plan_range chains = plan_chain_range(plan, k->part);
	b.state_count = (uint32_t)(chains.end - chains.begin);
	b.states = mem_alloc(b.state_count, sizeof *b.states);
	for (uint32_t i = 0; i < b.state_count; i++)
		b.states[i] = (struct chain_state){mem_alloc(4, 1), 4};
	b.moment_count = batch_moment_count(plan, LEASE_RENDER);
	b.moments = mem_alloc(b.moment_count, sizeof *b.moments);
	b.counters[COUNT_SAMPLES] = b.state_count * plan->epoch;
	b.counters[COUNT_STUCK] = b.state_count;
	b.counters[COUNT_LONGEST_STUCK] = 100 + k->group;
	b.strategy_count = 2;
	b.strategy[0][STRATEGY_PROPOSED] = 3;
	b.strategy[1][STRATEGY_PROPOSED] = b.counters[COUNT_SAMPLES] - 3;
	b.strategy[1][STRATEGY_RAYS] = UINT64_C(1) << 40;
	b.strategy[1][STRATEGY_FAIL_MODE] = 7 + k->part;
	return b;
}

static void expect_counts_in_spool(const struct plan *plan)
{
	struct job_record r;
	struct error e;
	char path[96], text[16384];
	snprintf(path, sizeof path, "%s/spool/jobs/j2/job.json", folder);
	FILE *f = fopen(path, "r");
	assert_non_null(f);
	size_t size = fread(text, 1, sizeof text, f);
	fclose(f);
	assert_int_equal(record_from_json(text, size, &r, &e), 0);
	uint64_t leases = plan->rounds * plan->groups * plan->parts, chains = plan->chains * plan->rounds;
	assert_int_equal(r.leases_merged, leases);
	assert_int_equal(r.repeats, 1);
	assert_int_equal(r.refused, 1);
	assert_string_equal(r.mixture, "independent=0.1,hslt=0.9");
	assert_int_equal(r.strategy[0][STRATEGY_PROPOSED], 3 * leases);
	assert_int_equal(r.strategy[1][STRATEGY_PROPOSED], plan->rounds * plan_round_mutations(plan) - 3 * leases);
	assert_true(r.strategy[1][STRATEGY_RAYS] == leases << 40);
	assert_int_equal(r.strategy[1][STRATEGY_FAIL_MODE], plan->rounds * plan->groups * (7 * plan->parts + plan->parts * (plan->parts - 1) / 2));
	assert_int_equal(r.stuck, chains);
	assert_int_equal(r.longest_stuck, 101);
	assert_non_null(strstr(r.note, "the image is black: no sample found light; "));
	assert_non_null(strstr(r.note, "longest run: 101 rejections"));
}

static void strategies_are_counted_once(void **state)
{
	(void)state;
	struct peer *client = call(), *worker = call();
	struct plan plan;
	struct error e;
	struct plan_request r = request("independent=0.1,hslt=0.9");
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	submit(client, r.mixture, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(submit_answer(client)->job, 2); /* the scene is still there */
	assert_true(hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct desk d = {.count = 0};
	bool first = true;
	while (!d.job_ended) {
		if (d.count == 0) {
			attend(worker, &d);
			continue;
		}
		struct batch b = counting_batch(&d.keys[--d.count], &plan);
		bool wrong = first && b.key.kind == LEASE_RENDER;
		if (wrong) {
			b.strategy[0][STRATEGY_ACCEPTED] = 4; /* of 3 proposals */
			send_batch(worker, &b, &plan);
			assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_REFUSED);
			b.strategy[0][STRATEGY_ACCEPTED] = 0;
		}
		send_batch(worker, &b, &plan);
		assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
		if (wrong) {
			send_batch(worker, &b, &plan);
			assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
			first = false;
		}
		batch_fini(&b);
	}
	expect_counts_in_spool(&plan);
	hang_up(client);
	hang_up(worker);
}

/* ---- results that wait ---- */

static void send_bootstrap(struct peer *p, const struct lease_key *k)
{
	struct plan plan;
	struct error e;
	struct plan_request r = request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	struct batch b = black_batch(k, &plan);
	send_batch(p, &b, &plan);
	batch_fini(&b);
}

/* While nobody may look at the film only what would be merged waits, each once; all else is answered at once. */
static void what_is_useless_does_not_wait(void **state)
{
	(void)state;
	struct peer *client = call(), *worker = call(), *other = call();
	struct desk d = {.count = 0}, none = {.count = 0};
	assert_true(hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	uint64_t job = submit_answer(client)->job;
	assert_true(job > 0);
	assert_true(hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (d.count < 2)
		attend(worker, &d);
	send_bootstrap(worker, &d.keys[0]);
	assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	while (d.count < 3)
		attend(worker, &d);
	assert_true(hello(other, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	say_job_get(other, job);
	assert_int_equal(hear(other)->body_case, FARM__ENVELOPE__BODY_JOB_INFO);
	set_busy(true);
	for (int i = 0; i < 3; i++)
		send_bootstrap(worker, &d.keys[1]);
	send_bootstrap(worker, &d.keys[0]);
	assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
	send_bootstrap(other, &d.keys[0]);
	assert_int_equal(verdict(other, &none), FARM__VERDICT__VERDICT_REPEATED);
	send_bootstrap(other, &d.keys[1]); /* it waits already */
	assert_int_equal(verdict(other, &none), FARM__VERDICT__VERDICT_REFUSED);
	send_bootstrap(other, &d.keys[2]); /* open: perhaps it held it before it called again */
	send_bootstrap(other, &d.keys[2]);
	send_bootstrap(other, &d.keys[0]);
	assert_int_equal(verdict(other, &none), FARM__VERDICT__VERDICT_REPEATED);
	set_busy(false);
	assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	assert_int_equal(verdict(other, &none), FARM__VERDICT__VERDICT_MERGED);
	send_bootstrap(worker, &d.keys[0]); /* nothing else was kept */
	assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_REPEATED);
	/* Who goes takes along what waits for it. */
	assert_true(d.count >= 4);
	set_busy(true);
	send_bootstrap(worker, &d.keys[3]);
	hang_up(worker);
	usleep(50000);
	send_bootstrap(other, &d.keys[3]);
	set_busy(false);
	assert_int_equal(verdict(other, &none), FARM__VERDICT__VERDICT_MERGED);
	hang_up(client);
	hang_up(other);
}

/* ---- who asks and does not read ---- */

enum { PIECE = 1 << 20 };

static void say_piece_gets(const struct peer *p, const struct blob_hash *h, int count)
{
	Farm__Envelope m;
	Farm__BlobGet get;
	struct blob_hash copy = *h;
	farm__envelope__init(&m);
	farm__blob_get__init(&get);
	get.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, copy.bytes};
	m.body_case = FARM__ENVELOPE__BODY_BLOB_GET;
	m.blob_get = &get;
	for (int i = 0; i < count; i++)
		say(p, &m, NULL, 0);
}

static long server_kilobytes(void)
{
	char path[64], line[256];
	long kilobytes = -1;
	snprintf(path, sizeof path, "/proc/%d/status", (int)server);
	FILE *f = fopen(path, "r");
	assert_non_null(f);
	while (fgets(line, sizeof line, f))
		if (sscanf(line, "VmRSS: %ld", &kilobytes) == 1)
			break;
	fclose(f);
	return kilobytes;
}

/* A worker may ask for what all its jobs need at once, and gets it; what it does not read does not fill our memory, and when it goes
 * on asking it is hung up on. */
static void the_deaf_cost_little(void **state)
{
	(void)state;
	struct peer *client = call(), *honest = call(), *deaf[4];
	struct blob_hash h;
	struct error e;
	char *scene = malloc(PIECE);
	assert_non_null(scene);
	memset(scene, 'x', PIECE - 1);
	scene[PIECE - 1] = 0;
	assert_int_equal(blob_hash_bytes(scene, PIECE - 1, &h, &e), 0);
	assert_true(hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	submit(client, NULL, scene, "s.xml", "s.xml");
	assert_int_equal(submit_answer(client)->n_missing, 1);
	send_blob(client, scene, scene);
	assert_true(submit_answer(client)->job);
	assert_true(hello(honest, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	say_piece_gets(honest, &h, 64);
	for (int i = 0; i < 64; i++) {
		const Farm__Envelope *m = hear(honest);
		assert_true(m && m->body_case == FARM__ENVELOPE__BODY_BLOB_CHUNK);
		assert_int_equal(honest->reader.payload.size, PIECE - 1);
	}
	long before = server_kilobytes();
	for (int i = 0; i < 4; i++) {
		deaf[i] = call();
		assert_true(hello(deaf[i], FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
		say_piece_gets(deaf[i], &h, 500);
	}
	it_still_works();
	assert_true(server_kilobytes() - before < 500 * 1024); /* of 2,000 MB that were asked for; a sanitizer keeps 256 MB that were freed */
	for (int i = 0; i < 4; i++) {
		const Farm__Envelope *m;
		say_piece_gets(deaf[i], &h, 50);
		while ((m = hear(deaf[i])) && m->body_case == FARM__ENVELOPE__BODY_BLOB_CHUNK)
			continue;
		assert_true(!m || strstr(m->fault->text, "no worker needs so many"));
		hang_up(deaf[i]);
	}
	free(scene);
	hang_up(client);
	hang_up(honest);
}

/* ---- slow links ---- */

/* A worker with a lease of a new job, and its result. The keys of what came stay in the desk. */
static struct peer *worker_with_result(struct peer *client, struct desk *d, unsigned char **frame, size_t *size)
{
	struct peer *worker = call();
	struct plan plan;
	struct error e;
	struct plan_request r = request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	if (submit_answer(client)->n_missing) {
		send_blob(client, "<scene/>", "<scene/>");
		submit_answer(client);
	}
	assert_true(hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (d->count == 0)
		attend(worker, d);
	struct batch b = black_batch(&d->keys[0], &plan);
	assert_int_equal(batch_pack(&b, &plan, frame, size, &e), 0);
	batch_fini(&b);
	return worker;
}

/* It takes longer than anybody may be silent, and the worker can say nothing else meanwhile; it is told that it is heard. */
static void a_slow_result_counts(void **state)
{
	(void)state;
	enum { PIECES = 24 };
	unsigned char *frame;
	size_t size, at = 0;
	struct desk d = {.count = 0};
	struct peer *client = call(), *worker = worker_with_result(client, &d, &frame, &size);
	for (size_t i = 1; i <= PIECES; i++) {
		usleep(100000);
		say_bytes(worker, frame + at, size * i / PIECES - at);
		at = size * i / PIECES;
	}
	assert_int_equal(verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	assert_true(worker->heartbeats >= 8 && worker->heartbeats <= 13);
	mem_free(frame);
	hang_up(client);
	hang_up(worker);
}

static void half_a_result_is_no_word(void **state)
{
	(void)state;
	unsigned char *frame;
	size_t size;
	struct desk d = {.count = 0};
	struct peer *client = call(), *worker = worker_with_result(client, &d, &frame, &size);
	say_bytes(worker, frame, size / 2);
	const Farm__Envelope *m;
	while ((m = hear(worker)) && m->body_case != FARM__ENVELOPE__BODY_FAULT)
		continue;
	mem_free(frame);
	hang_up(client);
	hang_up(worker);
}

static void say_extend(const struct peer *p, uint64_t job, uint64_t spp, int times)
{
	unsigned char all[512];
	size_t at = 0;
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
		unsigned char *frame;
		size_t size;
		struct error e;
		assert_int_equal(envelope_pack(&m, NULL, 0, &frame, &size, &e), 0);
		memcpy(all + at, frame, size);
		at += size;
		mem_free(frame);
	}
	say_bytes(p, all, at);
}

static void hear_done(struct peer *p, bool ok, const char *text)
{
	const Farm__Envelope *m = hear(p);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_DONE);
	assert_int_equal(m->done->ok, ok);
	if (!strstr(m->done->text, text))
		fail_msg("'%s' is not in '%s'", text, m->done->text);
}

/* The job that was done before: its films are read beside the loop, and each Extend gets one answer. */
static void extensions_wait_for_films(void **state)
{
	(void)state;
	struct peer *a = call(), *b = call();
	assert_true(hello(a, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	assert_true(hello(b, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	say_extend(a, 2, 0, 1); /* not for that */
	hear_done(a, false, "by what");
	say_extend(a, 2, 8, 3);
	say_extend(b, 2, 8, 1);
	hear_done(a, false, "one extension at a time");
	hear_done(a, false, "one extension at a time");
	hear_done(a, true, "it goes on until");
	hear_done(b, true, "it goes on until"); /* the job lives by then */
	say_extend(a, 1, 8, 1);
	hear_done(a, false, "it is black");
	hang_up(a);
	hang_up(b);
	a = call();
	assert_true(hello(a, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	say_empty(a, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = hear(a);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	assert_false(m->job_list_answer->jobs[1]->ended);
	hang_up(a);
}

static void say_failed(struct peer *p, const struct lease_key *k, const char *text)
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
	say(p, &m, NULL, 0);
}

/* A failure is the scene's, or the worker's; never the connection's, because of letters that a scene's author chose. */
static void a_failure_counts_whatever_its_text(void **state)
{
	(void)state;
	struct peer *client = call(), *worker = call();
	assert_true(hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_true(submit_answer(client)->job);
	assert_true(hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	struct desk d = {.count = 0};
	while (d.count == 0)
		attend(worker, &d);
	say_failed(worker, &d.keys[0], "half a letter \xc3\nof a file");
	say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	usleep(100000);
	say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = hear(client);
	assert_non_null(m);
	for (size_t i = 0; i < m->job_list_answer->n_jobs; i++)
		if (m->job_list_answer->jobs[i]->job == d.keys[0].job)
			assert_non_null(strstr(m->job_list_answer->jobs[i]->why, "scripted: half a letter ? of a file"));
	struct pollfd ready = {worker->fd, POLLIN, 0};
	while (poll(&ready, 1, 200) == 1) /* neither a fault nor the end */
		assert_true(attend(worker, &d) == FARM__VERDICT__VERDICT_NONE && worker->env.message->body_case != FARM__ENVELOPE__BODY_FAULT);
	hang_up(client);
	hang_up(worker);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rubbish_is_hung_up_on),   cmocka_unit_test(stragglers_are_hung_up_on),
		cmocka_unit_test(crowds_are_turned_away), cmocka_unit_test(a_caller_waits_for_memory),
		cmocka_unit_test(the_silent_give_way),  cmocka_unit_test(hello_is_looked_at),
		cmocka_unit_test(submissions_are_looked_at), cmocka_unit_test(a_black_job_ends),
		cmocka_unit_test(strategies_are_counted_once), cmocka_unit_test(what_is_useless_does_not_wait),
		cmocka_unit_test(the_deaf_cost_little),
		cmocka_unit_test(extensions_wait_for_films), /* its job lives again */
		cmocka_unit_test(a_failure_counts_whatever_its_text),
	};
	const struct CMUnitTest slow[] = {cmocka_unit_test(a_slow_result_counts), cmocka_unit_test(half_a_result_is_no_word)};
	int failed = cmocka_run_group_tests(tests, set_up, tear_down);
	return failed + cmocka_run_group_tests(slow, set_up_quick, tear_down);
}
