# SPDX-License-Identifier: Apache-2.0
# usage: reports.sh BIN OUT: writes OUT/SCENE.html and OUT/SCENE.csv, the cost and effect of each accuracy setting in
# three scenes. veach-door is in the folder that HSLT_SCENES names; without that folder its report is left out.
set -e
cd "$(dirname "$0")/../../.."
bin=$1 out=$2
mkdir -p "$out"

report() { # NAME SCENE SIZE SECONDS
	if [ -f "$2" ]; then
		"$bin/hslt-accuracy" "$2" --size "$3" --seconds "$4" --threads 1 -o "$out/$1.html" --csv "$out/$1.csv"
	else
		echo "reports.sh: $2 is not there: no report on $1" >&2
	fi
}

report demo tests/scenes/demo/scene.xml 160x90 "${HSLT_REPORT_SECONDS:-6}"
report displaced tests/scenes/displaced/scene.xml 128x72 "${HSLT_REPORT_SECONDS:-6}"
report veach-door "${HSLT_SCENES:-.}/veach-door/scene.xml" 96x54 "${HSLT_REPORT_SECONDS:-8}"
