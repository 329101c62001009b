// Addresses that depend on the order of allocations alone, because gmsh orders points by their addresses.
//
// gmsh hands the surface's points to HXT in the order of their addresses (a std::set of pointers), and the mesh that HXT makes
// depends on that order. The addresses that malloc returns depend on everything the process did before. In a child process
// that calls use_repeatable_heap first, `new` takes memory from one range and always in the same way, so the same input gives
// the same mesh. Linking this file replaces operator new and delete of the program; before the call they use malloc and free.
#pragma once

namespace palpate {

// From now on allocations of up to 1 MB come from the range; std::bad_alloc when the range is full. Call it before any thread
// starts. Errors: OperationError when a limit of the process leaves no address space for the range.
void use_repeatable_heap();

// Whether block was allocated from the range.
bool is_in_repeatable_heap(const void* block);

}  // namespace palpate
