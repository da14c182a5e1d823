// Watches of epoll that are kept for when other programs of our user have taken all that the kernel gives it.
#pragma once

#include "adapters/files/file_descriptor.hpp"

#include <cstddef>
#include <vector>

namespace webots_cloud::adapters {

/// The kernel counts them for each user. What we let go of is free for whoever asks next: mostly that is us,
/// unless another program asks without a pause.
class WatchReserve
{
public:
    static constexpr std::size_t side = 32; ///< As many descriptors watch as are watched, each all of them.
    static constexpr std::size_t descriptors = 2 * side;

    WatchReserve() = default;

    /// Takes all of the reserve, as far as there is any.
    void fill();

    /// There was no watch for a descriptor. From now on `may_watch` looks.
    void has_failed();

    /// Whether Asio may be given a descriptor. False: there is no watch, nor one that we could let go of.
    /// Asio keeps memory (176 bytes) for each descriptor that it could not watch, until the program ends.
    bool may_watch() { return !is_short() || find_free(); }

    /// Sees to it that there is a free watch, if need be one that we let go of.   False: none is left.
    bool find_free();

    /// Whether some of it was let go of, and is not back.
    bool is_short() const noexcept { return held_ < wanted_; }

    /// Takes back what is free.
    void refill();

private:
    void want(std::size_t count, std::size_t a_side);
    bool take();
    bool let_go();

    std::vector<FileDescriptor> watching_;
    std::vector<FileDescriptor> watched_;
    std::size_t wanted_ = 0;
    std::size_t held_ = 0; ///< Those before this one, in an order of all pairs.
};

} // namespace webots_cloud::adapters
