#include "worker/render/render.h"

#include <stdlib.h>
#include <string.h>

static const char letters[] = "abcdefghijklmnopqrstuvwxyz", form[] = "abcdefghijklmnopqrstuvwxyz0123456789";

/* One entry of `length` characters: a name, perhaps a forced form, perhaps a weight. */
static bool is_entry(const char *entry, size_t length)
{
	char text[PLAN_MUTATIONS_MAX];
	memcpy(text, entry, length);
	text[length] = 0;
	char *at = text + strspn(text, letters), *end;
	if (at == text)
		return false;
	if (*at == '@') {
		size_t n = strspn(at + 1, form);
		if (n == 0)
			return false;
		at += 1 + n;
	}
	if (*at != '=')
		return *at == 0;
	double weight = strtod(at + 1, &end);
	return end > at + 1 && *end == 0 && weight > 0 && weight <= 1e9;
}

int render_mutations(const char *text, const struct render_summary *summary, char canonical[PLAN_MUTATIONS_MAX], struct error *e)
{
	(void)summary;
	memset(canonical, 0, PLAN_MUTATIONS_MAX);
	if (!text || !*text)
		return 0;
	if (plan_strategy_count(text) < 0)
		return error_set(e, EINVAL,
				 "'%.200s' is no mixture of mutations: at most %d names with commas between, such as hslt=0.9,independent=0.1",
				 text, PLAN_MAX_STRATEGIES);
	for (const char *at = text; *at; at += *at == ',') {
		size_t n = strcspn(at, ",");
		if (!is_entry(at, n))
			return error_set(e, EINVAL, "'%.*s' in the mixture of mutations is not NAME or NAME=WEIGHT with a weight above 0",
					 (int)n, at);
		at += n;
	}
	memcpy(canonical, text, strlen(text));
	return 0;
}
