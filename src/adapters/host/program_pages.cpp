#include "program_pages.hpp"

#include <cstddef>
#include <cstdint>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

/// Segments that nothing writes to are as they are in their file. Others must not be touched: the kernel
/// would forget what was written, relocations included.
int release_segments(dl_phdr_info* object, std::size_t, void*)
{
    auto const page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    for (int i = 0; i < object->dlpi_phnum; ++i) {
        auto const& segment = object->dlpi_phdr[i];
        if (segment.p_type != PT_LOAD || (segment.p_flags & PF_W) != 0)
            continue;
        auto const begin = (object->dlpi_addr + segment.p_vaddr) & ~(page - 1);
        auto const end = object->dlpi_addr + segment.p_vaddr + segment.p_filesz;
        ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
    }
    return 0;
}

} // namespace

void release_program_pages() noexcept
{
    ::dl_iterate_phdr(release_segments, nullptr);
}

} // namespace webots_cloud::adapters
