# SPDX-License-Identifier: Apache-2.0
# Checks the costs of additions that docs/extending.md states: each kind of addition is made to a copy of the tree, its
# lines are counted, and the copy's programs use it.
. "$(dirname "$0")/lib.sh"
need hslt-scene
PYTHON=${PYTHON:-python3}
command -v "$PYTHON" >/dev/null || lacks "no Python"
command -v make >/dev/null && command -v "${CC:-gcc}" >/dev/null || lacks "no compiler"
TREE=$DIR/tree
mkdir -p "$TREE/build" "$TREE/tests"
(cd "$HERE/../.." && cp -a Makefile common coordinator worker proto "$TREE")
cp -a "$BUILD/obj" "$BUILD/gen" "$TREE/build"
cp -a "$TREE" "$DIR/before"

# added FILE: appends stdin to the file. inserted FILE PATTERN: inserts stdin after the first line that matches.
added() {
	cat >>"$TREE/$1"
}
inserted() {
	cat >"$DIR/lines"
	line=$(grep -n "$2" "$TREE/$1" | head -n 1 | cut -d: -f1)
	[ "$line" ] || fail "$1 has no line like $2"
	sed -i "${line}r $DIR/lines" "$TREE/$1"
}

# A BSDF, a shape, a mutation: one new file, and one line of a list.
cat >"$TREE/worker/render/bsdf/half.c" <<'TEXT'
/* SPDX-License-Identifier: Apache-2.0 */
/* Half of the light, in all directions. */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/warp.h"

static spectrum half_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p;
	return spectrum_constant(wo.z > 0 && wi.z > 0 ? 0.5 / WARP_PI : 0);
}

static double half_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p;
	return wo.z > 0 && wi.z > 0 ? wi.z / WARP_PI : 0;
}

static bool half_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	vec3 wi = warp_cosine_hemisphere(u[0], u[1]);
	*out = (struct bsdf_sample){.wi = wi,
				    .mode = BSDF_REFLECT,
				    .pdf = half_pdf(b, p, wo, wi),
				    .f = half_eval(b, p, wo, wi),
				    .eta = 1};
	return wo.z > 0 && wi.z > 0;
}

static int half_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	(void)n, (void)build, (void)e;
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	b->mean_alpha = 1;
	return 0;
}

const struct bsdf_ops bsdf_ops_half = {
	.decl = {PLUGIN_BSDF, "half", NULL, 0, PARAM_UNDERSTOOD},
	.create = half_create,
	.eval = half_eval,
	.pdf_solid = half_pdf,
	.sample = half_sample,
};
TEXT
echo 'BSDF(half)' | added worker/render/bsdf/bsdf_list.h

cat >"$TREE/worker/render/shape/triangle.c" <<'TEXT'
/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	static const vec3 corners[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
	(void)assets;
	if (!mesh_alloc(&out->mesh, 3, 1, true, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	for (uint32_t i = 0; i < 3; i++) {
		mesh_set_vertex(&out->mesh, i, corners[i], (vec3){0, 0, 1}, corners[i].x, corners[i].y);
		out->mesh.index[0][i] = i;
	}
	return 0;
}

SHAPE_OPS(triangle, SHAPE_PARAMS);
TEXT
echo 'SHAPE(triangle)' | added worker/render/shape/shape_list.h

cat >"$TREE/worker/render/mutation/again.c" <<'TEXT'
/* SPDX-License-Identifier: Apache-2.0 */
/* Traces a path anew from the vertex that the heuristic chooses. */
#include "worker/render/mutation/strategy.h"

static const struct strategy strategy = {&heuristic_roughness, STRATEGY_CAMERA, STRATEGY_DRAWN, .moves_halfvecs = false};

const struct mutation_ops mutation_again = {
	.name = "again",
	.summary = "traces a part of the path anew",
	.strategy = &strategy,
	.propose = strategy_propose,
	.log_weight = breakup_log_weight,
};
TEXT
echo 'MUTATION(again)' | added worker/render/mutation/mutation_list.h

# An option: a field and a row, in one file.
echo '	bool quiet;' | inserted coordinator/ctl/hslt_status.c '^struct arguments {'
echo '	{"quiet", 0, NULL, "Print nothing", OPTION_FLAG(struct arguments, quiet)},' |
	inserted coordinator/ctl/hslt_status.c '^static const struct option_row option_rows'

# A message from a client: the message and its number, and the code that answers it.
echo '    Echo echo = 60;' | inserted proto/farm.proto ' Control control = '
echo 'message Echo { string text = 1; }' | added proto/farm.proto
{
	echo '	case FARM__ENVELOPE__BODY_ECHO:'
	echo '		client_send_done(p, NULL, m->echo->text);'
	echo '		break;'
} | inserted coordinator/peers/client.c 'switch (m->body_case) {'

# A counter of a job: a line of the list, its number in stored messages, and the line that counts.
printf '	COUNTER(unique, "unique", NOWHERE) \\\n' | inserted coordinator/core/job_fields.h '#define JOB_FIELDS('
echo '  uint64 unique = 99;' | inserted proto/stored.proto '^message Counts'
echo '		j->counts.unique += v == VERDICT_REPEAT;' | inserted coordinator/core/answer.c 'j->counts.repeats +='

# A field of a job: a line of the list, the line that computes it in the core, and its number in messages to clients.
printf '	NUMBER(u32, slots, IN_RECORD, BY_CORE, "slots", "slots", AT(slots)) \\\n' | inserted coordinator/core/job_fields.h '#define JOB_FIELDS('
echo '		.slots = j->plan.groups * j->plan.parts,' | inserted coordinator/core/status.c '\.priority = j->priority'
echo '  uint32 slots = 99;' | inserted proto/farm.proto '^message JobStatus'

# lines KIND FILES LINES PATHS...: checks the number of changed existing files, and of new lines in them
lines() {
	kind=$1 files=$2 count=$3
	shift 3
	(cd "$DIR" && diff -rU0 -x build $(printf 'before/%s ' "$1") "tree/$1") >"$DIR/diff" 2>/dev/null || :
	f=$(grep -c '^+++ ' "$DIR/diff") n=$(grep -c '^+[^+]' "$DIR/diff")
	[ "$f $n" = "$files $count" ] || fail "$kind: $f files and $n lines, not $files and $count"
	echo "$kind: $files existing files, $count lines"
}
lines "a BSDF" 1 1 worker/render/bsdf
lines "a shape" 1 1 worker/render/shape
lines "a mutation" 1 1 worker/render/mutation
lines "an option" 1 2 coordinator/ctl
(cd "$DIR" && diff -rqx build before/worker/render tree/worker/render | grep -c '^Only in tree') >"$DIR/new" || :
[ "$(cat "$DIR/new")" = 3 ] || fail "$(cat "$DIR/new") new files, not 3"
lines "a counter and a field of a job, in the coordinator" 3 4 coordinator/core
lines "a message, in the coordinator" 1 3 coordinator/peers
lines "a message and a field, on the wire" 1 3 proto/farm.proto
lines "a counter, in stored messages" 1 1 proto/stored.proto

# Built without optimisation: the new code must run, not be fast. The environment may contain variables of the tests'
# own build, and of a make that runs this test.
env -u MAKEFLAGS -u MAKELEVEL make -s -C "$TREE" -j2 BUILD=build OPT=-O0 programs >"$DIR/make.log" 2>&1 || fail "$(grep -m 3 error "$DIR/make.log")"
BIN=$TREE/build/bin
cat >"$DIR/new.xml" <<'TEXT'
<scene version="3.0.0">
	<sensor type="perspective"><transform name="to_world"><lookat origin="0.3, 0.3, 2" target="0.3, 0.3, 0" up="0, 1, 0"/></transform></sensor>
	<shape type="triangle"><bsdf type="half"/></shape>
	<emitter type="constant"/>
</scene>
TEXT
"$BIN/hslt-render" "$DIR/new.xml" -o "$DIR/new.exr" --size 16x16 --integrator hslt --mutations bidirectional=0.5,again=0.5 \
	--spp 16 --stats "$DIR/new.json" 2>"$DIR/render.log" || fail "$(tail -n 1 "$DIR/render.log")"
grep -q '"again"' "$DIR/new.json" || fail "the mutation is not counted"
"$BIN/hslt-scene" compatibility | grep -q '^| `half` ' || fail "the BSDF is not in the table of what is supported"
"$BIN/hslt-status" --help | grep -q -- --quiet || fail "the option is not in --help"
start_coordinator
start_worker w1
job=$("$BIN/hslt-submit" "$BOX" -o "$DIR/box.exr" --integrator path --size 16x16 --spp 1 --wait 2>"$DIR/submit.log") || fail "$(tail -n 1 "$DIR/submit.log")"
"$BIN/hslt-status" --json "$job" >"$DIR/status.json"
grep -q '"unique": *0' "$DIR/status.json" || fail "the counter is not in the status"
slots=$(sed -n 's/.*"slots": *\([1-9][0-9]*\).*/\1/p' "$DIR/status.json")
[ "$slots" ] || fail "the field is not in the status of a job that has ended"
PYTHONPATH=$HERE/faults "$PYTHON" - "${COORDINATOR#*:}" "$slots" <<'TEXT' || fail "the message has no answer, or the field is not on the wire"
import socket, sys
from wire import field, frame, hello
with socket.create_connection(("127.0.0.1", int(sys.argv[1])), 60) as s:
    s.sendall(hello(2, b"echo") + frame(field(60, field(1, b"hello there"))) + frame(field(42, b"")))
    got = b""
    while b"hello there" not in got or field(99, int(sys.argv[2])) not in got:
        more = s.recv(4096)
        if not more:
            sys.exit("the coordinator hung up: %r" % got)
        got += more
TEXT
echo "a BSDF, a shape, a mutation, an option, a message, a counter and a field cost what is said"
