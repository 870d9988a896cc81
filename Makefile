# SPDX-License-Identifier: MIT
# Each target is also `python -m tools.NAME`; the first use makes .venv and installs into it.

PYTHON ?= python3
PY := .venv/bin/python
OUT := out

.PHONY: help demo test bench accuracy faults loop experiments figures image machine-code deploy lint types clean

demo bench: .venv/ready
	$(PY) -m tools.$@ $(ARGS)

accuracy: .venv/ready
	$(PY) -m tools.accuracy $(if $(DATA),--data $(DATA)) $(ARGS)

faults: .venv/ready
	$(PY) -m tools.faults $(ARGS)

experiments: .venv/ready
	$(PY) -m tools.experiments --out $(OUT)/experiments $(ARGS)

# Which mpy-cross compiles viper and native code right, executed on three instruction sets.
machine-code: .venv/ready
	$(PY) -m tools.machine_code $(ARGS)

# MicroPython for Pico and Pico W with the app frozen in, into out/image.
image: .venv/ready
	$(PY) -m tools.image --json $(OUT)/image/image.json $(ARGS)

# Measures all that the README quotes and writes it there; DATA: a folder of whole recordings.
figures: .venv/ready
	$(PY) -m tools.demo --out docs/demo.png
	$(PY) -m tools.bench --json $(OUT)/figures/bench.json
	$(PY) -m tools.accuracy $(if $(DATA),--data $(DATA)) --json $(OUT)/figures/accuracy.json
	$(PY) -m tools.faults --json $(OUT)/figures/faults.json
	$(PY) -m tools.experiments --out $(OUT)/figures
	$(PY) -m tools.figures $(OUT)/figures

deploy: .venv/ready
	$(PY) -m tools.deploy $(if $(PORT),--port $(PORT)) $(ARGS)

test: .venv/ready lint
	$(PY) -m tools.virtual.images all
	$(PY) -m pytest -n 2 --dist loadfile $(ARGS)

lint: .venv/ready
	.venv/bin/ruff check .

types: .venv/ready
	$(PY) -m tools.typecheck

.venv/ready: pyproject.toml
	$(PYTHON) -m venv .venv || { echo "No venv in $(PYTHON): apt-get install python3-venv"; exit 1; }
	.venv/bin/pip install --quiet --disable-pip-version-check --editable .
	touch $@

clean:
	rm -rf .venv $(OUT) build
