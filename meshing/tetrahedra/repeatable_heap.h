// Addresses that depend on the order of allocations alone, because gmsh numbers points by where they lie in memory.
//
// gmsh hands HXT the surface's points in the order of their addresses (a std::set of pointers), and HXT's result
// depends on that order; malloc's addresses depend on everything the process did before. In a child process that calls
// use_repeatable_heap first, `new` takes memory from one range, always in the same way, so the same input gives the
// same mesh. Linking this file replaces operator new and delete of the program; before the call they are malloc and
// free.
#pragma once

namespace palpate {

// From now on small allocations of this process come from the range; call it before any thread starts. When the range
// cannot be had or is full, malloc goes on serving.
void use_repeatable_heap();

}  // namespace palpate
