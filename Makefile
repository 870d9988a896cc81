# SPDX-License-Identifier: MIT
# Each target is also `python -m tools.NAME`; the first use makes .venv and installs into it.

PYTHON ?= python3
PY := .venv/bin/python
OUT := out

.PHONY: help demo test bench loop accuracy starts faults experiments figures machine-code image docs \
	scope deploy lint types clean

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' Makefile | expand -t 22

demo: .venv/ready  ## main.py's own code on a virtual board that replays a recorded motion
	$(PY) -m tools.demo $(ARGS)

test: .venv/ready lint  ## everything that must hold, on CPython and on real MicroPython
	$(PY) -m tools.virtual.images all
	$(PY) -m pytest -n 2 --dist loadfile $(ARGS)

bench: .venv/ready  ## time and heap of each stage on the emulated RP2040
	$(PY) -m tools.bench $(ARGS)

loop: .venv/ready  ## the loop under load, on the emulated RP2040
	$(PY) -m tools.loop $(ARGS)

accuracy: .venv/ready  ## tilt error against optical truth; DATA=folder of recordings
	$(PY) -m tools.accuracy $(if $(DATA),--data $(DATA)) $(ARGS)

starts: .venv/ready  ## starts on a poor bus, at every setting, in motion; slow turns, warmth
	$(PY) -m tools.starts $(ARGS)

faults: .venv/ready  ## every kind of fault injected in motion
	$(PY) -m tools.faults $(ARGS)

experiments: .venv/ready  ## the four papers' figures and the three robots
	$(PY) -m tools.experiments --out $(OUT)/experiments $(ARGS)

machine-code: .venv/ready  ## which mpy-cross compiles right, executed on three instruction sets
	$(PY) -m tools.machine_code $(ARGS)

image: .venv/ready  ## MicroPython for Pico and Pico W with the app frozen in
	$(PY) -m tools.image --json $(OUT)/image/image.json $(ARGS)

scope: .venv/ready  ## the live page, on 127.0.0.1
	$(PY) -m tools.scope $(ARGS)

docs: .venv/ready  ## the site, strict, into out/docs
	$(PY) -m tools.docs $(ARGS)

figures: .venv/ready  ## measures all that the pages quote and writes it there
	$(PY) -m tools.demo --out docs/site/demo.png
	$(PY) -m tools.bench --json $(OUT)/figures/bench.json
	$(PY) -m tools.accuracy $(if $(DATA),--data $(DATA)) --json $(OUT)/figures/accuracy.json
	$(PY) -m tools.faults --json $(OUT)/figures/faults.json
	$(PY) -m tools.experiments --out $(OUT)/figures
	$(PY) -m tools.figures $(OUT)/figures

deploy: .venv/ready  ## copy the project to a board; PORT=/dev/ttyACM0
	$(PY) -m tools.deploy $(if $(PORT),--port $(PORT)) $(ARGS)

lint: .venv/ready  ## ruff
	.venv/bin/ruff check .

types: .venv/ready  ## mypy with the stubs of both ports
	$(PY) -m tools.typecheck

clean:  ## remove .venv and what was made
	rm -rf .venv $(OUT) build

.venv/ready: pyproject.toml tools/virtual/rp2040/build.py tools/virtual/rp2040/changes.py
	$(PYTHON) -m venv .venv || { echo "No venv in $(PYTHON): apt-get install python3-venv"; exit 1; }
	.venv/bin/pip install --quiet --disable-pip-version-check --editable .
	$(PY) -m tools.virtual.rp2040.build
	touch $@
