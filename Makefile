# Two commands: `make demo` and `make test`. Thin covers over the CMake presets.
JOBS ?= $(shell nproc)
# Many tests wait for other processes.
TEST_JOBS ?= $(shell echo $$(($(JOBS) + 2)))
FUZZ_SECONDS ?= 60
FUZZ_RUNS ?=
FUZZ_JOBS ?= 4
FUZZ_TARGETS ?= urdf robot experiment message request input sample sheet frames ethercat line mcap import studio

.PHONY: demo robot deb test proof test-all bench unit built real anywhere hil firmware arm64 sanitized rtsan asan tsan fuzz format lint \
  tidy hooks mutations clean help

help:
	@echo "make demo   install what is missing, build, and let COMAN squat (about 6 minutes the first time)"
	@echo "make robot  the program for a robot PC: the fastest, in build/robot (12 minutes)"
	@echo "make deb    Debian packages in build/packages (10 minutes the first time; docs/install.md)"
	@echo "make test   install what is missing, build everything, run the unit tests (about 12 minutes the first time)"
	@echo "make proof  that build in strange surroundings and on a CAN stack, fuzzers, real-time sanitizer (about 15 minutes)"
	@echo "make test-all  both, and the proofs that take long (hours)"
	@echo "make firmware  the boards' firmware on an emulated microcontroller, beside this machine's"
	@echo "make arm64  cross-builds the rooms below the runtime for 64-bit Arm, and runs their tests in qemu"
	@echo "make bench  times this build; AGAINST=../old/build/release: beside another one"
	@echo "make fuzz   the fuzzers, a minute each, four at a time; FUZZ_RUNS=1000000: so many inputs each"
	@echo "make mutations  whether the tests notice 200 broken lines (hours)"
	@echo "make format  lay out every source; make lint: whether they are (part of make test)"
	@echo "make hooks  lay out what is committed, at each commit"
	@echo "make clean  remove build/ and runs/"

# Installs missing packages (root or sudo only then), builds what the demo needs, runs it.
demo:
	@scripts/install-dependencies demo
	@scripts/install-node-modules studio/page
	@cmake --preset demo --log-level=WARNING
	@cmake --build --preset demo --parallel $(JOBS)
	@build/release/bin/tandem run config/coman/squat.toml --report
	@echo
	@echo "Next, from this folder (a robot's first run builds its kernels, which takes a minute or two):"
	@echo "  build/release/bin/tandem run config/coman/squat.toml --studio  # in a browser, while it runs"
	@echo "  build/release/bin/tandem run config/panda/trajectory.toml  # another robot"
	@echo "  build/release/bin/tandem run config/coman/hold.toml        # another controller"
	@echo "  build/release/bin/tandem new config/ur5e/ur5e.urdf -o runs/my_robot  # a robot from its URDF"
	@echo 'The README says just `tandem`: export PATH="$$PWD/build/release/bin:$$PATH"'

# No tests; optimised as a whole, and for the branches that runs take.
robot:
	@scripts/install-dependencies demo
	@scripts/install-node-modules studio/page
	@JOBS=$(JOBS) scripts/build-robot

# Debian's packages, in build/packages, and what lintian says of them.
deb:
	@scripts/install-dependencies package
	@scripts/install-node-modules studio/page
	@JOBS=$(JOBS) scripts/build-packages

# Layout, build and unit tests. The last lines say what ran and what did not.
test:
	@rm -f build/summary
	@$(MAKE) --no-print-directory lint
	@$(MAKE) --no-print-directory unit
	@echo
	@cat build/summary

# What tests alone do not show, on what `make test` built. What meets the machine takes one core, and
# beside it thirteen seconds of each fuzz target and the real-time proof. CI runs both (.ci/run).
proof:
	@rm -f build/summary
	@$(MAKE) --no-print-directory built
	@$(MAKE) --no-print-directory --jobs 2 --output-sync=line real sanitized
	@echo
	@cat build/summary

# What takes too long for every change.
test-all:
	@$(MAKE) --no-print-directory test
	@$(MAKE) --no-print-directory proof
	@$(MAKE) --no-print-directory firmware
	@$(MAKE) --no-print-directory arm64
	@scripts/install-dependencies engines
	@cmake --preset release --log-level=WARNING && cmake --build --preset release --parallel $(JOBS)
	@build/release/bin/engines_test --gtest_brief=1
	@TANDEM_ROBOTS=10000 TANDEM_MIRRORED=30 build/release/bin/model_test --gtest_filter='*RandomRobots*:Lanes.*' --gtest_brief=1
	@TANDEM_DERIVATIVES_ALL=1 build/release/bin/model_test --gtest_filter='Derivatives.OfAHumanoid*' --gtest_brief=1
	@TANDEM_SEEDS=200 build/release/bin/estimation_test --gtest_filter='ContactFilter.*' --gtest_brief=1
	@TANDEM_LONG_RUNS=1 TANDEM_FREE_HOURS=1 TANDEM_COLLISION_FIGURES=build/collisions build/release/bin/estimation_run_test --gtest_brief=1
	@TANDEM_IDENTIFY_SEEDS=1000 build/release/bin/identification_test --gtest_filter='Identify.Intervals*'
	@TANDEM_IDENTIFY_ALL=1 build/release/bin/identify_test --gtest_brief=1
	@TANDEM_NEW_ALL=1 build/release/bin/apps_test --gtest_filter='New.*' --gtest_brief=1
	@TANDEM_MOTION_COMMANDS=20000 build/release/bin/motion_bounds_test
	@TANDEM_CLOCK_SEQUENCES=20000 build/release/bin/runtime_test --gtest_filter='ClockSequences.*'
	@TANDEM_TRAVELS=100 TANDEM_SNAPSHOT_CYCLES=3000 build/release/bin/time_machine_test --gtest_brief=1
	@TANDEM_TELEOPERATION=build/teleoperation.txt build/release/bin/teleoperation_test --gtest_filter='*Table*' --gtest_brief=1
	@TANDEM_HIL_SECONDS=30 tests/hil/run build/release/bin/hil_test --gtest_filter='*HilLockstep*:HilTwin*'
	@TANDEM_TRAVELS=100 tests/hil/run build/release/bin/hil_test --gtest_filter='HilTravel*'
	@scripts/test-anywhere --paths
	@scripts/test-build-types
	@$(MAKE) --no-print-directory deb
	@scripts/install-dependencies package-test
	@scripts/test-packages
	@scripts/test-packages --twice
	@cmake --preset dev --log-level=WARNING && cmake --build --preset dev --parallel $(JOBS)
	@$(MAKE) --no-print-directory fuzz FUZZ_SECONDS=600
	@$(MAKE) --no-print-directory asan
	@$(MAKE) --no-print-directory tsan
	@$(MAKE) --no-print-directory tidy

# On a machine that does nothing else. Both builds need their benchmarks: -DTANDEM_BENCH=ON.
AGAINST ?=
bench:
	@scripts/install-dependencies optional
	@cmake --preset release -DTANDEM_BENCH=ON --log-level=WARNING
	@cmake --build --preset release --parallel $(JOBS)
	@bench/compare $(AGAINST) --row

built:
	@scripts/install-dependencies test
	@cmake --preset release --log-level=WARNING
	@cmake --build --preset release --parallel $(JOBS)

unit:
	@scripts/install-dependencies test
	@scripts/install-node-modules
	@$(MAKE) --no-print-directory built
	@TITLE=unit scripts/run-tests build/release $(TEST_JOBS) -LE hil

# One after the other: both want the build folder for themselves. Without ANYWHERE only the second,
# for who runs the first as root (.ci/run).
ANYWHERE ?= yes
real:
	@$(if $(ANYWHERE),scripts/test-anywhere build/release)
	@TITLE=hil scripts/run-tests build/release 1 -L hil --verbose

# A choice of the unit tests, as `unit` built them, as another user and with other surroundings.
anywhere:
	@scripts/test-anywhere build/release

# On this machine's kernel if it has CAN, else in a User-Mode-Linux one: tests/hil/README.md.
hil: built
	@$(MAKE) --no-print-directory real ANYWHERE=

# Not in CI: compiler and emulator are 950 MB of packages.
firmware: built
	@scripts/install-dependencies firmware
	@scripts/test-firmware build/release

# Its plugins, too: they are what a robot's computer loads.
arm64:
	@scripts/install-dependencies arm64
	@scripts/arm64-sysroot
	@cmake --preset arm64 --log-level=WARNING
	@JOBS=$(JOBS) scripts/test-arm64

# One after the other: each takes two cores, as far as `real` leaves them, which runs robots in real
# time. The fuzzers take forty seconds.
sanitized:
	@nice -n 19 $(MAKE) --no-print-directory fuzz FUZZ_SECONDS=8 FUZZ_JOBS=3
	@nice -n 19 $(MAKE) --no-print-directory rtsan

# One humanoid will do: WALK-MAN's runs take as long as COMAN's, and call nothing else. Nor do a long
# run, a fall, which is about energy, or figures of a link's delay; of random commands few will do.
rtsan:
	@scripts/install-dependencies test
	@cmake --preset rtsan --log-level=WARNING
	@cmake --build --preset rtsan --parallel $(JOBS)
	@TANDEM_MOTION_COMMANDS=200 TANDEM_CLOCK_SEQUENCES=1000 scripts/run-tests build/rtsan $(TEST_JOBS) \
	  -E 'walkman|DoesNotDriftInAMinute|^Collapse\.|^Standing\.|Teleoperation\.Prediction'

# Every room; the kernels are those of `unit`. Of the generator's random robots fewer: they are slow
# here, and each does the same.
asan tsan:
	@scripts/install-dependencies test
	@cmake --preset $@ --log-level=WARNING
	@cmake --build --preset $@ --parallel $(JOBS)
	@TANDEM_ROBOTS=50 TSAN_OPTIONS="suppressions=\"$(CURDIR)/tests/tsan-suppressions.txt\"" \
	  scripts/run-tests build/$@ $(JOBS) -LE hil

fuzz:
	@scripts/install-dependencies test
	@cmake --preset fuzz --log-level=WARNING
	@cmake --build build/fuzz --target $(addprefix fuzz_,$(FUZZ_TARGETS)) --parallel $(JOBS)
	@TARGETS="$(FUZZ_TARGETS)" scripts/run-fuzzers build/fuzz $(FUZZ_SECONDS) "$(FUZZ_RUNS)" $(FUZZ_JOBS)

# 200 lines are broken, one at a time, in a copy: tests/mutations.md has the last figures. Hours.
mutations:
	@scripts/install-dependencies test
	@scripts/install-node-modules
	@scripts/mutation-check --jobs $(JOBS)

# With the formatter of Debian 12; others lay some lines out differently.
CLANG_FORMAT ?= clang-format-14
SOURCES = git ls-files '*.cpp' '*.hpp' '*.c' '*.h'
format:
	@$(SOURCES) | xargs $(CLANG_FORMAT) -i
lint:
	@scripts/install-dependencies test
	@$(SOURCES) | xargs $(CLANG_FORMAT) --dry-run -Werror
	@scripts/lint-english

# At each commit, what is committed is laid out.
hooks:
	@git config core.hooksPath scripts/hooks
	@echo "git config --unset core.hooksPath takes it away again"

# Over the sources as `unit` compiles them. The precompiled header, which clang reads as text, wants
# Eigen's folder everywhere.
tidy:
	@scripts/install-dependencies tidy
	@run-clang-tidy-22 -quiet -j $(JOBS) -p build/release -extra-arg=-isystem/usr/include/eigen3 \
	  '^(?!.*/tests/).*/Unity/.*'

clean:
	@rm -rf build runs
