// The folder that holds the projects of running simulations: ours alone, and empty when we start.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <filesystem>
#include <utility>

namespace webots_cloud {

/// A locked folder. The lock lasts as long as this object and dies with the process, however that ends.
class InstanceRoot
{
public:
    /// Makes the folder if need be, locks it and removes what a dead predecessor left.
    ///
    /// Errors: `invalid_argument` when it belongs to another user, is open to others, is locked by another server, or can't
    /// be made.
    static result<InstanceRoot> open(std::filesystem::path const& folder);

    InstanceRoot(InstanceRoot&& other) noexcept :
        lock_(std::exchange(other.lock_, -1)), removed_(other.removed_)
    {}
    InstanceRoot& operator=(InstanceRoot&& other) noexcept
    {
        std::swap(lock_, other.lock_);
        std::swap(removed_, other.removed_);
        return *this;
    }
    ~InstanceRoot();

    /// How many left-overs there were.
    std::size_t removed() const noexcept { return removed_; }

private:
    InstanceRoot(int lock, std::size_t removed) : lock_(lock), removed_(removed) {}

    int lock_;
    std::size_t removed_;
};

} // namespace webots_cloud
