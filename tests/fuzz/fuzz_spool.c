/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator that starts on a damaged spool. The first byte says which file is damaged and how: the file's whole
 * content, changes at some places, or content behind valid checksums. The coordinator may refuse to start, begin a job
 * anew or fail it; if it starts, it must answer.
 */
#include "common/base/mem.h"
#include "common/base/checked_file.h"
#include "common/wire/batch_wire.h"
#include "coordinator/store/journal.h"
#include "coordinator/store/ledger.h"
#include "proto/stored.pb-c.h"
#include "tests/fuzz/farm.h"
#include "tests/fuzz/folders.h"
#include "tests/fuzz/seeds.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum what {
	RECORD,
	JOURNAL,
	JOURNAL_CHANGED,
	JOURNAL_BODIES,
	CHECKPOINT_CHANGED,
	CHECKPOINT_BODY,
	DATABASE_CHANGED,
	SUBMISSION,
	ASIDE,
	OLD_ROW,
	WHATS
};
enum { EDIT = 4, EDITS_MOST = 32, SEED_MOST = 16000, FILE_MOST = 1 << 20 };

static uint8_t file[FILE_MOST];

static size_t load(const char *path)
{
	FILE *f = fopen(path, "rb");
	size_t n = f ? fread(file, 1, sizeof file, f) : 0;
	if (f)
		fclose(f);
	return n;
}

static void write_file(const char *path, const void *bytes, size_t size)
{
	FILE *f = fopen(path, "wb");
	if (!f || fwrite(bytes, 1, size, f) != size || fclose(f))
		abort();
}

static void path_in(const char *spool, const char *name, char path[512])
{
	snprintf(path, 512, "%s/%s", spool, name);
}

/* The path of the journal of the job in its bootstrap, which has no checkpoint yet. */
static void journal_path(const char *spool, char path[512])
{
	snprintf(path, 512, "%s/jobs/j%d/journal.0", spool, FARM_BOOTSTRAP);
}

/* Each edit: u24 BE position, one byte to xor. */
static void apply_edits(const uint8_t *edits, size_t size, uint8_t *bytes, size_t count)
{
	for (size_t i = 0; i + EDIT <= size && i < EDIT * EDITS_MOST && count; i += EDIT) {
		size_t at = (size_t)edits[i] << 16 | (size_t)edits[i + 1] << 8 | edits[i + 2];
		bytes[at % count] ^= edits[i + 3];
	}
}

static void change_file(const char *path, const uint8_t *edits, size_t size)
{
	size_t n = load(path);
	apply_edits(edits, size, file, n);
	write_file(path, file, n);
}

static void write_checked(const char *path, const void *bytes, size_t size)
{
	struct checked_file s;
	struct error e;
	unlink(path);
	if (checked_file_create(&s, path, &e) || checked_file_write(&s, bytes, size, &e) || checked_file_finish(&s, &e))
		abort();
	checked_file_close(&s);
}

/* Each record: kind, u16 BE size, body. */
static void write_journal(const char *spool, const uint8_t *bytes, size_t size)
{
	char path[512], folder[512];
	struct journal *j;
	struct error e;
	journal_path(spool, path);
	unlink(path);
	snprintf(folder, sizeof folder, "%s/jobs/j%d", spool, FARM_BOOTSTRAP);
	if (journal_create(&j, folder, FARM_BOOTSTRAP, 0, &e))
		abort();
	while (size > 3) {
		size_t n = (size_t)bytes[1] << 8 | bytes[2];
		n = n < size - 3 ? n : size - 3;
		journal_append(j, (enum journal_kind)(*bytes % 5), NULL, *bytes, bytes + 3, n, NULL, &e);
		bytes += 3 + n;
		size -= 3 + n;
	}
	journal_release(j);
}

/* Writes the submission and plan of a new job, as the database would hold them; the first two bytes say where the first
 * one ends. */
static void write_submission(const char *spool, const uint8_t *bytes, size_t size)
{
	struct ledger *l;
	struct error e;
	size_t first = size < 2 ? 0 : (size_t)bytes[0] << 8 | bytes[1];
	if (size < 2)
		return;
	bytes += 2;
	size -= 2;
	first = first < size ? first : size;
	struct ledger_job job = {.id = 9,
				 .owner = "",
				 .name = "n",
				 .version = "1",
				 .record = "",
				 .submitted = 1,
				 .submission = bytes,
				 .submission_size = first,
				 .plan = bytes + first,
				 .plan_size = size - first};
	if (ledger_open(&l, spool, &e))
		abort();
	ledger_add(l, &job, &e);
	ledger_close(l);
}

static void damage(const char *spool, enum what what, const uint8_t *bytes, size_t size)
{
	char path[512];
	size_t n;
	switch (what) {
	case RECORD: /* of a job that an earlier version finished */
		path_in(spool, "jobs/j7", path);
		mkdir(path, 0777);
		path_in(spool, "jobs/j7/job.json", path);
		write_file(path, bytes, size);
		break;
	case OLD_ROW:
		path_in(spool, "jobs/j7", path);
		mkdir(path, 0777);
		path_in(spool, "jobs/j7/order", path);
		write_checked(path, bytes, size);
		break;
	case JOURNAL:
		journal_path(spool, path);
		write_file(path, bytes, size);
		break;
	case JOURNAL_CHANGED:
		journal_path(spool, path);
		change_file(path, bytes, size);
		break;
	case JOURNAL_BODIES:
		write_journal(spool, bytes, size);
		break;
	case CHECKPOINT_CHANGED:
		path_in(spool, "jobs/j2/checkpoint", path);
		n = load(path);
		if (n < 4)
			abort();
		apply_edits(bytes, size, file, n - 4);
		write_checked(path, file, n - 4);
		break;
	case CHECKPOINT_BODY:
		path_in(spool, "jobs/j2/checkpoint", path);
		write_checked(path, bytes, size);
		break;
	case DATABASE_CHANGED:
		path_in(spool, "jobs.db", path);
		change_file(path, bytes, size);
		break;
	case ASIDE:
		path_in(spool, "aside", path);
		write_file(path, bytes, size);
		break;
	default:
		write_submission(spool, bytes, size);
	}
}

static void send_requests(struct farm_world *w)
{
	Farm__JobList list;
	Farm__LeaseRequest request;
	Farm__Envelope m;
	farm__job_list__init(&list);
	farm__lease_request__init(&request);
	farm__envelope__init(&m);
	farm_call(w, 0, false);
	farm_hello(w, 0, FARM__ROLE__ROLE_CLIENT);
	m.body_case = FARM__ENVELOPE__BODY_JOB_LIST;
	m.job_list = &list;
	farm_say_message(w, 0, &m, NULL, 0);
	farm_call(w, 1, false);
	farm_hello(w, 1, FARM__ROLE__ROLE_WORKER);
	request.want = 20;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_REQUEST;
	m.lease_request = &request;
	farm_say_message(w, 1, &m, NULL, 0);
	farm_turn(w);
	if (w->peers[0].fd < 0)
		abort();
	farm_settle(w);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct farm_world w = {0};
	struct error e;
	if (!size)
		return 0;
	snprintf(w.spool, sizeof w.spool, "%s/damaged", folders_base());
	farm_spool_copy(w.spool);
	damage(w.spool, (enum what)(*bytes % WHATS), bytes + 1, size - 1);
	if (farm_world_open(&w, &e) == 0) {
		send_requests(&w);
		farm_world_close(&w);
	}
	folders_remove(w.spool);
	return 0;
}

/* ---- seeds ---- */

static uint8_t seed[FILE_MOST];

static void write_seed(enum what what, size_t size)
{
	seed[0] = (uint8_t)what;
	seed_file("spool", what, seed, size + 1);
}

static size_t seeded;

static int add_record(void *user, const struct journal_item *item, struct error *e)
{
	size_t size = item->size;
	(void)user;
	(void)e;
	if (item->missing || size > 0xffff || seeded + 3 + size > sizeof seed - 1)
		return 0;
	uint8_t *at = seed + 1 + seeded;
	at[0] = (uint8_t)item->kind;
	at[1] = (uint8_t)(size >> 8);
	at[2] = (uint8_t)size;
	memcpy(at + 3, item->body, size);
	seeded += 3 + size;
	return 0;
}

static size_t take_file(const char *path)
{
	size_t n = load(path);
	memcpy(seed + 1, file, n);
	return n;
}

/* Writes the files that an earlier version kept of such a job, as j7. */
static void write_old_seeds(const struct ledger_job *job)
{
	Stored__Row m;
	struct job_record *r = mem_alloc(1, sizeof *r);
	char *text;
	struct error e;
	stored__row__init(&m);
	m.id = 7;
	m.submission = (ProtobufCBinaryData){job->submission_size, file};
	m.plan = (ProtobufCBinaryData){job->plan_size, file + job->submission_size};
	memcpy(file, job->submission, job->submission_size);
	memcpy(file + job->submission_size, job->plan, job->plan_size);
	memcpy(seed + 1, "hsltO003", 8);
	write_seed(OLD_ROW, 8 + stored__row__pack(&m, seed + 9));
	if (!r)
		abort();
	record_begin(r, 7, "n", "");
	strcpy(r->state, "done");
	if (record_to_json(r, &text, &e))
		abort();
	memcpy(seed + 1, text, strlen(text));
	write_seed(RECORD, strlen(text));
	mem_free(text);
	mem_free(r);
}

static void write_seeds(const char *spool)
{
	static const char aside[] =
		"{\"schema\":1,\"workers\":[{\"certificate\":\"\",\"name\":\"w1-0\",\"home\":\"h\",\"restarts\":2,\"why\":\"x\"}]}";
	memcpy(seed + 1, aside, sizeof aside - 1);
	write_seed(ASIDE, sizeof aside - 1);
	char path[512], folder[512];
	struct journal *j;
	struct ledger *l;
	struct ledger_job job;
	struct error e;
	struct journal_found found;
	path_in(spool, "jobs/j2/checkpoint", path);
	size_t n = take_file(path);
	if (n < 4)
		abort(); /* the world has no checkpoint */
	write_seed(CHECKPOINT_BODY, n - 4 < SEED_MOST ? n - 4 : SEED_MOST);
	journal_path(spool, path);
	write_seed(JOURNAL, take_file(path));
	for (int i = 0; i < 3; i++) {
		static const enum what changed[] = {JOURNAL_CHANGED, CHECKPOINT_CHANGED, DATABASE_CHANGED};
		memcpy(seed + 1, "\0\0\60\1", EDIT);
		write_seed(changed[i], EDIT);
	}
	snprintf(folder, sizeof folder, "%s/jobs/j%d", spool, FARM_BOOTSTRAP);
	if (journal_open(&j, folder, FARM_BOOTSTRAP, 0, add_record, NULL, &found, &e))
		abort();
	journal_release(j);
	write_seed(JOURNAL_BODIES, seeded);
	if (ledger_open(&l, spool, &e) || ledger_get(l, FARM_BOOTSTRAP, &job, &e) <= 0)
		abort();
	write_old_seeds(&job);
	seed[1] = (uint8_t)(job.submission_size >> 8);
	seed[2] = (uint8_t)job.submission_size;
	memcpy(seed + 3, job.submission, job.submission_size);
	memcpy(seed + 3 + job.submission_size, job.plan, job.plan_size);
	write_seed(SUBMISSION, 2 + job.submission_size + job.plan_size);
	ledger_close(l);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	char spool[128];
	(void)argc;
	(void)argv;
	if (!seeds_wanted())
		return 0;
	snprintf(spool, sizeof spool, "%s/seeds", folders_base());
	farm_spool_copy(spool);
	write_seeds(spool);
	exit(0);
}
