# SPDX-License-Identifier: Apache-2.0
# Two jobs share a file of some MB, and the workers have never seen it: each fetches it once, and both jobs are done.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status
SCENE=$DIR/box
mkdir -p "$SCENE" && cp -r "$(dirname "$BOX")"/* "$SCENE"
awk 'BEGIN { for (i = 0; i < 120000; i++) print "# a mesh that takes several pieces on its way" }' >>"$SCENE/meshes/wedge.obj"

is_over() {
	is_state "$1" done || is_state "$1" failed
}

start_coordinator -v
a=$(submit "$SCENE/box.xml" -o "$DIR/a.exr" --integrator path --spp 4)
b=$(submit "$SCENE/box.xml" -o "$DIR/b.exr" --integrator path --spp 5)
for n in 1 2 3 4; do
	start_worker w$n --threads 2 --cache "$DIR/cache$n"
done
for id in "$a" "$b"; do
	until_true 60 is_over "$id" || fail "$id does not end"
	is_state "$id" done || fail "$id is $(value "$id" state): $("$BIN/hslt-status" --json "$id")"
done
! grep event=lease_failed "$DIR"/w?.log || fail "workers failed"
echo "two jobs share a file, and four workers fetch it"
