/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The parts of hslt-submit. scene_files_read reads and checks the scene as a worker will, through a folder that records
 * and hashes each file that is opened. submit_send sends the job; the coordinator answers which files it lacks, and
 * those are hashed again and sent in chunks. submit_wait watches the job and shows its progress until it ends.
 *
 * Failures: a scene that cannot be rendered (the error names file and line), a file that has changed since it was
 * hashed, a refusal with the coordinator's sentence, a lost connection (-ECONNRESET, which may be tried again).
 */
#include "worker/cli/submit/submit.h"

#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/base/progress.h"
#include "common/base/text.h"
#include "common/wire/plan_wire.h"
#include "worker/cli/base/guarded_source.h"

#include <stdio.h>
#include <string.h>

enum { CHUNK_BYTES = 1 << 20 };

/* ---- the scene's files ---- */

/* A folder that records which files were opened, with their hashes. Workers build the world in the same way, so they
 * need exactly these files. One thread. */
struct recorded_folder {
	struct asset_source folder;
	struct scene_files *files;
};

static int add_file(struct scene_files *files, const char *name, const struct asset *a, struct error *e)
{
	for (size_t i = 0; i < files->file_count; i++)
		if (strcmp(files->files[i].name, name) == 0)
			return 0;
	struct scene_file *more = list_grow_array(files->files, files->file_count, sizeof *more);
	char *copy = mem_strdup(name);
	files->files = more ? more : files->files;
	if (!more || !copy) {
		mem_free(copy);
		return error_set(e, ENOMEM, "no memory for the list of files");
	}
	struct scene_file *f = &files->files[files->file_count++];
	f->name = copy;
	f->size = a->size;
	return blob_hash_bytes(a->bytes, a->size, &f->hash, e);
}

static int open_recorded(void *user, const char *name, struct asset *out, struct error *e)
{
	struct recorded_folder *o = user;
	int rc = o->folder.open(o->folder.user, name, out, e);
	if (!rc && (rc = add_file(o->files, name, out, e)))
		o->folder.close(o->folder.user, out);
	return rc;
}

static void close_recorded(void *user, struct asset *a)
{
	struct recorded_folder *o = user;
	o->folder.close(o->folder.user, a);
}

static int copy_notes(struct scene_files *files, const struct scene *s, struct error *e)
{
	files->notes = mem_alloc(s->note_count, sizeof *files->notes);
	for (uint32_t i = 0; files->notes && i < s->note_count; i++) {
		files->notes[i] = mem_strdup(s->notes[i]);
		if (!files->notes[i])
			break;
		files->note_count++;
	}
	return files->note_count == s->note_count && files->notes
		       ? 0
		       : error_set(e, ENOMEM, "no memory for the scene's notes");
}

int scene_files_read(struct scene_files *files, const char *path, struct render_arguments *a,
		     const struct output_files *outputs, struct error *e)
{
	struct scene scene;
	memset(files, 0, sizeof *files);
	int rc = scene_path_split(path, a, &files->folder, &files->scene, e);
	if (rc)
		return rc;
	files->folders = option_folders(a, files->folder);
	struct guarded_source guarded;
	struct recorded_folder opened = {guarded_source(&guarded, asset_source_for_folders(&files->folders), outputs),
					 files};
	struct asset_source assets = {.user = &opened, .open = open_recorded, .close = close_recorded};
	rc = option_scene_read(&scene, &assets, files->scene, a, e);
	if (!rc) {
		rc = scene_append_missing_count(&scene, &assets,
						world_check(&scene, &assets, &a->render, &files->summary, e), e);
		if (!rc)
			rc = copy_notes(files, &scene, e);
		scene_fini(&scene);
	}
	if (rc)
		scene_files_fini(files);
	return rc;
}

void scene_files_fini(struct scene_files *files)
{
	for (size_t i = 0; i < files->file_count; i++)
		mem_free(files->files[i].name);
	for (size_t i = 0; i < files->note_count; i++)
		mem_free(files->notes[i]);
	mem_free(files->files);
	mem_free(files->notes);
	mem_free(files->folder);
	mem_free(files->scene);
	memset(files, 0, sizeof *files);
}

/* ---- sending ---- */

/* The lists of a message, whose texts belong to others. */
struct message_lists {
	Farm__File *files, **file_refs;
	Farm__Define *defines, **define_refs;
	Farm__Effect *effects, **effect_refs;
};

static void lists_fini(struct message_lists *l)
{
	mem_free(l->files);
	mem_free(l->file_refs);
	mem_free(l->defines);
	mem_free(l->define_refs);
	mem_free(l->effects);
	mem_free(l->effect_refs);
}

static int lists_init(struct message_lists *l, const struct submit_request *r, struct scene_files *files,
		      struct error *e)
{
	size_t lines = files->summary.effect_line_count;
	*l = (struct message_lists){mem_alloc(files->file_count, sizeof *l->files),
				    mem_alloc(files->file_count, sizeof *l->file_refs),
				    mem_alloc(r->args->define_count, sizeof *l->defines),
				    mem_alloc(r->args->define_count, sizeof *l->define_refs),
				    mem_alloc(lines, sizeof *l->effects),
				    mem_alloc(lines, sizeof *l->effect_refs)};
	if (!l->files || !l->file_refs || !l->defines || !l->define_refs || !l->effects || !l->effect_refs) {
		lists_fini(l);
		return error_set(e, ENOMEM, "no memory for the submission");
	}
	for (size_t i = 0; i < files->file_count; i++) {
		Farm__File *f = l->file_refs[i] = &l->files[i];
		farm__file__init(f);
		f->name = files->files[i].name;
		f->hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, files->files[i].hash.bytes};
		f->size = files->files[i].size;
	}
	for (size_t i = 0; i < r->args->define_count; i++) {
		Farm__Define *d = l->define_refs[i] = &l->defines[i];
		farm__define__init(d);
		d->name = text_unconst(r->args->defines[i].name);
		d->value = text_unconst(r->args->defines[i].value);
	}
	for (size_t i = 0; i < lines; i++) {
		Farm__Effect *f = l->effect_refs[i] = &l->effects[i];
		farm__effect__init(f);
		f->name = text_unconst(files->summary.effect_lines[i].name);
		f->on = files->summary.effect_lines[i].is_on;
		f->why = files->summary.effect_lines[i].reason;
		f->forced = files->summary.effect_lines[i].is_forced;
		f->saves = text_unconst(files->summary.effect_lines[i].savings);
	}
	return 0;
}

static int wait_for_answer(struct client *cl, struct client_message *answer, struct error *e)
{
	int rc = client_receive(cl, 300, answer, e);
	if (!rc && answer->envelope.message->body_case != FARM__ENVELOPE__BODY_SUBMIT_ANSWER) {
		client_message_fini(answer);
		rc = error_set(e, EPROTO, "the coordinator's answer is not to the submission");
	}
	return rc;
}

static int send_submit(struct client *cl, const struct submit_request *r, struct scene_files *files, struct error *e)
{
	struct message_lists l;
	char camera[RENDER_CAMERA_TEXT_MAX];
	Farm__Submit s;
	Farm__PlanRequest plan;
	int rc = lists_init(&l, r, files, e);
	if (rc)
		return rc;
	farm__submit__init(&s);
	plan_request_to_wire(&r->args->plan, &plan);
	s.name = text_unconst(r->name);
	s.scene = files->scene;
	s.n_defines = r->args->define_count;
	s.defines = l.define_refs;
	s.render_width = r->args->render.width;
	s.render_height = r->args->render.height;
	s.plan = &plan;
	s.priority = r->priority;
	render_camera_text(&files->summary, camera, sizeof camera);
	s.camera = camera;
	char *paths[OPTION_PATHS_MAX];
	for (size_t i = 0; i < r->args->path_count; i++)
		paths[i] = text_unconst(r->args->paths[i]);
	s.n_paths = r->args->path_count;
	s.paths = paths;
	s.brightest = files->summary.brightness_bound;
	s.n_files = files->file_count;
	s.files = l.file_refs;
	s.n_effects = files->summary.effect_line_count;
	s.effects = l.effect_refs;
	s.n_notes = files->note_count;
	s.notes = files->notes;
	s.output = text_unconst(r->output);
	s.mixed = r->is_mixed;
	s.verify = r->verify_fraction;
	rc = client_send(cl, ENVELOPE_OF(SUBMIT, submit, &s), NULL, 0, e);
	lists_fini(&l);
	return rc;
}

static const struct scene_file *find_file_by_hash(const struct scene_files *files, const ProtobufCBinaryData *hash)
{
	for (size_t i = 0; i < files->file_count; i++)
		if (hash->len == BLOB_HASH_SIZE && memcmp(hash->data, files->files[i].hash.bytes, BLOB_HASH_SIZE) == 0)
			return &files->files[i];
	return NULL;
}

static int send_chunk(struct client *cl, const struct scene_file *f, uint64_t offset, const void *bytes, size_t size,
		      struct error *e)
{
	struct blob_hash hash = f->hash;
	return client_send(cl,
			   ENVELOPE(BLOB_CHUNK, blob_chunk, .hash = {BLOB_HASH_SIZE, hash.bytes}, .offset = offset,
				    .size = f->size),
			   bytes, size, e);
}

/* Opens a file as when the scene was read, below the scene's folder or one of --path, and sends it only if it still has
 * the hash of that time. */
static int send_file(struct client *cl, const struct scene_files *files, const struct scene_file *f, struct error *e)
{
	struct asset_source folder = asset_source_for_folders(&files->folders);
	struct asset a;
	struct blob_hash hash;
	int rc = folder.open(folder.user, f->name, &a, e);
	if (rc)
		return client_local_error(rc);
	rc = blob_hash_bytes(a.bytes, a.size, &hash, e);
	if (!rc && !blob_hash_equal(&hash, &f->hash))
		rc = error_set(e, EIO, "%s has changed meanwhile", f->name);
	size_t offset = 0;
	do {
		size_t n = a.size - offset < CHUNK_BYTES ? a.size - offset : CHUNK_BYTES;
		if (!rc)
			rc = send_chunk(cl, f, offset, a.bytes + offset, n, e);
		offset += n;
	} while (!rc && offset < a.size);
	folder.close(folder.user, &a);
	return rc;
}

static int send_missing(struct client *cl, const struct scene_files *files, const Farm__SubmitAnswer *a,
			struct error *e)
{
	int rc = 0;
	for (size_t i = 0; !rc && i < a->n_missing; i++) {
		const struct scene_file *f = find_file_by_hash(files, &a->missing[i]);
		rc = f ? send_file(cl, files, f, e)
		       : error_set(e, EPROTO, "the coordinator asks for a file that is not ours");
	}
	return rc;
}

int submit_send(struct client *cl, const struct submit_request *r, const struct scene_files *source_files,
		struct submitted_job *job, char *plan_text, size_t plan_size, struct error *e)
{
	struct scene_files files = *source_files; /* texts in messages are not const */
	struct client_message answer = {0};
	int rc = send_submit(cl, r, &files, e);
	if (!rc)
		rc = wait_for_answer(cl, &answer, e);
	if (!rc && answer.envelope.message->submit_answer->n_missing) {
		rc = send_missing(cl, &files, answer.envelope.message->submit_answer, e);
		client_message_fini(&answer);
		if (!rc)
			rc = wait_for_answer(cl, &answer, e);
	}
	if (rc)
		return rc;
	const Farm__SubmitAnswer *a = answer.envelope.message->submit_answer;
	if (a->job == 0)
		rc = error_set(e, EACCES, "the coordinator refuses the job: %s", a->refusal);
	*job = (struct submitted_job){a->job, a->submitted};
	text_copy(plan_text, plan_size, a->plan);
	client_message_fini(&answer);
	return rc;
}

/* ---- waiting ---- */

/* Prints a text such as "120 k/s, 31 min left (25 min - 40 min), error 3.2 %, halved in 12 min". */
static void describe_progress(const Farm__JobStatus *s, const char *rate, char *text, size_t size)
{
	char eta[32], low[32], high[32] = "?", range[80] = "", error[80] = "";
	progress_format_duration(s->eta, eta, sizeof eta);
	if (s->eta_low >= 0 && (s->eta_low < s->eta || s->eta_high != s->eta)) {
		progress_format_duration(s->eta_low, low, sizeof low);
		if (s->eta_high >= 0)
			progress_format_duration(s->eta_high, high, sizeof high);
		snprintf(range, sizeof range, " (%s - %s)", low, high);
	}
	if (s->n_looks && s->halving_seconds > 0) {
		progress_format_duration(s->halving_seconds, low, sizeof low);
		snprintf(error, sizeof error, ", error %.3g %%, halved in %s",
			 100 * sqrt(s->looks[s->n_looks - 1]->rel_mse), low);
	}
	snprintf(text, size, "%s/s, %s left%s%s", rate, eta, range, error);
}

static void show_status(struct progress *p, const Farm__JobStatus *s)
{
	char rate[32], detail[512];
	progress_format_number(s->rate, rate, sizeof rate);
	if (*s->why)
		snprintf(detail, sizeof detail, "%s", s->why);
	else if (s->ended || s->eta < 0)
		snprintf(detail, sizeof detail, "round %llu", (unsigned long long)s->rounds);
	else
		describe_progress(s, rate, detail, sizeof detail);
	progress_explain_decrease(p, s->progress, s->state, detail, sizeof detail);
	progress_show(p, s->progress, s->state, detail);
}

static void copy_looks(const Farm__JobStatus *s, struct submit_outcome *outcome)
{
	outcome->cpu_seconds = s->cpu_seconds;
	outcome->bootstrap_cpu_seconds = s->bootstrap_cpu_seconds;
	outcome->bootstrap_seconds = s->bootstrap_seconds;
	outcome->looks.count = 0;
	for (size_t i = 0; i < s->n_looks; i++) {
		struct forecast_look l = {.is_doubtful = s->looks[i]->doubtful != 0};
		FORECAST_COPY_LOOK(&l, s->looks[i]);
		forecast_add_look(&outcome->looks, &l);
	}
}

/* Shows a status and stores its contents in *outcome. *ended: the job has ended. */
static int apply_status(struct progress *p, const Farm__JobStatus *s, const struct submitted_job *job,
			struct submit_outcome *outcome, bool *ended, struct error *e)
{
	if (s->submitted != job->submitted_at)
		return error_set(e, ESTALE, "j%llu is another job now, '%s': the coordinator uses another spool",
				 (unsigned long long)job->job, s->name);
	show_status(p, s);
	*ended = s->ended;
	copy_looks(s, outcome);
	outcome->exit_code = s->exit_code;
	outcome->has_result = s->fetchable;
	text_copy(outcome->state, sizeof outcome->state, s->state);
	text_copy(outcome->reason, sizeof outcome->reason, s->why);
	text_copy(outcome->note, sizeof outcome->note, s->note);
	return 0;
}

int submit_wait(struct client *cl, const struct submitted_job *job, struct submit_outcome *outcome, struct error *e)
{
	struct progress p;
	int rc = client_send(cl, ENVELOPE(WATCH, watch, .job = job->job), NULL, 0, e);
	bool ended = false;
	progress_begin(&p);
	while (!rc && !ended) {
		struct client_message message;
		rc = client_receive(cl, -1, &message, e);
		if (rc)
			break;
		const Farm__Envelope *envelope = message.envelope.message;
		if (envelope->body_case == FARM__ENVELOPE__BODY_JOB_STATUS)
			rc = apply_status(&p, envelope->job_status, job, outcome, &ended, e);
		client_message_fini(&message);
	}
	progress_end(&p);
	return rc;
}
