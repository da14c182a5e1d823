// The folder that holds the projects of running simulations: ours alone, and empty when we start.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <filesystem>
#include <utility>

namespace webots_cloud {

/// What a dead predecessor left.
struct LeftOvers
{
    std::size_t removed = 0;
    std::size_t kept = 0; ///< Could not be removed, and lie in the folder as `left-over-...`.
};

/// A locked folder. The lock lasts as long as this object and dies with the process, however that ends.
class InstanceRoot
{
public:
    /// So many folders at the end of a path are ours, as in `/tmp` and then `webots-1000/2000/instances`.
    static constexpr int levels = 3;

    /// Makes those folders if need be, locks the last one and removes what a dead predecessor left in it.
    ///
    /// Nobody else can have put them there, or put something else in their place later.   Errors:
    /// `invalid_argument`, its detail says what to do, when one of the three is a link, another user's or
    /// writable for others, when everybody may rename what is in the folder above them, when another server
    /// has the lock, or a folder can't be made.
    static result<InstanceRoot> open(std::filesystem::path const& folder);

    InstanceRoot(InstanceRoot&& other) noexcept
        : lock_(std::exchange(other.lock_, -1)), left_overs_(other.left_overs_)
    {}
    InstanceRoot& operator=(InstanceRoot&& other) noexcept
    {
        std::swap(lock_, other.lock_);
        std::swap(left_overs_, other.left_overs_);
        return *this;
    }
    ~InstanceRoot();

    LeftOvers const& left_overs() const noexcept { return left_overs_; }

private:
    InstanceRoot(int lock, LeftOvers left_overs) : lock_(lock), left_overs_(left_overs) {}

    int lock_;
    LeftOvers left_overs_;
};

} // namespace webots_cloud
