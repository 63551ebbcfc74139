#pragma once

#include <cstddef>

namespace saccade {

/// What a process has in memory by /proc/self/statm [bytes]; zeros if it cannot be read.
struct ResidentMemory {
  std::size_t all = 0;
  std::size_t of_files = 0;  // code and constants of programs and libraries
};
ResidentMemory ReadResidentMemory();

/// Two heaps for all threads together, instead of eight for each core: what one thread frees then
/// serves the others. First of all in main.
void ShareHeaps();

/// Gives freed memory back to the system where the allocator keeps a lot of it.
void GiveBackFreedMemory();

/// Lets go of the pages of code and constants in memory, all of them; those in use come back from
/// the system's cache as they are touched. Half of what a server has mapped is the shader
/// compiler's, which is done before the second picture.
void GiveBackUnusedCode();

}  // namespace saccade
