/* SPDX-License-Identifier: Apache-2.0 */
#include "common/plan/plan_text.h"

#include "common/base/text.h"

#include <stdio.h>
#include <string.h>

static const char *plural_suffix(uint64_t n)
{
	return n == 1 ? "" : "s";
}

void plan_describe(const struct plan *p, char *text, size_t size)
{
	struct text t = {text, size};
	unsigned long long epoch = (unsigned long long)p->epoch, bootstrap = (unsigned long long)p->bootstrap;
	if (p->kind == PLAN_CHAINS)
		text_appendf(
			&t,
			"%s: %u chains in %u group%s, %llu bootstrap samples, epochs of %llu mutation%s per chain in %u lease%s",
			p->integrator, p->chains, p->groups, plural_suffix(p->groups), bootstrap, epoch,
			plural_suffix(epoch), p->groups * p->parts, plural_suffix((uint64_t)p->groups * p->parts));
	else
		text_appendf(&t,
			     "%s: %u group%s, rounds of %llu sample%s per pixel in %u lease%s, scaled by %llu samples",
			     p->integrator, p->groups, plural_suffix(p->groups), p->groups * epoch,
			     plural_suffix(p->groups * epoch), p->groups * p->parts,
			     plural_suffix((uint64_t)p->groups * p->parts), bootstrap);
	if (*p->mutations)
		text_appendf(&t, ", mutations %s", p->mutations);
	if (*p->accuracy)
		text_appendf(&t, ", %s", p->accuracy);
	if (*p->effects)
		text_appendf(&t, ", effects %s", p->effects);
	text_appendf(&t, "; ");
	const char *separator = "";
	if (p->rounds != UINT64_MAX) {
		unsigned long long rounds = (unsigned long long)p->rounds;
		if (p->kind == PLAN_CHAINS)
			text_appendf(&t, "%llu round%s (%llu mutations)", rounds, plural_suffix(rounds),
				     rounds * plan_round_mutations(p));
		else
			text_appendf(&t, "%llu round%s (%llu sample%s per pixel)", rounds, plural_suffix(rounds),
				     rounds * p->groups * p->epoch, plural_suffix(rounds * p->groups * p->epoch));
		separator = " or ";
	}
	if (p->seconds > 0) {
		text_appendf(&t, "%s%g seconds", separator, p->seconds);
		separator = " or ";
	}
	if (p->target_error > 0)
		text_appendf(&t, "%sa relative error of %g", separator, p->target_error);
	text_appendf(&t, "; %ux%u", p->crop_width, p->crop_height);
	if (p->crop_width != p->width || p->crop_height != p->height)
		text_appendf(&t, " at %u,%u of %ux%u", p->crop_x, p->crop_y, p->width, p->height);
	text_appendf(&t, ", paths of %u to %u edges, seed %llu", p->min_depth, p->max_depth,
		     (unsigned long long)p->seed);
}

/* Appends the change from the requested to the planned number of samples or mutations, in the unit of the request. */
static void describe_total(const struct plan_request *r, const struct plan *p, const char *separator, struct text *t)
{
	unsigned long long pixels = (unsigned long long)p->crop_width * p->crop_height;
	unsigned long long planned = p->kind == PLAN_CHAINS ? p->rounds * plan_round_mutations(p)
							    : p->rounds * p->groups * p->epoch * pixels;
	bool by_spp = r->spp && (!r->mutations || r->spp <= r->mutations / pixels);
	if (by_spp && r->spp * pixels != planned)
		text_appendf(t, "%ssamples per pixel %llu -> %.6g: whole rounds", separator, (unsigned long long)r->spp,
			     (double)planned / (double)pixels);
	else if (!by_spp && r->mutations != planned)
		text_appendf(t, "%s%s %llu -> %llu: whole rounds", separator,
			     p->kind == PLAN_CHAINS ? "mutations" : "samples", (unsigned long long)r->mutations,
			     planned);
}

void plan_describe_changes(const struct plan_request *r, const struct plan *p, char *text, size_t size)
{
	struct text t = {text, size};
	if (size)
		text[0] = 0;
	unsigned leases = p->groups * p->parts;
	if (p->kind == PLAN_CHAINS && r->chains && r->chains != p->chains)
		text_appendf(&t, "chains %u -> %u: a multiple of the %u leases of a round", r->chains, p->chains,
			     leases);
	if (r->bootstrap && r->bootstrap != p->bootstrap)
		text_appendf(&t, "%sbootstrap %llu -> %llu: a multiple of the %u leases", *text ? "; " : "",
			     (unsigned long long)r->bootstrap, (unsigned long long)p->bootstrap, leases);
	if (p->rounds != UINT64_MAX)
		describe_total(r, p, *text ? "; " : "", &t);
}

void plan_print_options(const struct plan *p, uint64_t rounds, char *text, size_t size)
{
	struct text t = {text, size};
	rounds += rounds == 0; /* a bootstrap without light ends a job before its first round, whatever the bound */
	text_appendf(
		&t,
		"--integrator %s --size %ux%u --crop %u,%u,%u,%u --seed %llu --min-depth %u --max-depth %u --groups %u",
		p->integrator, p->width, p->height, p->crop_x, p->crop_y, p->crop_width, p->crop_height,
		(unsigned long long)p->seed, p->min_depth, p->max_depth, p->groups);
	if (p->parts != plan_default_parts(p))
		text_appendf(&t, " --parts %u", p->parts);
	if (*p->mutations)
		text_appendf(&t, " --mutations %s", p->mutations);
	if (*p->accuracy)
		text_appendf(&t, " --set %s", p->accuracy);
	if (*p->effects)
		text_appendf(&t, " --effects=%s", p->effects);
	if (p->kind == PLAN_CHAINS)
		text_appendf(&t, " --chains %u --bootstrap %llu --epoch %llu --mutations %llu", p->chains,
			     (unsigned long long)p->bootstrap, (unsigned long long)p->epoch,
			     (unsigned long long)(rounds * plan_round_mutations(p)));
	else
		text_appendf(&t, " --bootstrap %llu --epoch %llu --spp %llu", (unsigned long long)p->bootstrap,
			     (unsigned long long)p->epoch, (unsigned long long)(rounds * p->groups * p->epoch));
}

/* Appends a word, quoted if it has characters that are special to a shell: a=b, 'a=b c'. */
static void append_quoted(struct text *t, const char *word)
{
	static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789@=,.:+-_/%";
	if (*word && strspn(word, plain) == strlen(word)) {
		text_appendf(t, "%s", word);
		return;
	}
	text_appendf(t, "'");
	for (const char *next = word; *next;) {
		size_t n = strcspn(next, "'");
		text_appendf(t, "%.*s%s", (int)n, next, next[n] ? "'\\''" : "");
		next += n + (next[n] != 0);
	}
	text_appendf(t, "'");
}

void plan_print_options_with_scene(const struct plan *p, uint64_t rounds, const struct plan_scene *s, char *text,
				   size_t size)
{
	char word[PLAN_OPTIONS_TEXT_MAX];
	plan_print_options(p, rounds, text, size);
	size_t used = strlen(text);
	struct text t = {text + used, size - used};
	for (size_t i = 0; i < s->define_count; i++) {
		snprintf(word, sizeof word, "%s=%s", s->defines[i].name, s->defines[i].value);
		text_appendf(&t, " -D ");
		append_quoted(&t, word);
	}
	for (size_t i = 0; i < s->path_count; i++) {
		text_appendf(&t, " --path ");
		append_quoted(&t, s->paths[i]);
	}
}
