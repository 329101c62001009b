# The pipelines with programs that are already built, for batch jobs and tests: jobs that start together must not all compile.
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
