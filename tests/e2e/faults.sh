# SPDX-License-Identifier: Apache-2.0
# Injects one fault after the other while a job runs: no acknowledged result may be lost, none counted twice, and the
# image must have the bits of an undisturbed run. Each fault is a row of the table in README.md. This is the short form;
# `make test-faults` injects each fault as often as the table says, and writes the table.
#   sh tests/e2e/faults.sh BUILD [--write | --all] [FAULT...]
OWN_MOUNTS=wanted # for a disk that is full
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare hslt-render
shift $(($# > 0))
MODE=short
case "${1:-}" in
--write | --all)
	MODE=${1#--}
	shift
	;;
esac
README=$HERE/README.md
GRACE=
. "$HERE/faults/lib.sh"
PYTHON=${PYTHON:-python3}
for f in worker coordinator network versions resources people spool disk; do
	. "$HERE/faults/$f.sh"
done

# A test of the counting itself, over two runs of the coordinator: one result is merged again, one twice, one was
# acknowledged and not stored, one waited in the journal, one was taken back before it was on the disk and merged again;
# twenty are in the film. Two epochs of one chain are handed out again after one worker was lost, one of which two
# workers had held at once; then another one after a restart.
counted=$(sed 's/^/x event=/' <<TEXT | awk -v job=j1 -f "$HERE/faults/count.awk"
start program=hslt-coordinator
batch_merged job=j1 kind=render group=0 part=0 epoch=1
batch_merged job=j1 kind=render group=1 part=0 epoch=0
batch_stored job=j1 kind=render group=1 part=0 epoch=0
batch_merged job=j1 kind=render group=4 part=0 epoch=0
batch_stored job=j1 kind=render group=4 part=0 epoch=0
start program=hslt-coordinator
batch_restored job=j1 kind=render group=0 part=0 epochs=2
batch_restored job=j1 kind=render group=6 part=0 epochs=12
batch_merged job=j1 kind=render group=0 part=0 epoch=0
batch_merged job=j1 kind=render group=1 part=0 epoch=0
batch_acknowledged job=j1 kind=render group=1 part=0 epoch=0 repeat=0
batch_acknowledged job=j1 kind=render group=0 part=0 epoch=1 repeat=1
batch_merged job=j1 kind=render group=4 part=0 epoch=0 late=1
batch_merged job=j1 kind=render group=2 part=0 epoch=0
batch_acknowledged job=j1 kind=render group=2 part=0 epoch=0 repeat=0
batch_merged job=j1 kind=render group=5 part=0 epoch=0
batch_taken_back job=j1 kind=render group=5 part=0 epoch=0
batch_stored job=j1 kind=render group=5 part=0 epoch=0
batch_merged job=j1 kind=render group=5 part=0 epoch=0
batch_stored job=j1 kind=render group=5 part=0 epoch=0
lease_granted job=j1 peer=1 kind=render group=3 part=0 epoch=0
lease_granted job=j1 peer=2 kind=render group=3 part=0 epoch=1
lease_granted job=j1 peer=1 kind=render group=3 part=0 epoch=1
lease_granted job=j1 peer=4 kind=render group=3 part=0 epoch=2
peer_closed peer=1 name="w1" text="the peer hung up"
lease_granted job=j1 peer=2 kind=render group=3 part=0 epoch=0
lease_granted job=j1 peer=2 kind=render group=3 part=0 epoch=1
start program=hslt-coordinator
lease_granted job=j1 peer=4 kind=render group=3 part=0 epoch=2
TEXT
)
[ "$counted" = "2 1 20 2" ] || fail "count.awk counts $counted"

# Every fault must have its row, and every row its fault.
for f in $FAULTS; do
	eval "echo \"\$text_$f\""
done | sort >"$TOP/texts"
sed -n '/<!-- faults -->/,/<!-- end -->/s/^| \([^|]*[^| ]\) *| *[0-9].*/\1/p' "$README" | sort >"$TOP/readme"
if [ $MODE = short ] && [ $# -eq 0 ] && ! cmp -s "$TOP/texts" "$TOP/readme"; then
	fail "the table of README.md has other rows than there are faults (make test-faults writes it): $(diff "$TOP/texts" "$TOP/readme")"
fi

[ $MODE = short ] && mutations=400000 || mutations=3000000
JOB="--integrator hslt --bootstrap 8000 --mutations $mutations"
begin quiet
QUIET=$DIR/image.exr
RESULTS=0
TIMES=0
farm
worker w0
worker w1
job
until_true 60 is_state "$ID" done || fail "the undisturbed job is $(value "$ID" state)"
"$BIN/hslt-job" fetch "$ID" -o "$QUIET"
sleep 0.1
# shellcheck disable=SC2046
set -- $(cat "$DIR/coordinator.log" "$DIR"/w*.log | awk -v job="$ID" -f "$HERE/faults/count.awk") "$@"
[ "$1 $2" = "0 0" ] || fail "undisturbed, $1 results are lost and $2 count twice"
RESULTS=$3
shift 4
# shellcheck disable=SC2086
"$BIN/hslt-render" "$BOX" -o "$TOP/alone.exr" $JOB --threads 1 2>>"$DIR/render.log"
same "$TOP/alone.exr" "$QUIET"
end

printf '%-74s %5s %5s %8s  %-10s  %s\n' "fault" times lost doubled "bits equal" again
for f in ${*:-$FAULTS}; do
	[ $MODE = short ] && [ $# -eq 0 ] && eval "TIMES=\$short_$f" || eval "TIMES=\$times_$f"
	[ "$TIMES" -gt 0 ] || continue
	begin "$f"
	"$f"
	end
done
bad=$(awk -F'|' '$3 != 0 || $4 != 0 || $5 != "yes"' "$ROWS")
[ -z "$bad" ] || fail "lost, doubled or other bits: $bad"
[ $MODE = write ] || { echo "$(wc -l <"$ROWS") faults, $RESULTS results a job, nothing lost, nothing doubled, bits equal" && exit 0; }
[ ! -s "$SKIPPED" ] || fail "the table is not written: $(cat "$SKIPPED")"

{
	echo '| fault | times injected | results lost | results doubled | bits equal | epochs of a chain computed again, at most, for each |'
	echo '|---|---|---|---|---|---|'
	for f in $FAULTS; do # rows of faults that did not run stay
		eval "grep -F \"\$text_$f|\" \"$ROWS\" | sed 's/|/ | /g; s/^/| /; s/$/ |/' | grep . || grep -F \"| \$text_$f |\" \"$README\"" || :
	done
} >"$TOP/table"
write_table faults "$TOP/table"
[ $# -gt 0 ] || sh "$HERE/tls.sh" "$BUILD" --write || fail "an attempt that must fail did not"
