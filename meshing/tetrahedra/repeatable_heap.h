// Makes the addresses of allocations depend on the order of the allocations alone, because gmsh orders points by
// address.
//
// gmsh hands the points of the surface to HXT in the order of their addresses (a std::set of pointers), and HXT's
// mesh depends on this order. The addresses that malloc returns depend on everything that the process did before. A
// child process that calls use_repeatable_heap first takes the memory of `new` from one range, always in the same
// way. So the same input gives the same mesh. Linking this file replaces operator new and delete of the program.
// Before the call they use malloc and free.
#pragma once

namespace palpate {

// From this call on, allocations of up to 1 MB come from the range; std::bad_alloc when the range is full. Call it
// before any thread starts. Errors: OperationError when a limit of the process leaves no address space for the range.
void use_repeatable_heap();

// Returns whether the memory block was allocated from the range.
bool is_in_repeatable_heap(const void* block);

}  // namespace palpate
