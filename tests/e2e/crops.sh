# SPDX-License-Identifier: Apache-2.0
# A film rendered in crops on two coordinators, each with a worker of its own: put together, it is the film of a single
# render.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-assemble hslt-compare hslt-render
CROPS=$HERE/../../deploy/crops.sh

says() {
	grep -q -- "$1" "$DIR/err.log" || fail "it says: $(cat "$DIR/err.log")"
}

for c in one two; do
	mkdir "$DIR/$c"
	"$BIN/hslt-coordinator" --listen 127.0.0.1:0 --port-file "$DIR/$c/port" --spool "$DIR/$c/spool" \
		--status-socket "$DIR/$c/status" 2>>"$DIR/$c-coordinator.log" &
	PIDS="$PIDS $!"
	until_true 10 test -s "$DIR/$c/port" || fail "the coordinator does not listen"
	start_worker $c --coordinator "127.0.0.1:$(cat "$DIR/$c/port")"
done
FARMS=127.0.0.1:$(cat "$DIR/one/port"),127.0.0.1:$(cat "$DIR/two/port")

# Samples do not depend on the crop: the image is the same except for roundings to the grids of the sums.
"$BIN/hslt-render" "$BOX" -o "$DIR/whole.exr" -i path --size 81x45 --spp 16 --threads 1 --quiet
code 0 sh "$CROPS" -p "$BIN" -g 3x2 -s 81x45 -c "$FARMS" -o "$DIR/path.exr" "$BOX" -i path --spp 16
says "6 crops, 6 of them to render"
code 0 "$BIN/hslt-compare" "$DIR/path.exr" "$DIR/whole.exr" --max-relmse 1e-12
[ ! -d "$DIR/path.exr.crops" ] || fail "the crops are still there"
for c in one two; do
	grep -q event=job_state "$DIR/$c-coordinator.log" || fail "coordinator $c had no job"
done

# A repeated call continues from the crops that are there, but not from those of a different call.
"$BIN/hslt-render" "$BOX" -o "$DIR/hslt.exr" -i hslt --size 80x40 --crop 0,0,40,40 --mutations 40000 --threads 1 --quiet
mkdir "$DIR/chains.exr.crops"
cp "$DIR/hslt.exr" "$DIR/chains.exr.crops/0-0.exr"
printf '%s\n' 2x1 80x40 "$BOX" -i hslt --mutations 40000 >"$DIR/chains.exr.crops/call"
code 2 sh "$CROPS" -p "$BIN" -g 2x1 -s 80x40 -c "$FARMS" -o "$DIR/chains.exr" "$BOX" -i hslt --mutations 40001
says "another"
# A stored crop had not reached its target error: so the whole film has not.
echo 4 >"$DIR/chains.exr.crops/0-0.code"
code 4 sh "$CROPS" -p "$BIN" -g 2x1 -s 80x40 -c "$FARMS" -o "$DIR/chains.exr" "$BOX" -i hslt --mutations 40000
[ ! -d "$DIR/chains.exr.crops" ] || fail "the crops are still there"
says "2 crops, 1 of them to render"
code 2 sh "$CROPS" -g 2y1 -s 80x40 -c "$FARMS" -o "$DIR/x.exr" "$BOX"
code 1 sh "$CROPS" -p "$BIN" -g 1x1 -s 80x40 -c "$FARMS" -o "$DIR/x.exr" "$DIR/none.xml"
says "0-0 failed"

code 4 sh "$CROPS" -p "$BIN" -g 2x1 -s 80x40 -c "$FARMS" -o "$DIR/far.exr" "$BOX" -i path --spp 1 --target-error 0.001%
[ -s "$DIR/far.exr" ] || fail "no image"

# The submissions are made one after the other, and waited for together; a signal ends all of them.
mkdir "$DIR/programs"
cat >"$DIR/programs/hslt-submit" <<TEXT
#!/bin/sh
mkdir "$DIR/submits" || echo more than one >>"$DIR/submitted"
sleep 0.1
rmdir "$DIR/submits"
echo \$\$ >>"$DIR/submitted"
echo j1
trap 'kill \$!; exit 143' TERM
sleep 60 &
wait
echo not ended >>"$DIR/submitted"
TEXT
chmod +x "$DIR/programs/hslt-submit"
sh "$CROPS" -p "$DIR/programs" -g 2x2 -s 80x40 -c "$FARMS" -o "$DIR/many.exr" "$BOX" 2>"$DIR/err.log" &
pid=$!
PIDS="$PIDS $pid"
until_true 6 grep -q "4 of them" "$DIR/err.log" || fail "not all of them wait: $(cat "$DIR/submitted")"
stop $pid
[ "$CODE" = 130 ] || fail "it ended with $CODE"
[ "$(wc -l <"$DIR/submitted")" = 4 ] || fail "they submitted at once, or were not ended: $(cat "$DIR/submitted")"
for p in $(cat "$DIR/submitted"); do
	! kill -0 "$p" 2>/dev/null || fail "process $p is left"
done

# Crops that do not fit together are refused.
"$BIN/hslt-render" "$BOX" -o "$DIR/right.exr" -i hslt --size 80x40 --crop 40,0,40,40 --mutations 40000 --threads 1 --quiet
code 0 "$BIN/hslt-assemble" "$DIR/right.exr" "$DIR/hslt.exr" -o "$DIR/both.exr"
code 0 "$BIN/hslt-compare" "$DIR/both.exr" "$DIR/chains.exr" --max-relmse 0
code 1 "$BIN/hslt-assemble" "$DIR/right.exr" "$DIR/right.exr" -o "$DIR/x.exr"
says "another crop also has its pixel 40,0"
"$BIN/hslt-render" "$BOX" -o "$DIR/low.exr" -i hslt --size 80x40 --crop 0,1,40,39 --mutations 40000 --threads 1 --quiet
code 1 "$BIN/hslt-assemble" "$DIR/right.exr" "$DIR/low.exr" -o "$DIR/x.exr"
says "no crop has pixel 0,0"
"$BIN/hslt-render" "$BOX" -o "$DIR/other.exr" -i hslt --size 80x40 --crop 0,0,40,40 --mutations 40000 --set wavelengths=1 --threads 1 --quiet
code 1 "$BIN/hslt-assemble" "$DIR/right.exr" "$DIR/other.exr" -o "$DIR/x.exr"
says "other.exr: .*--set"
"$BIN/hslt-render" "$BOX" -o "$DIR/path-crop.exr" -i path --size 80x40 --crop 0,0,40,40 --spp 16 --threads 1 --quiet
code 1 "$BIN/hslt-assemble" "$DIR/right.exr" "$DIR/path-crop.exr" -o "$DIR/x.exr"
[ ! -e "$DIR/x.exr" ] || fail "an image of nothing"
echo "crops: two coordinators, put together, and what does not fit"
