# SPDX-License-Identifier: Apache-2.0
# Checks which folders include which others, against includes.txt, and for unfinished marks and overlong files. Prints a line for each
# check, followed by the violations.
cd "$(dirname "$0")/../.." || exit 1
LIST=tests/lint/includes.txt
MOST_LINES=640
MOST_LINES_TEST=640
FOLDERS="common coordinator worker"
SOURCES=$(find $FOLDERS -name '*.[ch]' | sort)
failed=0

# check NAME COMMAND...: the command prints the violations
check() {
	name=$1
	shift
	wrong=$("$@")
	if [ -z "$wrong" ]; then
		echo "ok: $name"
	else
		echo "WRONG: $name"
		echo "$wrong" | sed 's/^/	/'
		failed=1
	fi
}

# Prints one rule per line: the folder or library, then what it may include or where it may be included, separated by spaces.
rules() {
	sed 's/#.*//' $LIST | awk -F: 'NF > 1 { gsub(/[ \t]+/, " ", $2); print $1 " :" $2 " " }'
}

# Prints each include as FILE:LINE FOLDER HEADER, with the " or < in front of the header.
includes() {
	grep -Hn '^[[:space:]]*#[[:space:]]*include' $SOURCES |
		sed 's/^\([^:]*\)\/\([^/:]*:[0-9]*\):[^"<]*\(["<][^">]*\).*/\1\/\2 \1 \3/'
}

{ rules; echo "--"; includes; } >"${TMPDIR:-/tmp}/includes.$$"
trap 'rm -f "${TMPDIR:-/tmp}/includes.$$"' EXIT

edges() {
	awk '
	$1 == "--" { reading = 1; next }
	!reading && substr($1, 1, 1) != "<" { allowed[$1] = $0 " "; next }
	!reading || substr($3, 1, 1) != "\"" { next }
	{
		header = substr($3, 2); folder = header
		# Numbers in FOLDER/data are part of FOLDER.
		if (!sub("(/data)?/[^/]*$", "", folder) || folder == $2)
			next
		if (!($2 in allowed))
			print $1 ": the folder " $2 " is not in the list"
		else if (!index(allowed[$2], " " folder " ") && !index(allowed[$2], " " header " "))
			print $1 ": " $2 " must not include " header
	}' "${TMPDIR:-/tmp}/includes.$$"
}

# Checks the list itself: prints rules that it must not contain.
borders() {
	rules | awk '
	substr($1, 1, 1) == "<" { next }
	{
		split($1, from, "/")
		for (i = 3; i <= NF; i++) {
			split($i, to, "/")
			if (to[1] == "tests" || (to[1] != from[1] && to[1] != "common" && to[1] != "proto"))
				print "the list lets " $1 " include " $i
		}
	}'
}

# Repeatedly removes folders that include only removed ones; those that remain are in circles or depend on one.
circles() {
	rules | awk '
	substr($1, 1, 1) == "<" { next }
	{ n++; name[n] = $1; for (i = 3; i <= NF; i++) if ($i !~ /\.h$/) needs[n] = needs[n] " " $i }
	END {
		gone["proto"] = 1
		do {
			taken = 0
			for (k = 1; k <= n; k++) {
				if (name[k] in gone)
					continue
				count = split(needs[k], need, " "); free = 1
				for (i = 1; i <= count; i++)
					if (!(need[i] in gone))
						free = 0
				if (free) { gone[name[k]] = 1; taken = 1 }
			}
		} while (taken)
		for (k = 1; k <= n; k++)
			if (!(name[k] in gone))
				print name[k] " includes itself by way of others"
	}'
}

# Prints includes that lead, by way of other files, back to the file that has the include; a source and its header count as one file.
# The list of folders cannot detect this within a folder, nor for the single headers that it allows.
returns() {
	awk '
	function file(name) { sub(/\.[ch](:.*)?$/, "", name); return name }
	function reaches(from, to,   i, next_, count) {
		if (from == to)
			return 1
		if (from in seen)
			return 0
		seen[from] = 1
		count = split(out[from], next_, " ")
		for (i = 1; i <= count; i++)
			if (reaches(next_[i], to))
				return 1
		return 0
	}
	$1 == "--" { reading = 1; next }
	!reading || substr($3, 1, 1) != "\"" { next }
	{ a = file($1); b = file(substr($3, 2)) }
	a == b || index(out[a] " ", " " b " ") { next }
	{ out[a] = out[a] " " b; n++; from[n] = a; to[n] = b; where[n] = $1 }
	END {
		for (k = 1; k <= n; k++) {
			split("", seen)
			if (reaches(to[k], from[k]))
				print where[k] ": " to[k] " comes back to " from[k]
		}
	}' "${TMPDIR:-/tmp}/includes.$$"
}

doors() {
	awk '
	$1 == "--" { reading = 1; next }
	!reading && substr($1, 1, 1) == "<" { door[$1] = $0; next }
	!reading || substr($3, 1, 1) != "<" { next }
	{
		file = $1; sub(/:.*/, "", file)
		for (d in door) {
			if (index($3, d) != 1)
				continue
			open = 0; count = split(door[d], place, " ")
			for (i = 3; i <= count; i++)
				if (file == place[i] || index(file, place[i] "/") == 1)
					open = 1
			if (!open)
				print $1 ": " $3 "> is for " substr(door[d], index(door[d], ":") + 2)
		}
	}' "${TMPDIR:-/tmp}/includes.$$"
}

# Prints functions and variables that are not defined in the source of the header that declares them. Assumes that declarations and
# definitions begin in the first column, and so do the braces of bodies; names in capitals are macros of lists (header_list.h) or of the
# compiler.
declared() {
	awk '
	function name_of(text) {
		gsub(/__attribute__\(\([^)]*\([^)]*\)\)\)/, "", text)
		return match(text, /[A-Za-z_0-9]+\(/) ? substr(text, RSTART, RLENGTH - 1) : ""
	}
	# Stores the names of the declared variables: the words before [, =, a comma or the end.
	function variables(text, names,   part, k, count, n) {
		sub(/ = .*/, "", text); gsub(/\[[^]]*\]/, "", text); sub(/;.*/, "", text)
		count = split(text, part, ","); n = 0
		for (k = 1; k <= count; k++)
			if (match(part[k], /[A-Za-z_0-9]+ *$/)) {
				names[++n] = substr(part[k], RSTART); sub(/ *$/, "", names[n])
			}
		return n
	}
	function declare(name) { n++; declares[n] = name; where[n] = FILENAME ":" line; file[n] = FILENAME }
	FNR == 1 { text = ""; comment = 0; header = FILENAME ~ /\.h$/ }
	comment { comment = !/\*\//; next }
	/^\/\*/ { comment = !/\*\//; next }
	/^[A-Za-z_]/ { text = $0; line = FNR }
	!/^[A-Za-z_{]/ && text != "" { text = text " " $0 }
	/^\{/ && !header && text != "" && text !~ /^static|=/ { name = name_of(text); if (name) defined[name] = FILENAME }
	/^\{/ { text = "" }
	/;/ && text != "" {
		if (header && text ~ /^extern/) {
			count = variables(text, names)
			for (k = 1; k <= count; k++)
				declare(names[k])
		} else if (header && text !~ /^(static|typedef|struct [a-z_0-9]+ \{|enum|union)/ && text !~ /\{/) {
			name = name_of(text)
			if (name && name !~ /^[A-Z_]/)
				declare(name)
		} else if (!header && text !~ /^(static|typedef|extern|enum|union|struct [a-z_0-9]+ (\{|;))/) {
			head = text; sub(/ = .*/, "", head)
			if (head !~ /\(/) {
				count = variables(text, names)
				for (k = 1; k <= count; k++)
					defined[names[k]] = FILENAME
			}
		}
		text = ""
	}
	END {
		for (k = 1; k <= n; k++) {
			source = defined[declares[k]]
			own = source; sub(/\.c$/, ".h", own)
			if (!source)
				print where[k] ": " declares[k] " is defined nowhere"
			else if (own != file[k])
				print where[k] ": " declares[k] " is defined in " source
		}
		if (n < 900)
			print "only " n " declarations are found: this check is wrong"
	}' $SOURCES
}

marks() {
	words='TO''DO|FIX''ME'
	grep -nIE "$words" $(git ls-files 2>/dev/null || find $FOLDERS tests deploy proto -type f)
}

# Prints headers that comments mention and that do not exist, because they were renamed, for example.
named() {
	known=$({ find $FOLDERS tests proto -name '*.h'; sed -n 's/^# *include <\(.*\)>.*/\1/p' $SOURCES $(find tests -name '*.[ch]'); } | sort -u)
	grep -hvE '^[[:space:]]*# *include' $SOURCES $(find tests -name '*.[ch]') | grep -oE '[A-Za-z0-9_/-]{3,}\.h\b' | sort -u |
		while read -r h; do
			printf '%s\n' "$known" | grep -qE "(^|/)$h\$" || echo "$h, named in $(grep -rlF "$h" $FOLDERS tests | head -n 1)"
		done
}

# overlong MOST FILE...: prints the files of more than MOST lines.
overlong() {
	most=$1
	shift
	for f in "$@"; do
		lines=$(wc -l <"$f")
		[ "$lines" -le "$most" ] || echo "$f: $lines lines"
	done
}

check "every include between folders is in $LIST" edges
check "coordinator and worker do not include each other, common includes neither, nobody tests" borders
check "no folders in a circle" circles
check "no files in a circle" returns
check "each library is included only at its door" doors
check "each header declares what its own source defines" declared
check "every header that a comment names exists" named
check "no unfinished marks" marks
check "no source of more than $MOST_LINES lines" overlong $MOST_LINES $SOURCES
check "no test of more than $MOST_LINES_TEST lines" overlong $MOST_LINES_TEST $(find tests -name '*.[ch]')
exit $failed
