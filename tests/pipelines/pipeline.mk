# What Makefile.data gives pipelines/rules.mk, without building anything: BIN and DATA come from the test.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules

PYTHON ?= /usr/bin/python3
all: pipeline

include pipelines/rules.mk
