// Which shared libraries this program computes with, so that an upgrade between two runs is noticed.
#pragma once

#include <map>
#include <string>

namespace palpate {

// By file name without its version ("libpetsc_real.so"): the build id that the linker wrote into the library, or the
// SHA-256 of its file where it has none. Holds the libraries that this program names when it is linked (PETSc, CHOLMOD,
// METIS, BLAS, HDF5, MPI, libc, libm ...) and, in turn, those that these name. Leaves out what a launcher, LD_PRELOAD
// or a plug-in of MPI adds: it differs between runs on one rank and on several.
std::map<std::string, std::string> needed_libraries();

}  // namespace palpate
