/* SPDX-License-Identifier: Apache-2.0 */
#include "common/wire/plan_wire.h"

#include "common/base/text.h"

#include <string.h>

void plan_to_wire(const struct plan *p, Farm__Plan *out)
{
	farm__plan__init(out);
	out->integrator = text_borrow(p->integrator);
	out->kind = (uint32_t)p->kind;
	out->width = p->width;
	out->height = p->height;
	out->crop_x = p->crop_x;
	out->crop_y = p->crop_y;
	out->crop_width = p->crop_width;
	out->crop_height = p->crop_height;
	out->border = p->border;
	out->seed = p->seed;
	out->groups = p->groups;
	out->parts = p->parts;
	out->chains = p->chains;
	out->bootstrap = p->bootstrap;
	out->epoch = p->epoch;
	out->rounds = p->rounds;
	out->seconds = p->seconds;
	out->target_error = p->target_error;
	out->min_depth = p->min_depth;
	out->max_depth = p->max_depth;
	out->mutations = text_borrow(p->mutations);
	out->accuracy = text_borrow(p->accuracy);
	out->effects = text_borrow(p->effects);
}

static int kind_from_wire(uint32_t kind, const char *name, enum plan_kind *out, char integrator[16], struct error *e)
{
	if (kind != PLAN_SAMPLES && kind != PLAN_CHAINS)
		return error_set(e, EBADMSG, "a plan of unknown kind %u", kind);
	if (!envelope_text_ok(name, 15))
		return error_set(e, EBADMSG, "a plan whose integrator has no name of at most 15 bytes");
	*out = (enum plan_kind)kind;
	memset(integrator, 0, 16);
	memcpy(integrator, name, strlen(name));
	return 0;
}

static int mixture_from_wire(const char *text, char mixture[PLAN_MUTATIONS_MAX], struct error *e)
{
	if (strlen(text) >= PLAN_MUTATIONS_MAX || plan_strategy_count(text) < 0)
		return error_set(e, EBADMSG, "a plan whose mixture of mutations is none");
	memset(mixture, 0, PLAN_MUTATIONS_MAX);
	memcpy(mixture, text, strlen(text));
	return 0;
}

static int text_from_wire(const char *text, char *out, size_t size, struct error *e)
{
	size_t n = strlen(text);
	if (n >= size)
		return error_set(e, EBADMSG, "a plan whose settings or effects are a text of %zu bytes", n);
	memset(out, 0, size);
	memcpy(out, text, n);
	return plan_text_ok(out, size) ? 0 : error_set(e, EBADMSG, "a plan whose settings or effects are none");
}

int plan_from_wire(const Farm__Plan *m, struct plan *p, struct error *e)
{
	memset(p, 0, sizeof *p);
	int rc = m ? 0 : error_set(e, EBADMSG, "no plan");
	if (!rc)
		rc = kind_from_wire(m->kind, m->integrator, &p->kind, p->integrator, e);
	if (!rc)
		rc = mixture_from_wire(m->mutations, p->mutations, e);
	if (!rc)
		rc = text_from_wire(m->accuracy, p->accuracy, sizeof p->accuracy, e);
	if (!rc)
		rc = text_from_wire(m->effects, p->effects, sizeof p->effects, e);
	if (rc)
		return rc;
	p->width = m->width;
	p->height = m->height;
	p->crop_x = m->crop_x;
	p->crop_y = m->crop_y;
	p->crop_width = m->crop_width;
	p->crop_height = m->crop_height;
	p->border = m->border;
	p->seed = m->seed;
	p->groups = m->groups;
	p->parts = m->parts;
	p->chains = m->chains;
	p->bootstrap = m->bootstrap;
	p->epoch = m->epoch;
	p->rounds = m->rounds;
	p->seconds = m->seconds;
	p->target_error = m->target_error;
	p->min_depth = m->min_depth;
	p->max_depth = m->max_depth;
	return plan_check(p, e);
}

void plan_request_to_wire(const struct plan_request *r, Farm__PlanRequest *out)
{
	farm__plan_request__init(out);
	out->integrator = text_borrow(r->integrator);
	out->kind = (uint32_t)r->kind;
	out->width = r->width;
	out->height = r->height;
	out->crop_x = r->crop_x;
	out->crop_y = r->crop_y;
	out->crop_width = r->crop_width;
	out->crop_height = r->crop_height;
	out->border = r->border;
	out->seed = r->seed;
	out->spp = r->spp;
	out->mutations = r->mutations;
	out->seconds = r->seconds;
	out->target_error = r->target_error;
	out->min_depth = r->min_depth;
	out->max_depth = r->max_depth;
	out->chains = r->chains;
	out->groups = r->groups;
	out->parts = r->parts;
	out->speed = r->speed;
	out->bootstrap_rays = r->rays.bootstrap;
	out->step_rays = r->rays.step;
	out->bootstrap = r->bootstrap;
	out->epoch = r->epoch;
	out->mixture = text_borrow(r->mixture);
	out->accuracy = text_borrow(r->accuracy);
	out->effects = text_borrow(r->effects);
}

int plan_request_from_wire(const Farm__PlanRequest *m, struct plan_request *r, struct error *e)
{
	memset(r, 0, sizeof *r);
	int rc = m ? 0 : error_set(e, EBADMSG, "no plan request");
	if (!rc)
		rc = kind_from_wire(m->kind, m->integrator, &r->kind, r->integrator, e);
	if (!rc)
		rc = mixture_from_wire(m->mixture, r->mixture, e);
	if (!rc)
		rc = text_from_wire(m->accuracy, r->accuracy, sizeof r->accuracy, e);
	if (!rc)
		rc = text_from_wire(m->effects, r->effects, sizeof r->effects, e);
	if (!rc && !(m->speed >= 0 && m->speed <= PLAN_SPEED_MOST))
		rc = error_set(e, EBADMSG, "a pilot of %g a second", m->speed);
	if (!rc && !(m->bootstrap_rays >= 0 && m->bootstrap_rays < 1e15 && m->step_rays >= 0 && m->step_rays < 1e15))
		rc = error_set(e, EBADMSG, "a pilot of %g and %g rays", m->bootstrap_rays, m->step_rays);
	if (rc)
		return rc;
	r->width = m->width;
	r->height = m->height;
	r->crop_x = m->crop_x;
	r->crop_y = m->crop_y;
	r->crop_width = m->crop_width;
	r->crop_height = m->crop_height;
	r->border = m->border;
	r->seed = m->seed;
	r->spp = m->spp;
	r->mutations = m->mutations;
	r->seconds = m->seconds;
	r->target_error = m->target_error;
	r->min_depth = m->min_depth;
	r->max_depth = m->max_depth;
	r->chains = m->chains;
	r->groups = m->groups;
	r->parts = m->parts;
	r->speed = m->speed;
	r->rays = (struct plan_rays){m->bootstrap_rays, m->step_rays};
	r->bootstrap = m->bootstrap;
	r->epoch = m->epoch;
	return 0;
}

void lease_key_to_wire(const struct lease_key *k, Farm__LeaseKey *out)
{
	farm__lease_key__init(out);
	out->job = k->job;
	out->kind = (uint32_t)k->kind;
	out->group = k->group;
	out->part = k->part;
	out->epoch = k->epoch;
}

int lease_key_from_wire(const Farm__LeaseKey *m, struct lease_key *k, struct error *e)
{
	memset(k, 0, sizeof *k);
	if (!m)
		return error_set(e, EBADMSG, "a lease without a key");
	if (m->kind != LEASE_BOOTSTRAP && m->kind != LEASE_RENDER)
		return error_set(e, EBADMSG, "a lease of unknown kind %u", m->kind);
	*k = (struct lease_key){m->job, (enum lease_kind)m->kind, m->group, m->part, m->epoch};
	return 0;
}
