# make study    set up .venv, run the whole study: results/<question>, results/report/index.html, results/report.zip
# make test     set up .venv, run the tests of the core
# make check    the smoke workflow and all other tests: of the study, pages, attacks; lint
# make smoke    the reduced study alone: results/smoke
# make report   the study's report anew: results/report/index.html, results/report.zip
# make figures  the study's pictures into reports/figures, those that are there by name
# make tables   tables of results/ that pages quote into reports/tables, and their numbers into the pages
# make docs     the documentation site, without a network: results/docs/index.html
# make check-cpus   all tests with the code of two other processors, each from an empty kernel cache
# make lint     ruff, mypy;   make bench   speed measurements;   make clean   remove everything generated
#
# PYTHON=python3.12 chooses the interpreter for a new .venv, CORES=4 the cores for the workflow.

PYTHON ?= python3
CORES ?= 2
BIN := .venv/bin
STAMP := .venv/.installed
DOCS_STAMP := .venv/.docs
SNAKEMAKE := $(BIN)/snakemake --cores $(CORES)
# One worker per core: threads of their BLAS would wait for each other, ten times as long as they calculate.
PYTEST := OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(CORES) --dist loadfile --no-loadscope-reorder

.PHONY: study test check test-check check-cpus smoke report figures tables docs lint bench clean

study: $(STAMP)
	$(SNAKEMAKE)

test: $(STAMP)
	$(PYTEST) -m "not check"

check: $(STAMP)
	@$(MAKE) --no-print-directory -j 2 lint test-check

test-check:
	$(PYTEST) -m check

check-cpus: $(STAMP)
	export NPY_DISABLE_CPU_FEATURES="$$($(BIN)/python -c \
	    'import numpy._core._multiarray_umath as m; print(*m.__cpu_dispatch__)')"; \
	for pair in x86-64-v3:Haswell x86-64-v2:Nehalem; do \
	    NUMBA_CPU_NAME=$${pair%:*} NUMBA_CPU_FEATURES= OPENBLAS_CORETYPE=$${pair#*:} WRCORE_CACHE=$$(mktemp -d) \
	    $(PYTEST) || exit 1; done

smoke: $(STAMP)
	$(SNAKEMAKE) --configfile config/smoke.yaml

report: $(STAMP)
	$(SNAKEMAKE) --forcerun report_pages report_archive

figures:
	for path in $(wildcard results/*/*.png); do \
	    if [ -e reports/figures/$${path##*/} ]; then cp $$path reports/figures/ || exit 1; fi; done

tables: $(STAMP)
	$(BIN)/python -m docs.quoted --write results

docs: $(DOCS_STAMP)
	$(BIN)/python docs/build.py results/docs

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(STAMP)
	$(SNAKEMAKE) --forcerun cost_pairs cost_growth cost_stages cost_runs -- cost_study

clean:
	rm -rf results logs benchmarks .snakemake

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c "import sys; sys.exit(0 if sys.version_info >= (3, 11) else \
	    'wrcore needs Python 3.11 or newer; this is ' + sys.version.split()[0] + '. Try: make PYTHON=python3.11')"
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[study,test,lint]"
	@touch $@

$(DOCS_STAMP): $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[docs]"
	@touch $@
