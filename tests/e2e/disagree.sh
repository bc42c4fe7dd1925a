# SPDX-License-Identifier: Apache-2.0
# Chains that disagree: a lamp in glass, seen in a mirror. Independent samples find such a path once in 100,000 times,
# and chains that began there never leave: the images have no noise but differ from seed to seed. This is reported by
# exit code 5, a note, the header, statistics, status, the list and the spool's record. It is not reported with a
# filament that samples find, nor with path, nor for chains too short to be judged. Refracted connections, which would
# find the lamp, are off.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-render hslt-compare
SCENE=$HERE/../scenes/bulb/scene.xml
SMALL="-D radius=0.02 -D radiance=15000 --effects -refracted-shadows"
LARGE="-D radius=0.15 -D radiance=267"
CHAINS="--size 160x120 --chains 64 --bootstrap 200000 --epoch 2000"
WORDS='groups of them differ in paths (reflected caustic, 3-4 edges)'

# ends WANTED FILE COMMAND...: checks the exit code; stderr goes to FILE
ends() {
	wanted=$1 file=$2 got=0
	shift 2
	"$@" >"$DIR/out" 2>"$file" || got=$?
	[ $got -eq "$wanted" ] || fail "$* ended with $got, not $wanted: $(tail -n 3 "$file")"
}

# has FILE WORDS: checks that the file contains the words
has() {
	grep -a -q -F -- "$2" "$1" || fail "$1 does not say '$2': $(tail -n 5 "$1" | cut -c 1-600)"
}

# A missed target gives exit code 4, unless the chains disagree.
ALL="$SMALL $CHAINS --integrator hslt --mutations 1280000 --target-error 0.1%"
ends 5 "$DIR/render.log" "$BIN/hslt-render" "$SCENE" -o "$DIR/a.exr" $ALL --stats "$DIR/a.json"
has "$DIR/render.log" "note: chains disagree: "
has "$DIR/render.log" "$WORDS"
has "$DIR/render.log" 'groups apart'
has "$DIR/a.json" '"verdict": "disagree"'
has "$DIR/a.json" '"class": "reflected caustic, 3-4 edges"'
has "$DIR/a.exr" hslt:disagreement
has "$DIR/a.exr" "$WORDS"
has "$DIR/a.exr" rhat.Y

start_coordinator
start_worker w1
ends 5 "$DIR/submit.log" "$BIN/hslt-submit" "$SCENE" -o "$DIR/farm.exr" $ALL --wait
id=$(cat "$DIR/out")
has "$DIR/submit.log" "$WORDS"
same "$DIR/a.exr" "$DIR/farm.exr"
look() {
	is_state "$id" done || fail "$id is $(value "$id" state)"
	[ "$(value "$id" verdict)" = disagree ] || fail "the status says $(value "$id" verdict)"
	"$BIN/hslt-status" "$id" >"$DIR/shown"
	has "$DIR/shown" "$WORDS"
	has "$DIR/shown" 'chains: disagree; R-hat'
	has "$DIR/shown" 'groups apart'
	"$BIN/hslt-status" >"$DIR/shown"
	has "$DIR/shown" 'its chains disagree'
	"$BIN/hslt-job" log "$id" >"$DIR/shown"
	has "$DIR/shown" 'chains disagree: '
	"$BIN/hslt-job" list >"$DIR/list"
	has "$DIR/list" 'its chains disagree'
	"$BIN/hslt-job" list --json >"$DIR/list"
	has "$DIR/list" '"exitCode": 5'
	ends 0 "$DIR/fetch.log" "$BIN/hslt-job" fetch "$id" -o "$DIR/fetched.exr"
	same "$DIR/a.exr" "$DIR/fetched.exr"
}
look
stop $COORDINATOR_PID
LISTEN=$COORDINATOR
start_coordinator
look

SHORT="$SMALL $CHAINS --integrator hslt --mutations 256000"
ends 0 "$DIR/short.log" "$BIN/hslt-render" "$SCENE" -o "$DIR/b.exr" $SHORT --stats "$DIR/short.json"
has "$DIR/short.log" 'note: chains are too short to be judged, 4000 mutations each: '
# A warning is the last line, and the only one with --quiet.
tail -n 1 "$DIR/short.log" | grep -q '^hslt-render: warning: relative error about .*, its interval is not known: ' ||
	fail "the last line does not warn: $(tail -n 1 "$DIR/short.log")"
ends 0 "$DIR/quiet.log" "$BIN/hslt-render" "$SCENE" -o "$DIR/b.exr" $SHORT --quiet
[ "$(cat "$DIR/quiet.log")" = "$(tail -n 1 "$DIR/short.log")" ] || fail "--quiet says: $(cat "$DIR/quiet.log")"
# The farm reports it as well, with the reason why it states no error.
doubt=$(sed -n 's/.*"relMSEDoubt": "\(.*\)".*/\1/p' "$DIR/short.json")
[ "$doubt" ] || fail "the statistics do not say why no error is stated"
ends 0 "$DIR/submit.log" "$BIN/hslt-submit" "$SCENE" -o "$DIR/farm.exr" $SHORT --wait
about=$(sed -n 's/^hslt-render: warning: relative error about \(.* %\), its interval.*/\1/p' "$DIR/short.log")
[ "$about" ] || fail "the warning has no error"
has "$DIR/submit.log" "the error is about $about, its interval is not known: $doubt"
id=$(cat "$DIR/out")
"$BIN/hslt-status" --json "$id" >"$DIR/shown"
has "$DIR/shown" "\"errorDoubt\":\"$doubt\""
grep -q '"errorAbout":[0-9].*"errorDoubt":"' "$DIR/shown" || fail "the JSON lacks the error: $(cat "$DIR/shown")"
has "$DIR/shown" '"error":null'
has "$DIR/shown" '"verdict":"too short"'
"$BIN/hslt-status" "$id" >"$DIR/shown"
has "$DIR/shown" "the error is about $about, its interval is not known: $doubt"
"$BIN/hslt-status" >"$DIR/shown"
has "$DIR/shown" " ~$about "
has "$DIR/shown" 'its chains are too short to be judged'
ends 0 "$DIR/large.log" "$BIN/hslt-render" "$SCENE" -o "$DIR/b.exr" $LARGE $CHAINS --integrator hslt --mutations 1280000
grep -q ': note:' "$DIR/large.log" && fail "nothing is wrong, but: $(grep ': note:' "$DIR/large.log")"
grep -a -q hslt:disagreement "$DIR/b.exr" && fail "the header finds something wrong"
ends 0 "$DIR/path.log" "$BIN/hslt-render" "$SCENE" -o "$DIR/b.exr" $SMALL --size 160x120 --integrator path --spp 1
# Light that path hardly ever finds, because it is reflected in the glass first: reported by hslt-render, and by the
# farm in the same header.
UNSEEN="--size 48x36 --spp 64"
ends 0 "$DIR/unseen.log" "$BIN/hslt-render" "$SCENE" -o "$DIR/a.exr" $UNSEEN --integrator path --quiet --stats "$DIR/a.json"
has "$DIR/unseen.log" 'arrives by paths that so few samples hardly ever find; with it the error is about'
grep -q '"relMSEUnseen": [0-9.e-]*[1-9]' "$DIR/a.json" || fail "the statistics do not say how much is unseen"
ends 0 "$DIR/submit.log" "$BIN/hslt-submit" "$SCENE" -o "$DIR/farm.exr" $UNSEEN --integrator path --wait
has "$DIR/submit.log" 'hardly ever find'
same "$DIR/a.exr" "$DIR/farm.exr"
ends 0 "$DIR/seen.log" "$BIN/hslt-render" "$SCENE" -o "$DIR/a.exr" $UNSEEN --integrator bdpt --quiet
[ ! -s "$DIR/seen.log" ] || fail "bdpt finds it, but: $(cat "$DIR/seen.log")"
sed -n 's/.*note: //p' "$DIR/render.log"
