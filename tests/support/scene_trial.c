/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/scene_trial.h"

#include "worker/render/render.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

enum { CPU_SECONDS = 20 };

/* "glass.xml:12: " */
static bool has_file_and_line(const char *text)
{
	const char *p = strstr(text, ".xml:");
	p = p ? p : strstr(text, ".obj:");
	return p && p[5] >= '1' && p[5] <= '9';
}

static int report_end(enum trial_end end, const char *text)
{
	printf("%s", text);
	fflush(stdout);
	return (int)end;
}

static struct plan make_plan(const struct render_summary *s, const struct integrator_properties *i)
{
	struct plan p = {.kind = i->kind,
			 .width = s->settings.width,
			 .height = s->settings.height,
			 .crop_width = s->settings.width,
			 .crop_height = s->settings.height,
			 .border = s->settings.border,
			 .seed = 3,
			 .groups = 1,
			 .parts = 1,
			 .chains = i->kind == PLAN_CHAINS ? 2 : 0,
			 .bootstrap = 400,
			 .epoch = i->kind == PLAN_CHAINS ? 150 : 1,
			 .rounds = 1,
			 .min_depth = 1,
			 .max_depth = s->settings.max_depth < 8 ? s->settings.max_depth : 8};
	snprintf(p.integrator, sizeof p.integrator, "%s", i->name);
	return p;
}

static int run_lease(const struct world *w, const struct plan *p, enum lease_kind kind, const struct lease_input *in,
		     struct batch *b, struct error *e)
{
	struct lease_key k = {1, kind, 0, 0, 0};
	enum lease_outcome end;
	int rc = render_lease(w, p, &k, in, NULL, &end, b, e);
	return rc ? rc : batch_check(b, p, e);
}

static int render_with_integrator(const struct world *w, const struct render_summary *s,
				  const struct integrator_properties *i, struct error *e)
{
	struct plan p = make_plan(s, i);
	if (i->has_mutations && render_canonical_mutations(NULL, s, p.mutations, e))
		return -1;
	if (plan_check(&p, e))
		return -1;
	struct batch b;
	if (i->kind == PLAN_SAMPLES)
		return run_lease(w, &p, LEASE_RENDER, NULL, &b, e);
	if (run_lease(w, &p, LEASE_BOOTSTRAP, NULL, &b, e))
		return -1;
	uint64_t seeds[2] = {0, 0}, n = 0;
	for (uint64_t k = 0; k < b.weight_count && n < 2; k++)
		if (b.weights[k] > 0)
			seeds[n++] = k;
	const struct lease_input in = {.chain_count = 2, .seeds = seeds};
	return n < 2 ? 0 : run_lease(w, &p, LEASE_RENDER, &in, &b, e);
}

static int try_in_child(const struct memory_file *files)
{
	struct rlimit cpu = {CPU_SECONDS, CPU_SECONDS};
	setrlimit(RLIMIT_CPU, &cpu);
	struct asset_source assets = memory_assets(files);
	struct render_options o = {.max_depth = 0};
	struct error e = {""};
	struct scene s;
	struct world *w;
	struct render_summary summary;
	int rc = scene_read(&s, &assets, files[0].name, render_plugins(), NULL, 0, &e);
	if (!rc)
		rc = world_check(&s, &assets, &o, &summary, &e);
	if (rc)
		return report_end(has_file_and_line(e.text) ? TRIAL_REFUSED : TRIAL_REFUSED_WITHOUT_PLACE, e.text);
	o.width = o.height = 24; /* a larger film costs only memory, and its numbers have been checked already */
	if (world_new(&w, &s, &assets, &o, &e))
		return report_end(TRIAL_FAILED, e.text);
	world_summary(w, &summary);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const struct integrator_properties *integrator = render_integrator_at(i);
		bool is_unsupported =
			(integrator->is_camera_only ? summary.has_beam : summary.has_rolling_shutter) ||
			(integrator->must_end_on_emitter && render_effect_is_on(&summary, "medium-light"));
		if (!is_unsupported && render_with_integrator(w, &summary, integrator, &e))
			return report_end(TRIAL_FAILED, e.text);
	}
	return TRIAL_RENDERED;
}

int scene_trial_run(const struct memory_file *files, char *text, size_t size)
{
	int pipes[2];
	assert_int_equal(pipe(pipes), 0);
	fflush(stdout);
	pid_t pid = fork();
	assert_true(pid >= 0);
	if (pid == 0) {
		signal(SIGABRT, SIG_DFL);
		signal(SIGFPE, SIG_DFL);
		signal(SIGSEGV, SIG_DFL);
		dup2(pipes[1], 1);
		dup2(pipes[1], 2);
		_exit(try_in_child(files));
	}
	close(pipes[1]);
	size_t used = 0;
	for (ssize_t n; used + 1 < size && (n = read(pipes[0], text + used, size - 1 - used)) > 0;)
		used += (size_t)n;
	text[used] = 0;
	close(pipes[0]);
	int status;
	assert_int_equal(waitpid(pid, &status, 0), pid);
	return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}
