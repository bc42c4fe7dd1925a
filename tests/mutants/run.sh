#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Plants one fault at a time and asks whether a test notices: make test-mutants.
#
#     sh tests/mutants/run.sh [LIST]        LIST: tests/mutants/list.txt
#
# A line of the list: FILE, what stands there (once in the file; white space does not count), what is put in its place, the tests to
# run (TEST@ROOM: in one of their rooms); tabs between, # begins a comment. The commit at HEAD is copied to build/mutants and built
# there once, by ccache where it is installed. A fault is caught when a test of its line fails; one that does not compile is a fault
# of the list. One line for each, with the seconds that it took, then a table by folder. Ends with 1 when less than 95 % are caught or
# a line is faulty.
list=${1:-tests/mutants/list.txt}
list=$(cd "$(dirname "$list")" && pwd)/$(basename "$list")
tree=build/mutants
command -v ccache > /dev/null && CC="ccache ${CC:-gcc}"
rm -rf "$tree" && mkdir -p "$tree" && git archive HEAD | tar x -C "$tree" && cp "$list" "$tree/list" && cd "$tree" || exit 1
list=list
# run TEST [SECONDS], or TEST@ROOM: with that room alone. Ended by processor time, as by tests/run.sh: on a busy machine a limit of wall
# clock would catch everything.
run() {
	case $1 in
	*@*) ROOM=${1#*@} build/tests/limit/limit "${2:-900}" 900 "build/tests/${1%@*}" < /dev/null > /dev/null 2>&1 ;;
	*) build/tests/limit/limit "${2:-900}" 900 "build/tests/$1" < /dev/null > /dev/null 2>&1 ;;
	esac
}
# limit_of TEST: half a minute more than ten times what it took without a fault, which may make it go on for ever
limit_of() {
	echo $((30 + 10 * $(awk -v t="$1" '$1 == t { print $2 }' sound.txt)))
}
binaries() {
	tr ' ' '\n' | sed 's|@.*||; s|^|build/tests/|' | sort -u
}
make -s ${CC:+CC="$CC"} programs build/tests/limit/limit $(awk -F'\t' '!/^#/ && NF { print $4 }' "$list" | binaries) > make.log 2>&1 || { cat make.log; exit 1; }
# Without any fault all of them pass, or they would catch everything.
for t in $(awk -F'\t' '!/^#/ && NF { print $4 }' "$list" | tr ' ' '\n' | sort -u); do
	begin=$(date +%s)
	run "$t" || { echo "$t fails without a fault"; exit 1; }
	echo "$t $(($(date +%s) - begin))" >> sound.txt
done
caught=0 survived=0 faulty=0
result=results.txt
: > $result
# By cut: `read` takes two tabs, with nothing to put in place between them, for one.
field() {
	printf '%s\n' "$line" | cut -f "$1"
}
while IFS= read -r line; do
	case $line in '#'* | '') continue ;; esac
	file=$(field 1) old=$(field 2) new=$(field 3) tests=$(field 4)
	begin=$(date +%s)
	cp "$file" "$file.sound"
	if ! python3 tests/mutants/plant.py "$file.sound" "$old" "$new" > "$file"; then
		echo "faulty    $file: '$old' does not stand there once"
		faulty=$((faulty + 1))
	elif ! make -s ${CC:+CC="$CC"} $(echo "$tests" | binaries) > make.log 2>&1; then
		echo "faulty    $file: '$new' does not compile"
		faulty=$((faulty + 1))
	else
		by=
		for t in $tests; do
			run "$t" "$(limit_of "$t")" || { by=$t && break; }
		done
		if [ "$by" ]; then
			echo "caught    $file: '$old' -> '$new' by $by, $(($(date +%s) - begin)) s"
			echo "$file caught" >> $result
			caught=$((caught + 1))
		else
			echo "SURVIVED  $file: '$old' -> '$new' ($tests), $(($(date +%s) - begin)) s"
			echo "$file survived" >> $result
			survived=$((survived + 1))
		fi
	fi
	mv "$file.sound" "$file"
	touch "$file"
done < "$list"
printf '| folder | faults | caught |\n| --- | --- | --- |\n'
awk '{ sub("/[^/]*$", "", $1); all[$1]++; caught[$1] += $2 == "caught" }
	END { for (f in all) print "| `" f "` | " all[f] " | " caught[f] + 0 " |" }' $result | sort
echo "$caught caught, $survived survived, $faulty faulty"
[ $faulty -eq 0 ] && [ $((100 * caught)) -ge $((95 * (caught + survived))) ]
