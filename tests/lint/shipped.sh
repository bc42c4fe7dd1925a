# SPDX-License-Identifier: Apache-2.0
# Installed programs cannot inject faults: they contain neither names of faults nor functions of the faulty worker
# (tests/e2e/faulty_worker.c), in which this check must find both.
cd "$(dirname "$0")/../.." || exit 1
build=${1:-build}
faulty=$build/tests/e2e/faulty_worker
if [ ! -x "$faulty" ]; then
	echo "WRONG: no $faulty; make tests builds it"
	exit 1
fi
failed=0

# holds PROGRAM: prints the names of faults that it contains
holds() {
	{ strings "$1" && nm "$1"; } | grep -oE 'HSLT_(TEST|FAULT)[A-Z_]*|--test-[a-z-]*|^test-[a-z-]+$|__wrap_[a-z_]+|faulty_worker|mem_fail_after' | sort -u | tr '\n' ' '
}

for program in "$build"/bin/*; do
	found=$(holds "$program")
	[ -z "$found" ] || { failed=1 && echo "WRONG: $program holds $found"; }
done
case $(holds "$faulty") in
*HSLT_FAULTS*__wrap_batch_pack*) ;;
*) failed=1 && echo "WRONG: nothing is found in $faulty, which holds it: $(holds "$faulty")" ;;
esac
[ $failed = 1 ] || echo "ok: no program that is installed holds a fault on request"
exit $failed
