# SPDX-License-Identifier: Apache-2.0
# make            programs into build/bin
# make test       unit and end-to-end tests (SAN=address,undefined for sanitizers, FULL=1 for the long forms)
# make test-numerics   numerically hard cases, one row each
# make test-mutants   plants single-line faults, one at a time, and checks that a test detects each
# make calibration     stated errors against true ones, over scenes of three kinds; the table of tests/image/README.md
# make test-sim        10,000 schedules of faults in virtual time
# make test-faults   injects faults of machines, one after the other; writes the tables of tests/e2e/README.md
# make test-states   chain states that one worker spoils, with 50 seeds
# make fuzz-numbers   scenes with extreme numbers on a farm of sanitized workers, FUZZ_SECONDS (60) long
# make corpus DIR=...   tries every scene file under a folder: how many load, and why the others are refused
# make man completion   the output of the programs' --man and --completion, into build/man and build/completion
# make pictures accuracy   the pictures of the documentation, and the reports on accuracy settings
# make demo bench fuzz install uninstall clean

CC       ?= gcc
ifeq ($(origin CC),default)
CC       := gcc
endif
SAN      ?=
BUILD    ?= build$(if $(SAN),/san)
PREFIX   ?= /usr/local
PYTHON   ?= python3
# Debian's awk makes tables in the build; in some locales it reads and writes numbers with a decimal comma.
export LC_ALL := C

EMBREE   := $(if $(wildcard /usr/include/embree4/rtcore.h),-lembree4,-lembree3)
# Later compilers and libraries may warn about correct code: so only the project's own tests set WERROR (deploy/test.sh
# --ci).
WERROR   ?=
IS_CLANG := $(findstring clang,$(shell $(CC) --version))
WARN     := -Wall -Wextra -Wconversion -Wshadow -Wmissing-prototypes -Wstrict-prototypes -Wvla -Wpointer-arith \
            -Wcast-qual -Wwrite-strings -Wundef -Wformat=2 -Wold-style-definition $(WERROR)
# With -O1 and sanitizers gcc 12 does not track the bounds of loop counters, and warns about texts that do fit.
WARN     += $(if $(SAN),$(if $(IS_CLANG),,-Wno-format-truncation))
OPT      ?= $(if $(SAN),-O1,-O3)
# Invalid operations trap (worker/render/math/fptrap.h): gcc's code expects that by default, clang needs an option.
TRAPS    := $(if $(IS_CLANG),-ffp-exception-behavior=maytrap)
CFLAGS   := -std=c17 $(OPT) $(if $(SAN),-g1,-g) -ffp-contract=off -fno-fast-math -fno-math-errno -fno-strict-aliasing -fno-common $(TRAPS) $(WARN) \
            $(if $(SAN),-fsanitize=$(SAN) -fno-sanitize-recover=all -fno-omit-frame-pointer) $(EXTRA_CFLAGS)
# From version 3.2 on, OpenEXR's headers include each other without naming their folder.
OPENEXR  := $(patsubst -I%,-isystem %,$(filter -I%,$(shell pkg-config --cflags OpenEXR 2>/dev/null)))
CPPFLAGS := -D_GNU_SOURCE -I. -I$(BUILD)/gen $(OPENEXR) -MMD -MP
LDFLAGS  := $(if $(SAN),-fsanitize=$(SAN)) $(EXTRA_LDFLAGS)

LIBS_COMMON := -lOpenEXRCore -lprotobuf-c -luv -lssl -lcrypto -ljansson -lsqlite3 -lm -lpthread
LIBS_RENDER := $(EMBREE) -lexpat -lpng -ljpeg -lwebp -lmeshoptimizer -lz -lOpenEXR

COMMON_SRC := $(wildcard common/*/*.c)
RENDER_SRC := $(filter-out %_gen.c,$(wildcard worker/render/*.c worker/render/*/*.c))
CTL_SRC    := $(filter-out coordinator/ctl/hslt_%.c,$(wildcard coordinator/ctl/*.c))
COORD_SRC  := $(filter-out $(wildcard coordinator/ctl/*.c),$(wildcard coordinator/*/*.c))
LIB_CTL    := $(BUILD)/lib/libhslt-ctl.a
DAEMON_SRC := $(filter-out worker/daemon/main.c,$(wildcard worker/daemon/*.c))
CLI_MAIN   := $(wildcard worker/cli/*/hslt_*.c)
CLI_SRC    := $(filter-out $(CLI_MAIN),$(wildcard worker/cli/*/*.c))
PROTO      := $(wildcard proto/*.proto)
# protobuf-c 1.5 deprecates protoc-c: there the generator is a plug-in of protoc.
PROTOC     := $(if $(shell command -v protoc 2>/dev/null),protoc,protoc-c)

obj = $(patsubst %.c,$(BUILD)/obj/%.o,$(1))
PROTO_OBJ := $(patsubst proto/%.proto,$(BUILD)/obj/gen/proto/%.pb-c.o,$(PROTO))
GEN_H     := $(patsubst proto/%.proto,$(BUILD)/gen/proto/%.pb-c.h,$(PROTO))

LIB_COMMON := $(BUILD)/lib/libhslt-common.a
LIB_RENDER := $(BUILD)/lib/libhslt-render.a
LIB_COORD  := $(BUILD)/lib/libhslt-coordinator.a
LIB_DAEMON := $(BUILD)/lib/libhslt-daemon.a
LIB_CLI    := $(BUILD)/lib/libhslt-cli.a

# A program is one file with a main: coordinator/main.c, worker/daemon/main.c, worker/cli/*/hslt_*.c, coordinator/ctl/hslt_*.c
WORKER_CLI := $(patsubst hslt_%.c,hslt-%,$(notdir $(CLI_MAIN)))
CTL_CLI    := $(patsubst coordinator/ctl/hslt_%.c,hslt-%,$(wildcard coordinator/ctl/hslt_*.c))
PROGRAMS   := $(if $(wildcard coordinator/main.c),hslt-coordinator) $(if $(wildcard worker/daemon/main.c),hslt-worker) \
              $(WORKER_CLI) $(CTL_CLI)

# A failed command may leave a partly written target: delete it.
.DELETE_ON_ERROR:
.PHONY: all programs tests test-syntax test demo bench fuzz fuzzers install uninstall clean
all: programs
programs: $(addprefix $(BUILD)/bin/,$(PROGRAMS))

$(BUILD)/obj/%.o: %.c | $(GEN_H) generated
	@mkdir -p $(@D)
	$(CC) $(CPPFLAGS) $(CFLAGS) -c $< -o $@

$(BUILD)/obj/gen/%.o: $(BUILD)/gen/%.c
	@mkdir -p $(@D)
	$(CC) $(CPPFLAGS) $(filter-out -W%,$(CFLAGS)) -c $< -o $@

$(BUILD)/gen/proto/%.pb-c.c $(BUILD)/gen/proto/%.pb-c.h: proto/%.proto
	@mkdir -p $(@D)
	@command -v $(PROTOC) >/dev/null || { echo "make: no $(PROTOC); sh deploy/setup.sh installs what the build needs" >&2; exit 1; }
	$(PROTOC) --c_out=$(BUILD)/gen $<

.PHONY: generated
generated: $(BUILD)/gen/.made
$(BUILD)/gen/.made:
	@mkdir -p $(@D) && touch $@

-include worker/render/texture/generate.mk

$(LIB_COMMON): $(call obj,$(COMMON_SRC)) $(PROTO_OBJ)
$(LIB_RENDER): $(call obj,$(RENDER_SRC))
$(LIB_COORD): $(call obj,$(COORD_SRC))
$(LIB_CTL): $(call obj,$(CTL_SRC))
$(LIB_DAEMON): $(call obj,$(DAEMON_SRC))
$(LIB_CLI): $(call obj,$(CLI_SRC))
$(BUILD)/lib/%.a:
	@mkdir -p $(@D)
	rm -f $@ && ar rcs $@ $^

link = @mkdir -p $(@D); $(CC) $(LDFLAGS) -o $@ $^
$(BUILD)/bin/hslt-coordinator: $(BUILD)/obj/coordinator/main.o $(LIB_COORD) $(LIB_COMMON)
	$(link) $(LIBS_COMMON)
$(BUILD)/bin/hslt-worker: $(BUILD)/obj/worker/daemon/main.o $(LIB_DAEMON) $(LIB_RENDER) $(LIB_COMMON)
	$(link) $(LIBS_RENDER) $(LIBS_COMMON)
define cli_program
$(patsubst hslt_%.c,$(BUILD)/bin/hslt-%,$(notdir $(1))): $(call obj,$(1)) $(LIB_CLI) $(LIB_RENDER) $(LIB_COMMON)
	$$(link) $$(LIBS_RENDER) $$(LIBS_COMMON)
endef
$(foreach main,$(CLI_MAIN),$(eval $(call cli_program,$(main))))
$(addprefix $(BUILD)/bin/,$(CTL_CLI)): $(BUILD)/bin/hslt-%: $(BUILD)/obj/coordinator/ctl/hslt_%.o $(LIB_CTL) $(LIB_COORD) $(LIB_COMMON)
	$(link) $(LIBS_COMMON)

# Tests mirror the tree: tests/<folder>/.../test_*.c, one program each, found here.
TEST_SRC     := $(shell find tests -name 'test_*.c' 2>/dev/null | sort)
TEST_SUPPORT := $(wildcard tests/support/*.c tests/sim/sim_*.c)
TEST_BIN     := $(patsubst tests/%.c,$(BUILD)/tests/%,$(TEST_SRC))
LIB_TEST     := $(BUILD)/lib/libhslt-test.a
# Some hundred programs with the same libraries: lld links each in a third, gold in half of the time that ld takes.
# Tests that wrap functions use ld or gold, because only these leave calls within an object file alone.
FAST_LD      := $(firstword $(foreach ld,lld gold,$(if $(shell command -v ld.$(ld) 2>/dev/null),-fuse-ld=$(ld))))
# Programs linked with these options can run out of memory when a test demands it (tests/support/failing_memory.h).
MEMORY_WRAP  := -Wl,--wrap=mem_alloc,--wrap=mem_grow,--wrap=mem_strdup,-u,__wrap_mem_alloc
$(LIB_TEST): $(call obj,$(TEST_SUPPORT))
# A test's own code runs once, so it is compiled quickly; the code under test is built as in the programs.
$(call obj,$(TEST_SRC)): CFLAGS += -O1 -g1
$(BUILD)/tests/%: $(BUILD)/obj/tests/%.o $(LIB_TEST) $(LIB_DAEMON) $(LIB_CLI) $(LIB_COORD) $(LIB_RENDER) $(LIB_COMMON)
	$(link) $(if $(TEST_WRAP),$(TEST_WRAP),$(FAST_LD)) $(MEMORY_WRAP) -lcmocka $(LIBS_RENDER) $(LIBS_COMMON)
# The test records which random numbers are requested.
$(BUILD)/tests/worker/render/test_groups: TEST_WRAP := -Wl,--wrap=rng_uniform4,--wrap=rng_bits4
# Simulates a file system without hard links, or without renames that refuse to replace; and a host name with two
# addresses.
$(BUILD)/tests/common/net/test_client: TEST_WRAP := -Wl,--wrap=link,--wrap=renameat2,--wrap=getaddrinfo
$(BUILD)/tests/common/net/test_pool: TEST_WRAP := -Wl,--wrap=uv_thread_create
$(BUILD)/tests/worker/daemon/test_supervise: TEST_WRAP := -Wl,--wrap=fork
$(BUILD)/tests/coordinator/server/test_listen: TEST_WRAP := -Wl,--wrap=getaddrinfo
# Enforces the time limits of tests for tests/run.sh. It needs no library and no sanitizer, since it is not a test.
LIMIT := $(BUILD)/tests/limit/limit
$(LIMIT): tests/limit/limit.c
	@mkdir -p $(@D)
	$(CC) $(CPPFLAGS) $(filter-out -fsanitize% -fno-sanitize%,$(CFLAGS)) $< -o $@
# A worker with faults, for end-to-end tests: the daemon's objects, some of whose calls are wrapped. It has
# hslt-worker's build id, and so its numeric fingerprint.
FAULTY_WORKER := $(BUILD)/tests/e2e/faulty_worker
FAULTY_WRAP   := -Wl,--wrap=render_lease,--wrap=batch_pack,--wrap=conn_send_frame
$(FAULTY_WORKER): $(BUILD)/bin/hslt-worker $(call obj,tests/e2e/faulty_worker.c worker/daemon/main.c) $(LIB_DAEMON) $(LIB_RENDER) $(LIB_COMMON)
	@mkdir -p $(@D); id=$$(LC_ALL=C readelf -n $< | sed -n 's/.*Build ID: //p'); \
	$(CC) $(LDFLAGS) -Wl,--build-id=$${id:+0x}$${id:-none} $(FAULTY_WRAP) -o $@ $(filter-out $<,$^) $(LIBS_RENDER) $(LIBS_COMMON)
# Sanitized runs take 1/20 of the samples, and skip tests that only draw more samples: other tests run the same code.
SAN_WITHOUT := /tests/(image/|(numerics/test_(agree|random)|worker/render/(test_choose_integrator|mutation/test_(balance|forced|broken)))$$)
TEST_RUN    := $(if $(SAN),$(shell printf '%s\n' $(TEST_BIN) | grep -vE '$(SAN_WITHOUT)'),$(TEST_BIN))
# A build without sanitizers also compiles the fuzzers (linked with clang only), the benchmarks and the calibration, so that they keep building.
TEST_MORE   := $(if $(SAN),,$(call obj,$(wildcard tests/fuzz/*.c tests/bench/*.c tests/image/*.c)))
tests: $(TEST_RUN) $(LIMIT) $(FAULTY_WORKER) $(TEST_MORE)
# Checks the tests with a second compiler, without building them.
test-syntax: $(addprefix $(BUILD)/syntax/,$(TEST_SRC) $(TEST_SUPPORT) $(wildcard tests/bench/*.c tests/image/*.c))
$(BUILD)/syntax/%: % | $(GEN_H) generated
	@mkdir -p $(@D)
	$(CC) $(CPPFLAGS) $(CFLAGS) -fsyntax-only -MF $@.d -MT $@ $< && touch $@
test: programs tests $(BUILD)/load/load
	$(if $(SAN),HSLT_TEST_WITHOUT="$${HSLT_TEST_WITHOUT:+$$HSLT_TEST_WITHOUT|}"'$(SAN_WITHOUT)' HSLT_TEST_SCALE=$${HSLT_TEST_SCALE:-20}) sh tests/run.sh $(BUILD)
.SECONDARY:

# The farm in virtual time: 10,000 schedules of faults, of which 200 are part of the tests. HSLT_SIM_SEED=N runs one
# schedule, with its whole transcript.
.PHONY: test-sim
test-sim: $(BUILD)/tests/sim/test_farm
	FULL=1 $(BUILD)/tests/sim/test_farm

# Lays the sources out as .clang-format says (with clang-format 14); tests/lint/format.sh checks it.
.PHONY: format
format:
	git ls-files '*.[ch]' '*.inc' | grep -v /data/ | xargs clang-format -i --style=file

# Plants single-line faults in a copy of HEAD, and checks which of them a test detects (tests/mutants/README.md).
.PHONY: test-mutants
test-mutants:
	CC="$(CC)" sh tests/mutants/run.sh

# Numerically hard cases, one row each; the same programs are part of the tests.
NUMERICS_BIN := $(filter $(BUILD)/tests/worker/render/halfvec/% $(BUILD)/tests/numerics/% $(BUILD)/tests/worker/render/test_%_numbers \
	$(BUILD)/tests/worker/render/test_number_%,$(TEST_BIN))
.PHONY: test-numerics
test-numerics: programs $(NUMERICS_BIN)
	$(if $(SAN),HSLT_TEST_SCALE=$${HSLT_TEST_SCALE:-20}) sh tests/numerics/run.sh $(BUILD)

# Injects faults into machines while a job runs, each as often as the tables of tests/e2e/README.md say, and writes
# these tables.
.PHONY: test-faults
test-faults: programs $(FAULTY_WORKER) $(BUILD)/tests/coordinator/power_loss/test_durability
	sh tests/e2e/faults.sh $(BUILD) --write

# Fuzzers: tests/fuzz/fuzz_*.c, one libFuzzer program each; run.sh calls `make fuzzers` with clang and its sanitizers.
FUZZ_SRC     := $(wildcard tests/fuzz/fuzz_*.c)
FUZZ_BIN     := $(patsubst tests/%.c,$(BUILD)/%,$(FUZZ_SRC))
FUZZ_SUPPORT := $(filter-out $(FUZZ_SRC),$(wildcard tests/fuzz/*.c))
LIB_FUZZ     := $(BUILD)/lib/libhslt-fuzz.a
$(LIB_FUZZ): $(call obj,$(FUZZ_SUPPORT))
$(FUZZ_BIN): $(BUILD)/%: $(BUILD)/obj/tests/%.o $(LIB_FUZZ) $(LIB_TEST) $(LIB_DAEMON) $(LIB_CLI) $(LIB_COORD) $(LIB_RENDER) $(LIB_COMMON)
	$(link) -fsanitize=fuzzer $(MEMORY_WRAP) -lcmocka $(LIBS_RENDER) $(LIBS_COMMON)
fuzzers: $(FUZZ_BIN)
fuzz:
	MAKE="$(MAKE)" sh tests/fuzz/run.sh

# A worker that spoils chain states among honest ones, with 50 seeds: the image must have the bits of hslt-render's. The
# tests run one seed.
.PHONY: test-states
test-states: programs $(FAULTY_WORKER)
	SEEDS="$$(seq -s ' ' 50)" sh tests/e2e/states.sh $(BUILD)

# Scenes with extreme numbers against a farm of sanitized workers.
.PHONY: fuzz-numbers
fuzz-numbers: $(BUILD)/tests/worker/render/test_scene_numbers
	$(MAKE) SAN=address,undefined programs
	sh tests/fuzz/numbers.sh $(BUILD)/san $${FUZZ_SECONDS:-60}

# The exit code says whether any scene crashed or hung, not whether all load.
.PHONY: corpus
corpus: programs
	@sh tests/corpus/corpus.sh $(BUILD)/bin/hslt-scene "$(DIR)"

# Benchmarks: one program from tests/bench/*.c; writes a table to stdout and $(BUILD)/bench.json. BENCH="path tiles"
# runs only these two.
BENCH_SRC := $(wildcard tests/bench/*.c)
$(BUILD)/bench/bench: $(call obj,$(BENCH_SRC)) $(LIB_TEST) $(LIB_CLI) $(LIB_RENDER) $(LIB_COMMON)
	$(link) $(BENCH_WRAP) $(MEMORY_WRAP) -lcmocka $(LIBS_RENDER) $(LIBS_COMMON)
BENCH_WRAP := -Wl,--wrap=accel_closest,--wrap=accel_occluded,--wrap=accel_occluded_to_infinity,--wrap=halfvec_walk,--wrap=full_path_edge_is_visible
bench: programs $(BUILD)/bench/bench $(if $(filter effects,$(BENCH)),plain)
	$(BUILD)/bench/bench --bin $(BUILD)/bin --json $(BUILD)/bench.json $(BENCH)

# The pictures of the documentation, into build/pictures: about half an hour of one core. make pictures PICTURES="equal-time window"
.PHONY: pictures
pictures: programs
	$(PYTHON) tests/bench/pictures.py $(BUILD) $(BUILD)/pictures $(PICTURES)

# The reports shown in tests/bench/accuracy/README.md, as pages and tables in build/accuracy: about 20 minutes of one
# core.
.PHONY: accuracy
accuracy: programs
	sh tests/bench/accuracy/reports.sh $(BUILD)/bin $(BUILD)/accuracy

# Compares stated errors with true ones: about an hour of one core. CALIBRATION="--renders 8 --lengths 2" for less.
CALIBRATION_SRC := $(filter-out tests/image/test_%.c,$(wildcard tests/image/*.c))
$(BUILD)/calibration/calibration: $(call obj,$(CALIBRATION_SRC)) $(LIB_TEST) $(LIB_CLI) $(LIB_RENDER) $(LIB_COMMON)
	$(link) $(MEMORY_WRAP) -lcmocka $(LIBS_RENDER) $(LIBS_COMMON)
.PHONY: calibration
calibration: $(BUILD)/calibration/calibration
	$(BUILD)/calibration/calibration $(CALIBRATION) >$(BUILD)/calibration.md; code=$$?; cat $(BUILD)/calibration.md; exit $$code

# Fake workers against the real coordinator: make load LOAD="--workers 1000 --minutes 10"
LOAD_SRC := $(wildcard tests/load/*.c) tests/bench/process.c
$(BUILD)/load/load: $(call obj,$(LOAD_SRC)) $(LIB_CLI) $(LIB_RENDER) $(LIB_COMMON)
	$(link) $(LIBS_RENDER) $(LIBS_COMMON)
.PHONY: load
load: programs $(BUILD)/load/load
	$(BUILD)/load/load --bin $(BUILD)/bin $(LOAD)

# A renderer compiled without colour, dispersion and apertures, to measure the cost of checking for them.
.PHONY: plain
plain:
	$(MAKE) BUILD=$(BUILD)/plain EXTRA_CFLAGS="$(EXTRA_CFLAGS) -DHSLT_PLAIN" $(BUILD)/plain/bin/hslt-render

# The demo scene on a farm of two workers on this machine: build/demo/demo.exr and demo.png.
demo: programs
	sh deploy/demo-run.sh $(BUILD) build/demo

# Made from the programs' tables of options (common/base/option.h).
MAN        := $(PROGRAMS:%=$(BUILD)/man/%.1)
COMPLETION := $(PROGRAMS:%=$(BUILD)/completion/%)
.PHONY: man completion
man: $(MAN)
completion: $(COMPLETION)
$(BUILD)/man/%.1: $(BUILD)/bin/%
	@mkdir -p $(@D)
	$< --man >$@.new && mv $@.new $@
$(BUILD)/completion/%: $(BUILD)/bin/%
	@mkdir -p $(@D)
	$< --completion >$@.new && mv $@.new $@

SHARE := $(DESTDIR)$(PREFIX)/share
install: programs man completion
	install -d $(DESTDIR)$(PREFIX)/bin $(SHARE)/man/man1 $(SHARE)/bash-completion/completions
	install -m 755 $(addprefix $(BUILD)/bin/,$(PROGRAMS)) $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(MAN) $(SHARE)/man/man1
	install -m 644 $(COMPLETION) $(SHARE)/bash-completion/completions
uninstall:
	rm -f $(PROGRAMS:%=$(DESTDIR)$(PREFIX)/bin/%) $(PROGRAMS:%=$(SHARE)/man/man1/%.1) \
		$(PROGRAMS:%=$(SHARE)/bash-completion/completions/%)

clean:
	rm -rf build

-include $(shell find $(BUILD)/obj $(BUILD)/syntax -name '*.d' 2>/dev/null)
