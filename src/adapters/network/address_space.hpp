// Whether the system still gives this process memory.
#pragma once

#include "adapters/files/file_descriptor.hpp"

#include <cstddef>
#include <fcntl.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdlib>

namespace webots_cloud::adapters {

/// Where the address space is limited (`ulimit -v`), an allocation that fails ends the program. So no
/// connections are added when little is left.
class AddressSpace
{
public:
    AddressSpace()
    {
        rlimit limit{};
        if (::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
            limit_ = static_cast<std::size_t>(limit.rlim_cur);
    }

    /// Whether more connections may be added. While they may, it looks once in `look_interval` calls.
    bool has_room()
    {
        if (limit_ > 0 && (calls_++ % look_interval == 0 || !has_room_))
            has_room_ = used() + reserve < limit_ + ::mallinfo2().fordblks; // which was freed
        return has_room_;
    }

private:
    static constexpr std::size_t look_interval = 64; // 64 connections with TLS take 3 MB
    /// For those that exist: a browser that does not read takes a quarter of a megabyte.
    static constexpr std::size_t reserve = 32 << 20;

    /// In bytes; 0: not known.
    static std::size_t used()
    {
        std::array<char, 64> text{};
        FileDescriptor const file(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
        if (!file || ::read(file.get(), text.data(), text.size() - 1) <= 0)
            return 0;
        return std::strtoull(text.data(), nullptr, 10) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    }

    std::size_t limit_ = 0; ///< Bytes; 0: there is none.
    std::size_t calls_ = 0;
    bool has_room_ = true;
};

} // namespace webots_cloud::adapters
