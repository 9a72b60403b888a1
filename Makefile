# Two commands do everything on a fresh machine with Python (3.11 or later) and make:
#
#   make figures           run every notebook with short settings; figures go to figures/quick/
#   make figures FULL=1    the same at the paper's scale; figures go to figures/
#   make test              run every check but those that need a browser (make test-browser)
#
# Also: make lab (open the notebooks), make html (every executed notebook as a page, into build/html/), make docs
# (documentation and API reference, into build/docs/), make mutants (do the tests notice small changes of the code?),
# make format, make pins, make clean, make clean-all.
# Settings: PYTHON=python3.12 (which Python makes .venv), JOBS=2 (notebooks at a time),
# TESTS="-k layers" (which tests, and other words for pytest).

PYTHON =
JOBS =
FULL =
PART =
TESTS = -n auto

VENV = .venv
BIN = $(VENV)/bin
PINS = environment/requirements.txt
READY = $(VENV)/.package-installed
PIP = PIP_DISABLE_PIP_VERSION_CHECK=1 $(BIN)/python -m pip install --quiet --quiet

.PHONY: figures test test-browser mutants page-pictures lab html docs format pins clean clean-all

figures: $(READY)
	@$(BIN)/bicode figures $(if $(filter-out 0 no,$(FULL)),--full) $(if $(JOBS),--jobs $(JOBS))

test: $(READY)
	@echo "ruff (style)" && $(BIN)/ruff check --quiet .
	@echo "mypy (types)" && $(BIN)/mypy --strict bicode_lab bicode_studies
	@echo "pytest (laws, oracles, rules, every notebook, documentation)" && $(BIN)/python -m pytest -m "not browser" $(TESTS)

# The page of `bicode what-if` and a notebook in JupyterLab, in a real browser; skipped where Chromium is absent.
test-browser: $(READY)
	@$(BIN)/python -m pytest -m browser -rs tests/browser

# Change the code in many small ways, one at a time, in a copy, and count how many changes a test notices: a sample, or
# all with FULL=1; PART="marker score" tries these parts only. A run that was stopped goes on where it was.
mutants: $(READY)
	@$(BIN)/python tests/mutation/run.py $(if $(filter-out 0 no,$(FULL)),--full) $(addprefix --part ,$(PART))

# The pictures of the page in figures/, looked at by people and compared by nobody.
page-pictures: $(READY)
	@BICODE_PAGE_PICTURES=figures $(BIN)/python -m pytest -m browser tests/browser/test_what_if_page.py

lab: $(READY)
	@$(BIN)/jupyter lab notebooks

html: $(READY)
	@$(BIN)/bicode html $(if $(filter-out 0 no,$(FULL)),--full) $(if $(JOBS),--jobs $(JOBS))

docs: $(READY)
	@$(BIN)/mkdocs build --quiet --strict && echo "open build/docs/index.html"

format: $(READY)
	@$(BIN)/ruff check --quiet --fix . ; $(BIN)/ruff format .

# The package itself, in place. Its build tool is among the pins, so nothing else is fetched.
$(READY): $(VENV)/.pins-installed pyproject.toml
	@echo "installing bicode_lab"
	@$(PIP) --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.pins-installed: $(PINS) | $(BIN)/python
	@echo "installing the pinned packages into $(VENV) (once; a few minutes)"
	@$(PIP) --require-hashes -r $(PINS)
	@touch $@

$(BIN)/python:
	@found=; for each in $(PYTHON) python3 python3.13 python3.12 python3.11 python; do \
	  if "$$each" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then found=$$each; break; fi; \
	done; \
	if [ -z "$$found" ]; then \
	  echo "bicode_lab needs Python 3.11, 3.12 or 3.13, and none was found; install one, or: make PYTHON=/where/it/is" >&2; exit 1; \
	fi; \
	echo "making $(VENV) with $$("$$found" --version)"; \
	"$$found" -m venv --clear $(VENV) || { \
	  rm -rf $(VENV); echo "$$found cannot make a virtual environment; on Debian or Ubuntu: apt install python3-venv" >&2; exit 1; }

# Solve the dependencies anew: the newest versions that install on Python 3.11, 3.12 and 3.13.
pins: $(BIN)/python
	@rm -rf build/pins && $(BIN)/python -m venv build/pins && build/pins/bin/python -m pip install --quiet uv
	@build/pins/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --extra app --extra test --extra build --extra docs \
	  --custom-compile-command "make pins" pyproject.toml -o $(PINS) >/dev/null
	@echo "$(PINS): $$(grep -c == $(PINS)) packages; now: make test"

clean:
	@rm -rf build dist *.egg-info figures/quick results/quick .pytest_cache .mypy_cache .ruff_cache .hypothesis
	@find bicode_lab bicode_studies tests notebooks -name __pycache__ -prune -exec rm -rf {} +

clean-all: clean
	@rm -rf $(VENV)
