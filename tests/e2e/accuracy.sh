# SPDX-License-Identifier: Apache-2.0
# hslt-accuracy: exit codes, a report that is valid XML, a complete CSV, a real bias that is detected, interruption.
. "$(dirname "$0")/lib.sh"
need hslt-accuracy
PYTHON=${PYTHON:-python3}
command -v "$PYTHON" >/dev/null || lacks "no $PYTHON"

code() { # WANTED COMMAND...
	wanted=$1
	shift
	got=0
	"$@" >"$DIR/out" 2>"$DIR/run.log" || got=$?
	[ $got -eq "$wanted" ] || fail "$* ended with $got, not $wanted: $(cat "$DIR/out" "$DIR/run.log")"
}

A="$BIN/hslt-accuracy"
code 0 "$A" --version
code 0 "$A" --help
grep -qi example "$DIR/out" || fail "--help has no examples"
code 2 "$A" "$BOX"
code 2 "$A" "$BOX" -o "$DIR/a.html" --spp 4
code 2 "$A" "$BOX" -o "$DIR/a.html" --budget soon
code 2 "$A" "$BOX" -o "$DIR/a.html" --knobs max-depth
code 2 "$A" "$BOX" -o "$DIR/a.html" --parameters depth --quiet
grep -q "max-depth, independent" "$DIR/run.log" || fail "it does not say which parameters there are: $(cat "$DIR/run.log")"
code 1 "$A" "$DIR/none.xml" -o "$DIR/a.html"
code 1 "$A" "$BOX" -o "$DIR/none/a.html"
[ ! -e "$DIR/a.html" ] || fail "a report of nothing"

# Memory held by caches of files counts as available. Where the total is too little the program says so before
# rendering.
if unshare -rm true 2>/dev/null; then
	printf 'MemTotal: 16000000 kB\nMemFree: 15000000 kB\nMemAvailable: 1000 kB\n' >"$DIR/meminfo"
	code 1 unshare -rm sh -c 'mount --bind "$0" /proc/meminfo && exec "$@"' "$DIR/meminfo" "$A" "$BOX" -o "$DIR/a.html" --size 16x12
	grep -q 'GB of memory, and 0.0 are available: choose a smaller' "$DIR/run.log" || fail "without memory: $(cat "$DIR/run.log")"
else
	skip_part "too little memory: no name spaces for mounts here"
fi

# With counts instead of seconds every run has the same images, so that the assertions do not depend on chance.
COUNT="--chains 64 --epoch 512 --bootstrap 32768"

# A room without its indirect light, against the whole room: paths of two edges show only emitters and surfaces that
# they light.
code 0 "$A" "$BOX" -o "$DIR/a.html" --csv "$DIR/a.csv" --size 32x24 $COUNT --rounds 8 --threads 1 \
	--parameters max-depth,tolerance,roughness --quiet
# The report's pictures do not need gnuplot; without it the report says so and is equally valid.
mkdir "$DIR/bin"
code 0 env PATH="$DIR/bin" "$A" "$BOX" -o "$DIR/plain.html" --size 16x12 --chains 64 --seconds 0.02 --threads 1 \
	--bootstrap 4096 --parameters preset --quiet
grep -q gnuplot-nox "$DIR/plain.html" || fail "nothing is said of missing plots"

# Compares with an image of another integrator.
"$BIN/hslt-render" "$BOX" -o "$DIR/path.exr" --integrator path --size 32x24 --spp 256 --threads 1 --quiet || fail "no reference"
code 2 "$A" "$BOX" -o "$DIR/b.html" --size 16x12 --reference "$DIR/path.exr" --quiet
grep -q 32x24 "$DIR/run.log" || fail "it does not say which size: $(cat "$DIR/run.log")"
code 0 "$A" "$BOX" -o "$DIR/b.html" --csv "$DIR/b.csv" --size 32x24 $COUNT --rounds 8 --threads 1 --parameters preset \
	--reference "$DIR/path.exr" --quiet

cat >"$DIR/check.py" <<'END'
import csv, sys, xml.dom.minidom
folder = sys.argv[1]
for name in "a", "b", "plain":
    page = xml.dom.minidom.parse(f"{folder}/{name}.html")
    for element in page.getElementsByTagName("*"):
        for key in "src", "href", "xlink:href":
            value = element.getAttribute(key)
            assert not value or value.startswith(("data:image/png;base64,", "#")), value
    assert not page.getElementsByTagName("script")
    plots = len(page.getElementsByTagName("svg"))
    if name == "a":
        assert plots == 5, plots  # the front, and two of each parameter
        text = " ".join(n.data for e in page.getElementsByTagName("td") for n in e.childNodes if n.nodeType == n.TEXT_NODE)
        assert "roughness" in text and "no material has a rough lobe" in text
rows = {r["setting"]: r for r in csv.DictReader(open(f"{folder}/a.csv"))}
assert len(rows) == 15, list(rows)
for name, r in rows.items():
    assert None not in r and None not in r.values(), name
    for key in "us", "error_time", "error_mutations":
        low, value, high = (float(r[key + end]) for end in ("_low", "", "_high"))
        assert 0 < low <= value <= high, (name, key, low, value, high)
    assert 0 < float(r["acceptance"]) < 1 and float(r["rays"]) > 0 and int(r["mutations"]) > 1000, r
    assert (r["front"] == "1") == (r["beaten_by"] == "" and r["role"] != "reference"), r
    assert r["beaten_by"] == "" or r["beaten_by"] in rows
    assert int(r["rounds"]) == (32 if r["role"] == "reference" else 8), r
assert rows["default"]["role"] == "default" and rows["reference"]["role"] == "reference"
short = rows["max-depth 2"]
print("max-depth 2: bias of the mean %s (%s to %s), seen: at least %s" %
      (short["bias_mean"], short["bias_mean_low"], short["bias_mean_high"], short["bias_seen"]))
assert float(short["bias_mean_high"]) < -0.1 and float(short["bias_seen"]) > 0.05
assert float(rows["default"]["bias_seen"]) == 0 and float(rows["max-depth 20"]["bias_seen"]) == 0
for name, r in {r["setting"]: r for r in csv.DictReader(open(f"{folder}/b.csv"))}.items():
    print(name + ", against path: bias of the mean %s (%s to %s)" % (r["bias_mean"], r["bias_mean_low"], r["bias_mean_high"]))
    half = float(r["bias_mean_high"]) - float(r["bias_mean"])
    assert 0 < half < 0.15 and abs(float(r["bias_mean"])) < 1.5 * half
END
"$PYTHON" "$DIR/check.py" "$DIR" || fail "the report or its figures"

"$A" "$BOX" -o "$DIR/stopped.html" --size 32x24 --budget 0.4 --chains 64 --threads 1 --bootstrap 4096 --parameters preset 2>"$DIR/stopped.log" &
job=$!
PIDS="$PIDS $job"
until_true 60 grep -qs 'rendering [1-9]' "$DIR/stopped.log" || fail "it does not come to render"
kill -INT $job
got=0
wait $job || got=$?
[ $got -eq 1 ] || fail "interrupted it ended with $got"
"$PYTHON" -c 'import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])' "$DIR/stopped.html" || fail "a broken report"
grep -q interrupted "$DIR/stopped.html" || fail "the report does not say that it was interrupted"
