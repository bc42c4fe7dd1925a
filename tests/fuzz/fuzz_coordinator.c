/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whole conversations with a live coordinator: workers, clients and strangers that send arbitrary messages, and readers
 * of the status. A speaker with a role says hello before the script's messages. The coordinator starts anew when an
 * input has stored something.
 */
#include "common/base/mem.h"
#include "common/wire/batch_wire.h"
#include "tests/fuzz/farm_world.h"
#include "tests/fuzz/messages.h"
#include "tests/fuzz/seeds.h"

#include <stdio.h>
#include <string.h>

enum speaker { WORKER_ONE, WORKER_TWO, CLIENT_ONE, CLIENT_TWO, STRANGER, READER, WORKER_THREE, ONE_HANGS_UP, SPEAKERS };

enum { WORLD_INPUTS_MAX = 200 /* inputs after which the world starts anew, because their blobs stay in the spool */ };

static struct {
	struct farm_world *world;
	unsigned inputs;
	uint64_t stored;
} coordinator_state;

static uint64_t stored_sum(const struct server *s)
{
	uint64_t sum = s->jobs.ended_job_count;
	for (const struct live_job *job = s->jobs.live_jobs; job; job = job->next)
		sum += 1000003 + (job->journal ? journal_bytes(job->journal) : 0);
	return sum;
}

static void run_step(struct farm_world *w, const struct step *s)
{
	unsigned speaker = s->speaker % SPEAKERS;
	if (speaker == ONE_HANGS_UP) {
		farm_world_disconnect(w, s->header_size ? *s->header % FARM_WORLD_PEERS : 0);
		farm_world_run_once(w);
		return;
	}
	if (w->peers[speaker].fd < 0) {
		farm_world_connect(w, speaker, speaker == READER);
		bool is_worker = speaker <= WORKER_TWO || speaker == WORKER_THREE;
		if (is_worker || speaker <= CLIENT_TWO)
			farm_world_send_hello(w, speaker,
					      is_worker ? FARM__ROLE__ROLE_WORKER : FARM__ROLE__ROLE_CLIENT);
	}
	if (speaker == READER) {
		farm_world_send_bytes(w, speaker, s->header, s->header_size);
		farm_world_send_bytes(w, speaker, s->payload, s->payload_size);
	} else {
		farm_world_send_step(w, speaker, s);
	}
	farm_world_run_once(w);
	for (unsigned i = 0; i < FARM_WORLD_PEERS; i++)
		farm_world_drain(w, i);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct step steps[SCRIPT_STEPS];
	if (!coordinator_state.world) {
		coordinator_state.world = farm_world_new();
		coordinator_state.inputs = 0;
		coordinator_state.stored = stored_sum(coordinator_state.world->server);
	}
	size_t count = script_read(bytes, size, steps);
	for (size_t i = 0; i < count; i++)
		run_step(coordinator_state.world, &steps[i]);
	farm_world_settle(coordinator_state.world);
	if (++coordinator_state.inputs == WORLD_INPUTS_MAX ||
	    stored_sum(coordinator_state.world->server) != coordinator_state.stored) {
		farm_world_free(coordinator_state.world);
		coordinator_state.world = NULL;
	}
	return 0;
}

size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t max_size, unsigned seed)
{
	return script_mutate(bytes, size, max_size, seed, SPEAKERS);
}

/* ---- seeds ---- */

static void add_result_with_light(struct seed *s, uint8_t who, struct lease_key k, float light)
{
	struct plan plan = farm_world_make_plan(k.job);
	struct batch b = farm_world_make_batch(&k, &plan);
	if (b.tile_count)
		b.tiles[0].xyz[0] = light;
	unsigned char *frame;
	size_t size;
	struct error e;
	struct envelope env;
	if (batch_pack(&b, &plan, &frame, &size, &e) == 0) {
		size_t header = (size_t)frame[2] << 8 | frame[3];
		if (envelope_unpack(&env, frame + FRAME_PREFIX_SIZE, header, &e) == 0) {
			seed_add_message(s, who, env.message, frame + FRAME_PREFIX_SIZE + header,
					 size - FRAME_PREFIX_SIZE - header);
			envelope_fini(&env);
		}
		mem_free(frame);
	}
	batch_fini(&b);
}

static void add_result(struct seed *s, uint8_t who, struct lease_key k)
{
	add_result_with_light(s, who, k, 0.01f);
}

static void add_requests(struct seed *s, uint8_t who, uint64_t job)
{
	Farm__LeaseRequest r;
	farm__lease_request__init(&r);
	Farm__JobGet g;
	farm__job_get__init(&g);
	r.want = 4;
	g.job = job;
	SEED_SAY(s, who, LEASE_REQUEST, lease_request, &r);
	SEED_SAY(s, who, JOB_GET, job_get, &g);
}

/* The results of two workers differ, and a third worker decides. */
static void write_dispute_seed(void)
{
	struct seed s = {0};
	const struct lease_key k = {.job = FARM_JOB_SAMPLES, .kind = LEASE_RENDER};
	add_requests(&s, WORKER_ONE, k.job);
	add_requests(&s, WORKER_TWO, k.job);
	add_result_with_light(&s, WORKER_ONE, k, 0.01f);
	add_result_with_light(&s, WORKER_TWO, k, 7);
	add_requests(&s, WORKER_THREE, k.job);
	add_result_with_light(&s, WORKER_THREE, k, 0.01f);
	seed_write(&s, "dispute", 0);
}

static void write_result_seeds(void)
{
	struct plan p = farm_world_make_plan(FARM_JOB_CHAINS);
	const struct lease_key last = {
		.job = FARM_JOB_CHAINS, .kind = LEASE_RENDER, .group = p.groups - 1, .part = p.parts - 1};
	const struct lease_key keys[] = {
		last,
		{.job = FARM_JOB_BOOTSTRAP, .kind = LEASE_BOOTSTRAP, .group = 1},
		{.job = FARM_JOB_SAMPLES, .kind = LEASE_RENDER},
		{.job = FARM_JOB_CHAINS, .kind = LEASE_RENDER}, /* a repeated result */
	};
	struct seed s = {0};
	for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
		add_requests(&s, WORKER_ONE, keys[i].job);
		add_result(&s, WORKER_ONE, keys[i]);
		seed_write(&s, "result", i);
		add_requests(&s, WORKER_ONE, keys[i].job);
		add_requests(&s, WORKER_TWO, keys[i].job);
		add_result(&s, WORKER_ONE, keys[i]);
		add_result(&s, WORKER_TWO, keys[i]);
		seed_write(&s, "both", i);
	}
	add_requests(&s, WORKER_ONE, last.job); /* until the job ends */
	for (uint64_t epoch = 0; epoch < p.rounds; epoch++) {
		struct lease_key k = last;
		k.epoch = epoch;
		add_result(&s, WORKER_ONE, k);
	}
	seed_write(&s, "end", 0);
	p = farm_world_make_plan(FARM_JOB_BOOTSTRAP);
	add_requests(&s, WORKER_ONE, FARM_JOB_BOOTSTRAP);
	for (uint32_t i = 1; i < p.groups * p.parts; i++)
		add_result(&s, WORKER_ONE,
			   (struct lease_key){.job = FARM_JOB_BOOTSTRAP,
					      .kind = LEASE_BOOTSTRAP,
					      .group = i / p.parts,
					      .part = i % p.parts});
	seed_write(&s, "bootstrap", 0);
}

static void write_client_seeds(void)
{
	for (uint64_t job = 1; job <= FARM_JOB_EXTENDABLE; job++) {
		struct seed s = {0};
		Farm__JobList list;
		farm__job_list__init(&list);
		Farm__WorkerList workers;
		farm__worker_list__init(&workers);
		Farm__Watch watch;
		farm__watch__init(&watch);
		Farm__Fetch fetch;
		farm__fetch__init(&fetch);
		Farm__Control control;
		farm__control__init(&control);
		Farm__Cancel cancel;
		farm__cancel__init(&cancel);
		Farm__Heartbeat beat;
		farm__heartbeat__init(&beat);
		fetch.job = watch.job = control.job = cancel.job = job;
		fetch.what = (Farm__What)(job % 3);
		control.priority = 3;
		control.more_spp = 4;
		SEED_SAY(&s, CLIENT_ONE, HEARTBEAT, heartbeat, &beat);
		SEED_SAY(&s, CLIENT_ONE, JOB_LIST, job_list, &list);
		SEED_SAY(&s, CLIENT_ONE, WORKER_LIST, worker_list, &workers);
		SEED_SAY(&s, CLIENT_TWO, WATCH, watch, &watch);
		SEED_SAY(&s, CLIENT_ONE, FETCH, fetch, &fetch);
		seed_write(&s, "look", job);
		for (int verb = FARM__VERB__VERB_HOLD; verb <= FARM__VERB__VERB_EXTEND; verb++) {
			control.verb = (Farm__Verb)verb;
			SEED_SAY(&s, CLIENT_ONE, CONTROL, control, &control);
		}
		SEED_SAY(&s, CLIENT_ONE, WATCH, watch, &watch);
		SEED_SAY(&s, CLIENT_TWO, CANCEL, cancel, &cancel);
		seed_write(&s, "control", job);
	}
}

static void write_worker_seed(void)
{
	struct seed s = {0};
	Farm__LeaseRequest request;
	farm__lease_request__init(&request);
	Farm__LeaseFailed failed;
	farm__lease_failed__init(&failed);
	Farm__BlobGet blob;
	farm__blob_get__init(&blob);
	Farm__Bye bye;
	farm__bye__init(&bye);
	Farm__Heartbeat beat;
	farm__heartbeat__init(&beat);
	Farm__LeaseKey key;
	char text[] = "no memory";
	struct lease_key k = {.job = FARM_JOB_CHAINS, .kind = LEASE_RENDER, .group = 1};
	lease_key_to_wire(&k, &key);
	request.want = 8;
	failed.key = &key;
	failed.text = text;
	blob.hash = farm_world_make_submission(FARM_JOB_CHAINS)->submit->files[0]->hash;
	SEED_SAY(&s, WORKER_ONE, HEARTBEAT, heartbeat, &beat);
	SEED_SAY(&s, WORKER_ONE, LEASE_REQUEST, lease_request, &request);
	SEED_SAY(&s, WORKER_TWO, LEASE_REQUEST, lease_request, &request);
	SEED_SAY(&s, WORKER_ONE, LEASE_FAILED, lease_failed, &failed);
	SEED_SAY(&s, WORKER_TWO, LEASE_FAILED, lease_failed, &failed);
	SEED_SAY(&s, WORKER_ONE, BLOB_GET, blob_get, &blob);
	SEED_SAY(&s, WORKER_ONE, BYE, bye, &bye);
	seed_write(&s, "worker", 0);
}

static void write_submission_seeds(void)
{
	for (uint64_t job = FARM_JOB_CHAINS; job <= FARM_JOB_SAMPLES; job++) {
		struct seed s = {0};
		struct blob_hash hash;
		struct error e;
		char other[] = "<scene version=\"0.6.0\"/>", name[] = "b.xml";
		const Farm__Envelope *m = farm_world_make_submission(job);
		Farm__File file = *m->submit->files[0], *files[2] = {m->submit->files[0], &file};
		Farm__BlobChunk chunk;
		farm__blob_chunk__init(&chunk);
		blob_hash_bytes(other, strlen(other), &hash, &e);
		file.name = name;
		file.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
		file.size = chunk.size = strlen(other);
		chunk.hash = file.hash;
		m->submit->n_files = 2;
		m->submit->files = files;
		seed_add_message(&s, CLIENT_ONE, m, NULL, 0);
		Farm__Envelope c;
		farm__envelope__init(&c);
		c.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
		c.blob_chunk = &chunk;
		seed_add_message(&s, CLIENT_ONE, &c, other, strlen(other));
		seed_write(&s, "submit", job);
	}
}

static void write_stranger_seeds(void)
{
	for (unsigned role = 0; role < 3; role++) {
		struct seed s = {0};
		Farm__Hello h;
		farm__hello__init(&h);
		char name[] = "n", print[] = "p2";
		h.version = FARM_VERSION;
		h.role = (Farm__Role)role;
		h.name = name;
		h.fingerprint = print;
		h.threads = 2;
		SEED_SAY(&s, STRANGER, HELLO, hello, &h);
		seed_add_raw(&s, READER, "{\"subscribe\":[\"jobs\",\"workers\",\"snapshot\"]}\n");
		seed_write(&s, "hello", role);
	}
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc;
	(void)argv;
	if (!seeds_are_requested())
		return 0;
	write_result_seeds();
	write_dispute_seed();
	write_client_seeds();
	write_worker_seed();
	write_submission_seeds();
	write_stranger_seeds();
	exit(0);
}
