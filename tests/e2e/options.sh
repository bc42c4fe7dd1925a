# SPDX-License-Identifier: Apache-2.0
# Options as programs print them: --help, the manual page and bash's completion have the same options, each once; a
# mistyped option gets the nearest name; commands in the documents use only existing options.
. "$(dirname "$0")/lib.sh"
PROGRAMS="accuracy assemble ca compare coordinator job render scene status submit tonemap worker"
need $(for p in $PROGRAMS; do echo "hslt-$p"; done)

# Asks the completion for each option of a list, and for its prefixes up to three letters.
cat >"$DIR/complete.bash" <<'END'
. "$1" || exit 1
complete -p "$2" >/dev/null || exit 1
ask() {
	COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
	"_${1//-/_}"
}
while read -r option; do
	for word in "$option" "${option:0:5}"; do
		ask "$2" "$word"
		[[ " ${COMPREPLY[*]} " == *" $option "* ]] || { echo "$word: ${COMPREPLY[*]}"; exit 1; }
	done
done <"$3"
ask "$2" --no-such-option
[[ ${#COMPREPLY[@]} = 0 ]] || { echo "--no-such-option: ${COMPREPLY[*]}"; exit 1; }
END

# Prints program and option of each command in a document, in a block of code or between backticks.
cat >"$DIR/commands.awk" <<'END'
/^ *```/ { fence = !fence; next }
{
	text = fence || /^    / ? $0 : ""
	if (!text) {
		n = split($0, span, "`")
		for (i = 2; i <= n; i += 2)
			text = text ";" span[i]
	}
	n = split(text, command, /[;&|()#]/)
	for (i = 1; i <= n; i++)
		if (command[i] !~ /kubectl/ && match(" " command[i], /[ \t]hslt-[a-z]+ /)) {
			m = split(substr(command[i], RSTART), word, /[ =]+/)
			for (k = 2; k <= m; k++)
				if (word[k] ~ /^--[a-z-]+$/)
					print word[1], word[k]
		}
}
END

for p in $PROGRAMS; do
	code 0 "$BIN/hslt-$p" --help
	mv "$DIR/out" "$DIR/help"
	grep -q "^Usage: hslt-$p \[OPTION" "$DIR/help" || fail "hslt-$p --help does not say how it is called"
	grep -q '^Examples:' "$DIR/help" && grep -q "^  hslt-$p " "$DIR/help" || fail "hslt-$p --help has no example"
	grep -q '^Exit codes: 0 ' "$DIR/help" || fail "hslt-$p --help has no exit codes"
	sed -n 's/^  ..[, ] \(--[a-z-]*\).*/\1/p' "$DIR/help" >"$DIR/options"
	for o in --help --version --man --completion; do
		grep -qx -e $o "$DIR/options" || fail "hslt-$p --help has no $o"
	done
	sed -n 's/^  \(-.\), --.*/\1/p' "$DIR/help" | sort | uniq -d >"$DIR/twice"
	[ ! -s "$DIR/twice" ] || fail "hslt-$p has twice: $(cat "$DIR/twice")"
	[ -z "$(sort "$DIR/options" | uniq -d)" ] || fail "hslt-$p has twice: $(sort "$DIR/options" | uniq -d)"
	sed "s/^/hslt-$p /" "$DIR/options" >>"$DIR/all"
	code 0 "$BIN/hslt-$p" --usage
	tr -d '\n' <"$DIR/out" | tr -s ' ' >"$DIR/usage"
	for o in $(cat "$DIR/options"); do
		grep -q -e "\[$o[]=]" "$DIR/usage" || fail "hslt-$p --usage has no $o"
	done

	code 0 "$BIN/hslt-$p" --man
	mv "$DIR/out" "$DIR/man"
	head -n 1 "$DIR/man" | grep -q "^\.TH \"hslt\\\\-$p\" 1 " || fail "the manual page of hslt-$p begins with $(head -n 1 "$DIR/man")"
	for s in NAME SYNOPSIS OPTIONS "EXIT STATUS" EXAMPLES; do
		grep -qx "\.SH $s" "$DIR/man" || fail "the manual page of hslt-$p has no $s"
	done
	wrong=$(grep "^[.']" "$DIR/man" | grep -vE '^\.(TH|SH|SS) .|^\.(TP|PP|br|nf|fi)$' || :)
	[ -z "$wrong" ] || fail "requests in the manual page of hslt-$p: $wrong"
	[ "$(grep -c '^\.nf$' "$DIR/man")" = "$(grep -c '^\.fi$' "$DIR/man")" ] || fail "the manual page of hslt-$p: .nf without .fi"
	wrong=$(sed 's/\\[-e&]\|\\f[BIR]\|\\([a-z][a-z]//g' "$DIR/man" | grep '[\\`^~-]' || :)
	[ -z "$wrong" ] || fail "not escaped in the manual page of hslt-$p: $wrong"
	awk '/\\fB/ && gsub(/\\f[BI]/, "") != gsub(/\\fR/, "") { print; bad = 1 } END { exit bad }' "$DIR/man" ||
		fail "the manual page of hslt-$p: a font that does not end"
	sed -n '/^\.SH OPTIONS/,/^\.SH E/s/^\\fB.*\(\\-\\-[a-z\\-]*\)\\fR.*/\1/p' "$DIR/man" | tr -d '\\' >"$DIR/listed"
	cmp "$DIR/options" "$DIR/listed" || fail "the manual page of hslt-$p has other options than --help"
	awk '/^\.TP$/ { getline; name = $0; if ((getline) <= 0 || !/[^. ]/ || /^\./) { print name; exit 1 } }' "$DIR/man" ||
		fail "an option without a text"

	code 0 "$BIN/hslt-$p" --completion
	mv "$DIR/out" "$DIR/completion"
	bash --norc --noprofile "$DIR/complete.bash" "$DIR/completion" "hslt-$p" "$DIR/options" >"$DIR/asked" 2>&1 ||
		fail "the completion of hslt-$p: $(cat "$DIR/asked")"

	code 2 "$BIN/hslt-$p" --hepl
	grep -q "unknown option '--hepl'; did you mean '--help'?" "$DIR/err.log" || fail "hslt-$p --hepl: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-$p" --ver=1
done
TREE=$HERE/../..
cat "$TREE"/README.md "$TREE"/docs/*.md "$TREE"/deploy/*.md "$TREE"/worker/render/scene/README.md |
	awk -f "$DIR/commands.awk" | sort -u >"$DIR/mentioned"
[ "$(wc -l <"$DIR/mentioned")" -ge 20 ] || fail "the documents mention only these options: $(cat "$DIR/mentioned")"
wrong=$(grep -vxFf "$DIR/all" "$DIR/mentioned" || :)
[ -z "$wrong" ] || fail "the documents mention options that no program has: $wrong"

# Numbers with units, in each program: counts, sizes of films, times, sizes in bytes.
picture() {
	code 0 "$BIN/hslt-render" "$BOX" -o "$DIR/units.exr" -i path --quiet --bootstrap .25k --seed 1k "$@"
}
picture --size .04kx.03k --crop 0,0,.02k,.01k --spp .004k --time 1h
code 0 "$BIN/hslt-tonemap" "$DIR/units.exr" "$DIR/units.png" && [ "$(od -An -tx1 -j16 -N8 "$DIR/units.png" | tr -d ' ')" = 000000140000000a ] ||
	fail "--crop 0,0,.02k,.01k gives $(od -An -tx1 -j16 -N8 "$DIR/units.png")"
picture --size .04k --mutations 1.2k # 40x33: the aspect of 48x40
code 0 "$BIN/hslt-tonemap" "$DIR/units.exr" "$DIR/units.png" && [ "$(od -An -tx1 -j16 -N8 "$DIR/units.png" | tr -d ' ')" = 0000002800000021 ] ||
	fail "--size .04k gives $(od -An -tx1 -j16 -N8 "$DIR/units.png")"
code 2 "$BIN/hslt-render" "$BOX" -o "$DIR/a.exr" --size 1.0001kx2
code 0 "$BIN/hslt-compare" "$DIR/units.exr" "$DIR/units.exr" --size .02kx.011k --trim 0.1%
HSLT_CA=$DIR/units.ca code 0 "$BIN/hslt-ca" init --days 36h
for days in 0.4s 0.00001; do
	HSLT_CA=$DIR/units.ca code 2 "$BIN/hslt-ca" client brief --days $days
	grep -q "less than a second" "$DIR/err.log" && [ ! -e "$DIR/units.ca/brief" ] || fail "--days $days: $(cat "$DIR/err.log")"
done
HSLT_CA=$DIR/units.ca code 0 "$BIN/hslt-ca" client brief --days 30m
grep -q "valid for 30 min only" "$DIR/err.log" || fail "--days 30m: $(cat "$DIR/err.log")"
# These commands fail at their last option, before they do anything.
code 2 "$BIN/hslt-coordinator" --spool "$DIR/none" --blobs 20G --journal 64MB --film-memory 2g --keep-films 500M --keep-days 36h \
	--keep-gb 1.5T --worker-bandwidth 500k --quota-jobs 1k --quota-assets 10G --quota-film 2G --quota-mutations 1.5G --heartbeat 1m \
	--tls-check 5m --connections 2k --max-faults .1k --stop
grep -q "unknown option '--stop'" "$DIR/err.log" || fail "units of hslt-coordinator: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-worker" --threads .002k --cache-size 500M --grace 1m --idle-exit 2h --stall 5m --stop
grep -q "unknown option '--stop'" "$DIR/err.log" || fail "units of hslt-worker: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-accuracy" --budget 2h --seconds 1.5m --rounds .1k --stop
grep -q "unknown option '--stop'" "$DIR/err.log" || fail "units of hslt-accuracy: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-job" extend j1 --spp +1.5k --mutations +2M --time +5m --stop
grep -q "unknown option '--stop'" "$DIR/err.log" || fail "units of hslt-job: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-submit" --patience 5m --pilot 1m --chains 1k --groups .016k --parts .004k --epoch 1k --bootstrap 1M --min-depth .002k --stop
grep -q "unknown option '--stop'" "$DIR/err.log" || fail "units of hslt-submit: $(cat "$DIR/err.log")"

# answered NAME COMMAND...: the error message suggests that name
answered() {
	meant=$1
	shift
	got=0
	"$@" >"$DIR/out" 2>"$DIR/err.log" || got=$?
	[ $got = 1 ] || [ $got = 2 ] || fail "$* ended with $got"
	grep -q "; did you mean [\`']$meant[\`']?" "$DIR/err.log" || fail "$*: $(cat "$DIR/err.log")"
}
answered --exposure "$BIN/hslt-tonemap" --exposrue 1 a.exr b.png
answered fetch "$BIN/hslt-job" fecth j1
answered worker "$BIN/hslt-ca" wroker node1
answered check "$BIN/hslt-scene" chekc "$BOX"
answered bidirectional "$BIN/hslt-render" "$BOX" -o "$DIR/a.exr" --mutations bidirectionl=1
answered dispersion "$BIN/hslt-render" "$BOX" -o "$DIR/a.exr" --effects -disperson
answered '+dispersion` or `-dispersion' "$BIN/hslt-render" "$BOX" -o "$DIR/a.exr" --effects disperson
answered tolerance "$BIN/hslt-accuracy" "$BOX" -o "$DIR/a.html" --parameters tolerence
render="$BIN/hslt-render $BOX -o $DIR/a.exr"
answered double $render --set precision=doubel
answered spectral $render --set colour=spectrl
answered place $render --set emitter-choice=plcae
answered auto $render --set backs=atuo
answered shown $render --set media=shwon
answered yes $render --set lenient=yse
answered help $render --set hepl
answered precision $render --set precison
answered all $render --effects al
answered hslt $render --integrator hstl
answered '.png' "$BIN/hslt-render" "$BOX" --estimate --pilot 1 --plot "$DIR/cost.pgn"
answered precision "$BIN/hslt-accuracy" "$BOX" -o "$DIR/a.html" --parameters precison
answered box.xml "$BIN/hslt-scene" show "${BOX%box.xml}bxo.xml"
HSLT_CA=$DIR/units.ca code 0 "$BIN/hslt-ca" worker node1
HSLT_CA=$DIR/units.ca answered node1 "$BIN/hslt-ca" revoke ndoe1
answered --socket "$BIN/hslt-status" --status-socket "$DIR/none"
answered --stall "$BIN/hslt-worker" --stal1 5
echo "options of $(echo $PROGRAMS | wc -w) programs: help, manual pages, completions"
