# So that `make`, `make test` and `make help` work without `-f Makefile.data`.
include Makefile.data
