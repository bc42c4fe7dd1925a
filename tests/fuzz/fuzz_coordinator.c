/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whole conversations with a live coordinator: workers, clients and strangers that send arbitrary messages, and readers
 * of the status. A speaker with a role says hello before the script's messages. The coordinator starts anew when an
 * input has stored something.
 */
#include "common/base/mem.h"
#include "common/wire/batch_wire.h"
#include "tests/fuzz/farm.h"
#include "tests/fuzz/messages.h"
#include "tests/fuzz/seeds.h"

#include <stdio.h>
#include <string.h>

enum speaker { WORKER_ONE, WORKER_TWO, CLIENT_ONE, CLIENT_TWO, STRANGER, READER, WORKER_THREE, ONE_HANGS_UP, SPEAKERS };

enum { WORLD_MOST = 200 /* inputs after which the world starts anew, because their blobs stay in the spool */ };

static struct {
	struct farm_world *world;
	unsigned inputs;
	uint64_t stored;
} now;

static uint64_t sum_of_stored(const struct server *s)
{
	uint64_t sum = s->jobs.ended_count;
	for (const struct live_job *job = s->jobs.live; job; job = job->next)
		sum += 1000003 + (job->journal ? journal_bytes(job->journal) : 0);
	return sum;
}

static void take_step(struct farm_world *w, const struct step *s)
{
	unsigned who = s->who % SPEAKERS;
	if (who == ONE_HANGS_UP) {
		farm_hang_up(w, s->header_size ? *s->header % FARM_PEERS : 0);
		farm_turn(w);
		return;
	}
	if (w->peers[who].fd < 0) {
		farm_call(w, who, who == READER);
		bool works = who <= WORKER_TWO || who == WORKER_THREE;
		if (works || who <= CLIENT_TWO)
			farm_hello(w, who, works ? FARM__ROLE__ROLE_WORKER : FARM__ROLE__ROLE_CLIENT);
	}
	if (who == READER) {
		farm_say(w, who, s->header, s->header_size);
		farm_say(w, who, s->payload, s->payload_size);
	} else {
		farm_say_parts(w, who, s);
	}
	farm_turn(w);
	for (unsigned i = 0; i < FARM_PEERS; i++)
		farm_drain(w, i);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct step steps[SCRIPT_STEPS];
	if (!now.world) {
		now.world = farm_world_new();
		now.inputs = 0;
		now.stored = sum_of_stored(now.world->server);
	}
	size_t count = script_read(bytes, size, steps);
	for (size_t i = 0; i < count; i++)
		take_step(now.world, &steps[i]);
	farm_settle(now.world);
	if (++now.inputs == WORLD_MOST || sum_of_stored(now.world->server) != now.stored) {
		farm_world_free(now.world);
		now.world = NULL;
	}
	return 0;
}

size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t room, unsigned seed)
{
	return script_mutate(bytes, size, room, seed, SPEAKERS);
}

/* ---- seeds ---- */

static void say_some(struct seed *s, uint8_t who, struct lease_key k, float light)
{
	struct plan plan = farm_plan(k.job);
	struct batch b = farm_batch(&k, &plan);
	if (b.tile_count)
		b.tiles[0].xyz[0] = light;
	unsigned char *frame;
	size_t size;
	struct error e;
	struct envelope env;
	if (batch_pack(&b, &plan, &frame, &size, &e) == 0) {
		size_t header = (size_t)frame[2] << 8 | frame[3];
		if (envelope_unpack(&env, frame + FRAME_PREFIX, header, &e) == 0) {
			seed_say(s, who, env.message, frame + FRAME_PREFIX + header, size - FRAME_PREFIX - header);
			envelope_fini(&env);
		}
		mem_free(frame);
	}
	batch_fini(&b);
}

static void say_result(struct seed *s, uint8_t who, struct lease_key k)
{
	say_some(s, who, k, 0.01f);
}

static void send_requests(struct seed *s, uint8_t who, uint64_t job)
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
static void write_dispute(void)
{
	struct seed s = {0};
	const struct lease_key k = {.job = FARM_SAMPLES, .kind = LEASE_RENDER};
	send_requests(&s, WORKER_ONE, k.job);
	send_requests(&s, WORKER_TWO, k.job);
	say_some(&s, WORKER_ONE, k, 0.01f);
	say_some(&s, WORKER_TWO, k, 7);
	send_requests(&s, WORKER_THREE, k.job);
	say_some(&s, WORKER_THREE, k, 0.01f);
	seed_end(&s, "dispute", 0);
}

static void write_results(void)
{
	struct plan p = farm_plan(FARM_CHAINS);
	const struct lease_key last = {
		.job = FARM_CHAINS, .kind = LEASE_RENDER, .group = p.groups - 1, .part = p.parts - 1};
	const struct lease_key keys[] = {
		last,
		{.job = FARM_BOOTSTRAP, .kind = LEASE_BOOTSTRAP, .group = 1},
		{.job = FARM_SAMPLES, .kind = LEASE_RENDER},
		{.job = FARM_CHAINS, .kind = LEASE_RENDER}, /* a repeated result */
	};
	struct seed s = {0};
	for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
		send_requests(&s, WORKER_ONE, keys[i].job);
		say_result(&s, WORKER_ONE, keys[i]);
		seed_end(&s, "result", i);
		send_requests(&s, WORKER_ONE, keys[i].job);
		send_requests(&s, WORKER_TWO, keys[i].job);
		say_result(&s, WORKER_ONE, keys[i]);
		say_result(&s, WORKER_TWO, keys[i]);
		seed_end(&s, "both", i);
	}
	send_requests(&s, WORKER_ONE, last.job); /* until the job ends */
	for (uint64_t epoch = 0; epoch < p.rounds; epoch++) {
		struct lease_key k = last;
		k.epoch = epoch;
		say_result(&s, WORKER_ONE, k);
	}
	seed_end(&s, "end", 0);
	p = farm_plan(FARM_BOOTSTRAP);
	send_requests(&s, WORKER_ONE, FARM_BOOTSTRAP);
	for (uint32_t i = 1; i < p.groups * p.parts; i++)
		say_result(&s, WORKER_ONE,
			   (struct lease_key){.job = FARM_BOOTSTRAP,
					      .kind = LEASE_BOOTSTRAP,
					      .group = i / p.parts,
					      .part = i % p.parts});
	seed_end(&s, "bootstrap", 0);
}

static void write_words(void)
{
	for (uint64_t job = 1; job <= FARM_ENDED; job++) {
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
		seed_end(&s, "look", job);
		for (int verb = FARM__VERB__VERB_HOLD; verb <= FARM__VERB__VERB_EXTEND; verb++) {
			control.verb = (Farm__Verb)verb;
			SEED_SAY(&s, CLIENT_ONE, CONTROL, control, &control);
		}
		SEED_SAY(&s, CLIENT_ONE, WATCH, watch, &watch);
		SEED_SAY(&s, CLIENT_TWO, CANCEL, cancel, &cancel);
		seed_end(&s, "control", job);
	}
}

static void write_worker(void)
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
	struct lease_key k = {.job = FARM_CHAINS, .kind = LEASE_RENDER, .group = 1};
	lease_key_to_wire(&k, &key);
	request.want = 8;
	failed.key = &key;
	failed.text = text;
	blob.hash = farm_submission(FARM_CHAINS)->submit->files[0]->hash;
	SEED_SAY(&s, WORKER_ONE, HEARTBEAT, heartbeat, &beat);
	SEED_SAY(&s, WORKER_ONE, LEASE_REQUEST, lease_request, &request);
	SEED_SAY(&s, WORKER_TWO, LEASE_REQUEST, lease_request, &request);
	SEED_SAY(&s, WORKER_ONE, LEASE_FAILED, lease_failed, &failed);
	SEED_SAY(&s, WORKER_TWO, LEASE_FAILED, lease_failed, &failed);
	SEED_SAY(&s, WORKER_ONE, BLOB_GET, blob_get, &blob);
	SEED_SAY(&s, WORKER_ONE, BYE, bye, &bye);
	seed_end(&s, "worker", 0);
}

static void write_submission(void)
{
	for (uint64_t job = FARM_CHAINS; job <= FARM_SAMPLES; job++) {
		struct seed s = {0};
		struct blob_hash hash;
		struct error e;
		char other[] = "<scene version=\"0.6.0\"/>", name[] = "b.xml";
		const Farm__Envelope *m = farm_submission(job);
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
		seed_say(&s, CLIENT_ONE, m, NULL, 0);
		Farm__Envelope c;
		farm__envelope__init(&c);
		c.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
		c.blob_chunk = &chunk;
		seed_say(&s, CLIENT_ONE, &c, other, strlen(other));
		seed_end(&s, "submit", job);
	}
}

static void write_strangers(void)
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
		seed_raw(&s, READER, "{\"subscribe\":[\"jobs\",\"workers\",\"snapshot\"]}\n");
		seed_end(&s, "hello", role);
	}
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc;
	(void)argv;
	if (!seeds_wanted())
		return 0;
	write_results();
	write_dispute();
	write_words();
	write_worker();
	write_submission();
	write_strangers();
	exit(0);
}
