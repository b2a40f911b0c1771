# `make demo` and `make test` do all of their own set-up: python3 with venv and pip is enough.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Two workers share the machine; threads inside each would only fight over its cores.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1
# What a test frees is kept for the next one: to give it back and ask anew cost 1.5 % of the time.
KEPT := MALLOC_TRIM_THRESHOLD_=268435456 MALLOC_MMAP_THRESHOLD_=33554432
# Sources are compiled once, whatever the caller's habit: many tests start processes, each of which would else compile
# all that it imports. The bytecode stands in the environment, and none in the tree.
export PYTHONDONTWRITEBYTECODE :=
export PYTHONPYCACHEPREFIX := $(CURDIR)/$(VENV)/bytecode

.PHONY: help demo test browser check format pages bench constraints clean
.DEFAULT_GOAL := help

help:
	@echo 'make demo         close the loop on a recording; ends with the path of the report'
	@echo 'make test         the whole test suite'
	@echo 'make check        format, lint, types, import contracts, docs'
	@echo 'make format       format and mend what ruff can mend'
	@echo 'make pages        which results pages are older than the code behind them'
	@echo 'make bench        speed against the named alternatives'
	@echo 'make constraints  renew constraints.txt'
	@echo 'make clean        remove the environment and all output'

demo: $(VENV)/.installed-demo
	@$(BIN)/python scripts/demo.py

test: $(VENV)/.installed-test
	@$(ONE_THREAD) $(KEPT) MPLBACKEND=Agg $(BIN)/python -m pytest -n 2 --dist worksteal

# Where a browser is: the tests of pages run in it, else they skip and say so.
browser: $(VENV)/.installed-browser

check: $(VENV)/.installed-check
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python docs/fromcode.py --check
	$(BIN)/sphinx-build -W --keep-going -q docs docs/_build/html

format: $(VENV)/.installed-check
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/python docs/fromcode.py

pages: $(VENV)/.installed-test
	@$(BIN)/python scripts/pages.py

bench: $(VENV)/.installed-test
	@$(BIN)/python scripts/bench/bench.py

# One resolution that holds for every system and for Python 3.11 onwards. The tools of the set-up itself
# (uv, hatchling, editables) are pinned with the rest; the extra `rl` is left out (see pyproject.toml).
constraints: $(VENV)/.uv
	@$(pip_settings); \
	printf 'uv\nhatchling\neditables\n' | $(BIN)/uv pip compile pyproject.toml - --universal --upgrade \
		--no-header --no-annotate $(foreach e,io dist design render browser test dev docs,--extra $(e)) \
		--output-file constraints.txt --quiet

clean:
	rm -rf $(VENV) docs/_build build dist out .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# ---------------------------------------------------------------------------------------------- set-up

EXTRAS_demo := .
EXTRAS_test := .[test]
EXTRAS_browser := .[browser]
EXTRAS_check := .[test,dev,docs]

# uv reads the proxies and certificates of the environment, but none of pip's settings. Those that say where
# packages come from are handed on, unless uv has its own: the same machine, the same packages. pip weighs all
# indexes alike, hence the index strategy. An empty value would be an error to some readers: it is unset.
define pip_settings
pip_config=$$($(BIN)/python -m pip config list 2>/dev/null); \
export UV_DEFAULT_INDEX="$${UV_DEFAULT_INDEX:-$${UV_INDEX_URL:-$(call pip_setting,index-url)}}"; \
export UV_INDEX="$${UV_INDEX:-$${UV_EXTRA_INDEX_URL:-$(call pip_setting,extra-index-url)}}"; \
export UV_INDEX_STRATEGY="$${UV_INDEX_STRATEGY:-unsafe-best-match}"; \
export UV_FIND_LINKS="$${UV_FIND_LINKS:-$$(echo $(call pip_setting,find-links) | tr -s ' ' ',')}"; \
export UV_NO_INDEX="$${UV_NO_INDEX:-$(call pip_setting,no-index)}"; \
export UV_INSECURE_HOST="$${UV_INSECURE_HOST:-$(call pip_setting,trusted-host)}"; \
export SSL_CERT_FILE="$${SSL_CERT_FILE:-$(call pip_setting,cert)}"; \
export ALL_PROXY="$${ALL_PROXY:-$(call pip_setting,proxy)}"; \
for name in UV_DEFAULT_INDEX UV_INDEX UV_FIND_LINKS UV_NO_INDEX UV_INSECURE_HOST SSL_CERT_FILE ALL_PROXY; do \
	eval "[ -n \"\$$$$name\" ]" || unset $$name; \
done
endef
# pip's value of $(1): its environment stands before its files in the list, and wins.
pip_setting = $$(printf '%s\n' "$$pip_config" | sed -n "s/^[^=]*\.$(1)='\(.*\)'$$/\1/p" | head -n 1 | sed 's/\\n/ /g')

# A half-made environment (no pip in it) is removed, so that the next call starts afresh.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "insenv needs Python 3.11 or newer, found %s; name another one: make PYTHON=..." % sys.version.split()[0])'
	@$(PYTHON) -m venv $(VENV) && $@ -m pip --version >/dev/null || { rm -rf $(VENV); exit 1; }

# Without a uv for this machine the stamp is still made: the installation below then takes pip.
$(VENV)/.uv: $(BIN)/python constraints.txt
	@$(BIN)/python -m pip install --no-user --quiet -c constraints.txt uv || echo 'No uv here; pip installs instead.'
	@touch $@

$(VENV)/.installed-%: pyproject.toml constraints.txt $(VENV)/.uv
	@echo 'Installing insenv into $(VENV) (once) ...'
	@$(pip_settings); \
	test -x $(BIN)/uv && $(BIN)/uv pip install --quiet --python $(BIN)/python -c constraints.txt -b constraints.txt -e '$(EXTRAS_$*)' || { \
		echo 'uv could not install; trying pip ...'; \
		PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --no-user --quiet -e '$(EXTRAS_$*)'; }
	@touch $@
