#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Plants one fault at a time, and checks that a test detects it: make test-mutants.
#
#     sh tests/mutants/run.sh [LIST]        LIST: tests/mutants/list.txt
#
# A line of the list has four fields, separated by tabs: FILE, the text to replace (which occurs once in the file; white
# space is ignored), the replacement, and the tests to run (TEST@ROOM: in one of their rooms). # begins a comment. The
# commit at HEAD is copied to build/mutants and built there once, with ccache if it is installed. A fault is caught when
# one of its tests fails; a fault that does not compile is an error of the list. Prints one line per fault, with its
# seconds, then a table by folder. The exit code is 1 if less than 95 % are caught or a line is faulty.
list=${1:-tests/mutants/list.txt}
list=$(cd "$(dirname "$list")" && pwd)/$(basename "$list")
tree=build/mutants
command -v ccache > /dev/null && CC="ccache ${CC:-gcc}"
rm -rf "$tree" && mkdir -p "$tree" && git archive HEAD | tar x -C "$tree" && cp "$list" "$tree/list" && cd "$tree" || exit 1
list=list
# run TEST [SECONDS], or TEST@ROOM: runs the test, or one of its rooms only. The limit is processor time, as in
# tests/run.sh: with a limit of wall clock a busy machine would seem to catch every fault.
run() {
	case $1 in
	*@*) ROOM=${1#*@} build/tests/limit/limit "${2:-900}" 900 "build/tests/${1%@*}" < /dev/null > /dev/null 2>&1 ;;
	*) build/tests/limit/limit "${2:-900}" 900 "build/tests/$1" < /dev/null > /dev/null 2>&1 ;;
	esac
}
# limit_of TEST: thirty seconds more than ten times its time without a fault; a fault may make it run for ever
limit_of() {
	echo $((30 + 10 * $(awk -v t="$1" '$1 == t { print $2 }' sound.txt)))
}
binaries() {
	tr ' ' '\n' | sed 's|@.*||; s|^|build/tests/|' | sort -u
}
make -s ${CC:+CC="$CC"} programs build/tests/limit/limit $(awk -F'\t' '!/^#/ && NF { print $4 }' "$list" | binaries) > make.log 2>&1 || { cat make.log; exit 1; }
# Without a fault all tests must pass; otherwise they would seem to catch everything.
for t in $(awk -F'\t' '!/^#/ && NF { print $4 }' "$list" | tr ' ' '\n' | sort -u); do
	begin=$(date +%s)
	run "$t" || { echo "$t fails without a fault"; exit 1; }
	echo "$t $(($(date +%s) - begin))" >> sound.txt
done
caught=0 survived=0 faulty=0
result=results.txt
: > $result
# Uses cut: `read` would take two adjacent tabs, with nothing to put in place between them, for one.
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
