# On a fresh machine with Python 3.11 to 3.13 and make: `make all` and `make test`.
PYTHON ?= python3
VENV   ?= .venv
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
else
BIN := $(VENV)/bin
endif
JOBS ?= 2
# A recording of a falling ball (.cihx), for its chapter of docs/accuracy.md; without one the chapter says so.
BALL ?=
STAMP := $(VENV)/.installed

.PHONY: help all demo paper test check accuracy bench tables clean
.DEFAULT_GOAL := help

help: ## list what can be made
	@$(PYTHON) -c "import re; [print(f'{m[1]:10} {m[2]}') for m in re.finditer(r'^([a-z]+):.*?## (.*)', open('Makefile', encoding='utf-8').read(), re.M)]"

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	@echo "trying the installation on the sample drop; this compiles the numerics once"
	$(BIN)/wentry run sample_frames -o build/sample -q
	@$(PYTHON) -c "open('$(STAMP)', 'w').close()"

all: demo ## environment, synthetic campaign, process, fit, report (at most 5 minutes)

demo: $(STAMP) ## render configs/demo.yaml and analyse it: build/demo/results/report.html
	$(BIN)/wentry render configs/demo.yaml -o build/demo/videos -j $(JOBS)
	$(BIN)/wentry process build/demo/videos -o build/demo/results -j $(JOBS)
	$(BIN)/wentry fit build/demo/results -j $(JOBS)
	$(BIN)/wentry compare build/demo/results build/demo/videos
	$(BIN)/wentry report build/demo/results

paper: $(STAMP) ## the same with the paper's 24 drops, configs/paper.yaml
	$(BIN)/wentry render configs/paper.yaml -o build/paper/videos -j $(JOBS)
	$(BIN)/wentry run build/paper/videos -o build/paper/results -j $(JOBS)
	$(BIN)/wentry compare build/paper/results build/paper/videos

test: $(STAMP) ## the tests (under 5 minutes on 2 cores)
	$(BIN)/python -m pytest -n 2 --dist loadfile

check: $(STAMP) ## lint and types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

accuracy: $(STAMP) ## slow accuracy sweeps, and docs/accuracy.md with them
	$(BIN)/python -m pip install --quiet --editable ".[dev,peers,fem]"
	$(BIN)/python -m pytest -m slow
	$(BIN)/wentry bench -o docs $(if $(BALL),--ball $(BALL))

bench: $(STAMP) ## speed: frames per second, memory, start-up, rendering, beside decoding alone
	$(BIN)/wentry bench --chapter throughput
	$(BIN)/python benchmarks/start_up.py
	$(BIN)/python benchmarks/memory.py 2000
	$(BIN)/python benchmarks/render.py

tables: $(STAMP) ## docs/tables.md from the schemas, docs/scenes.md from the models of a scene
	$(BIN)/python docs/make_tables.py
	$(BIN)/python docs/make_scenes.py

clean: ## remove what make made, the environment too
	$(PYTHON) -c "import shutil; [shutil.rmtree(d, ignore_errors=True) for d in ('build', '$(VENV)', '.pytest_cache', '.mypy_cache', '.ruff_cache')]"
