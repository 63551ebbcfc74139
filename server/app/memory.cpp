#include "server/app/memory.hpp"

#include <link.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>

namespace saccade {
namespace {

constexpr int kHeaps = 2;  // one is fought over by tracker, simulator and encoders
// Less is not worth it: giving it back holds each heap for a millisecond or two.
constexpr std::size_t kFreedBytes = std::size_t{8} << 20;

std::size_t PageSize() { return static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)); }

/// Segments that nobody may write hold what the file holds, bit by bit: they can be read again.
int LetGo(dl_phdr_info* object, std::size_t /*size*/, void* /*unused*/) {
  const std::uintptr_t page = PageSize();
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = object->dlpi_phdr[i];
    if (segment.p_type != PT_LOAD || (segment.p_flags & PF_W) != 0) continue;
    const std::uintptr_t begin = (object->dlpi_addr + segment.p_vaddr + page - 1) / page * page;
    const std::uintptr_t end =
        (object->dlpi_addr + segment.p_vaddr + segment.p_filesz) / page * page;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): addresses are numbers in an ELF file
    if (end > begin) ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
  }
  return 0;
}

}  // namespace

ResidentMemory ReadResidentMemory() {
  std::size_t size = 0, resident = 0, of_files = 0;
  std::ifstream("/proc/self/statm") >> size >> resident >> of_files;
  return {resident * PageSize(), of_files * PageSize()};
}

void ShareHeaps() { ::mallopt(M_ARENA_MAX, kHeaps); }

void GiveBackFreedMemory() {
  if (::mallinfo2().fordblks > kFreedBytes) ::malloc_trim(0);
}

void GiveBackUnusedCode() { ::dl_iterate_phdr(LetGo, nullptr); }

}  // namespace saccade
