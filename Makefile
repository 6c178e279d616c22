# Every target makes .venv by itself and is quick the second time.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
# Small matrices are slower with more BLAS threads.
export OPENBLAS_NUM_THREADS := 1

BIN := .venv/bin
READY := .venv/.ready
ROS := .venv/ros
ROS_READY := $(ROS)/.ready
# Options for the target's own command: make test ARGS='-k link', make run ARGS='--task planar'
ARGS ?=

.PHONY: help run test soak check ros bench pictures

help: ## print this list
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST)

run: $(READY) ## two arms with their page: both sites and the delayed link on this machine, until Ctrl-C
	@$(BIN)/farhand up $(ARGS)

# Where processes run in real time, one test at a time, in this order: the containers of the last ones are up until the end.
REAL_TIME := tests/browser tests/integration tests/evaluation/live tests/evaluation/link/test_link_delay.py \
	tests/evaluation/link/test_link_recovery.py tests/examples/test_ros2_job.py tests/containers
# They remember their failures apart from the others, which run at the same time.
REAL_TIME_PYTEST := $(BIN)/pytest -o cache_dir=.pytest_cache/real-time
# The others take what those leave of the processor; many of them wait for a process or a socket.
VIRTUAL_TIME_LOG := .pytest_cache/virtual-time.log
ONCE_MORE := --verbose --last-failed --last-failed-no-failures=none

test: $(READY) ## the tests (FARHAND_REQUIRE=browser,containers,rendering,ros2 forbids those to skip)
ifeq ($(strip $(ARGS)),)
	@mkdir -p $(dir $(VIRTUAL_TIME_LOG))
	@$(BIN)/python -m farhand.local_site.learning.warm_up & learning=$$!; \
	$(BIN)/python -m farhand.remote_site.reproduction.warm_up; wait $$learning
	@echo "tests that keep up with real time; beside them, in $(VIRTUAL_TIME_LOG), all others"
	@nice -n 10 $(BIN)/pytest --numprocesses=3 --dist=loadfile $(REAL_TIME:%=--ignore=%) >$(VIRTUAL_TIME_LOG) 2>&1 & others=$$!; \
	trap "kill $$others 2>/dev/null || true" EXIT; failed=0; late=0; \
	$(REAL_TIME_PYTEST) $(REAL_TIME) || late=$$?; \
	wait $$others || failed=$$?; \
	cat $(VIRTUAL_TIME_LOG); \
	if ((late == 1 || failed == 1)); then \
	    echo "==> the failures above once more, one at a time, with the processor to themselves"; \
	    if ((failed == 1)); then failed=0; $(BIN)/pytest $(ONCE_MORE) $(REAL_TIME:%=--ignore=%) || failed=$$?; fi; \
	    if ((late == 1)); then late=0; $(REAL_TIME_PYTEST) $(ONCE_MORE) $(REAL_TIME) || late=$$?; fi; \
	fi; \
	exit $$((failed ? failed : late))
else
	@$(BIN)/pytest $(ARGS)
endif

soak: $(READY) ## the tests that take long: the arm's page in a browser, every fault of every container
	@$(BIN)/pytest -m soak $(ARGS)

check: $(READY) ## lint, format, types and import contracts
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/basedpyright
	$(BIN)/lint-imports

ros: $(ROS_READY) ## ROS 2 for the test of examples/farhand_ros2, in an environment of its own (190 MB, half a minute)

bench: $(READY) ## one table of times, each beside a peer: docs/performance.md
	@$(BIN)/python -m benchmarks.performance $(ARGS)

pictures: $(READY) ## the pictures of the documentation, taken anew (needs a Chromium, and EGL or OSMesa)
	@$(BIN)/python -m tests.common.arm.pictures
	@$(BIN)/python -m tests.browser.pictures

# The first Python that runs and has a supported version: a name on PATH may be a shim of a missing one.
FIND_PYTHON = for name in $${PYTHON:-} python3.12 python3.11 python3 python; do \
	    "$$name" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 13))' >/dev/null 2>&1 \
	        && { echo "$$name"; exit; }; \
	done; \
	echo "Farhand needs Python 3.11 or 3.12, and none is on PATH (found: $$(python3 --version 2>&1 || true))." >&2; \
	echo "On Debian 12: apt-get install python3 python3-venv. Elsewhere: make PYTHON=/path/to/python3.12" >&2; \
	exit 1

# Before a command that is silent for long: a sign of life every few seconds, until it ends. The pause is bash's own.
STILL_THERE = n=0; while ! read -rt 4 <> <(:); do echo "    still at it, $$((n += 4)) s"; done & trap "kill $$!" EXIT

$(BIN)/python:
	@$(STILL_THERE); \
	python=$$($(FIND_PYTHON)); \
	echo "==> making .venv with $$("$$python" --version)"; \
	"$$python" -m venv .venv || { \
	    rm -rf .venv; \
	    echo "$$python lacks its venv module. On Debian: apt-get install $$("$$python" -c \
	        'import sys; print("python%d.%d-venv" % sys.version_info[:2])')" >&2; \
	    exit 1; \
	}

$(READY): pyproject.toml constraints.txt | $(BIN)/python
	@echo "==> installing Farhand and its tools into .venv (some minutes the first time)"
	@$(STILL_THERE); \
	$(BIN)/python -m pip install --disable-pip-version-check --constraint constraints.txt \
	    --editable '.[evaluation,test,development]'
	@touch $@

# The wheels of ROS start every Python of their environment twice, and give all its children a library path. Theirs is
# therefore an environment of its own, which sees what .venv has.
$(ROS_READY): $(READY) examples/farhand_ros2/pyproject.toml
	@echo "==> installing ROS 2 into $(ROS)"
	@$(STILL_THERE); \
	where='import sysconfig; print(sysconfig.get_path("purelib"))'; \
	seen=$$($(BIN)/python -c "$$where"); \
	$(BIN)/python -m venv $(ROS); \
	printf 'import site; site.addsitedir(%s)\n' "$$($(BIN)/python -c 'import sys; print(repr(sys.argv[1]))' "$$seen")" \
	    >"$$($(ROS)/bin/python -c "$$where")/farhand_environment.pth"; \
	$(ROS)/bin/python -m pip install --disable-pip-version-check --constraint constraints.txt \
	    --editable 'examples/farhand_ros2[wheels]'
	@touch $@
