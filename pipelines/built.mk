# The pipelines with programs that are already built, for batch jobs and tests: nothing is compiled, so that jobs that start
# together do not compile at once.
#
#   make -f pipelines/built.mk ORGAN=liver BC=diaphragm BIN=build/bin DATA=data
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules

BIN ?= build/bin
DATA ?= data
PYTHON ?= /usr/bin/python3
all: pipeline

include pipelines/rules.mk
