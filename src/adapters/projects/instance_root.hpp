// The folder that holds the projects of running simulations: ours alone, and empty when we start.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {

/// What a dead predecessor left.
struct LeftOvers
{
    LeftOvers() = default;

    std::size_t removed = 0;
    std::size_t kept = 0; ///< Could not be removed, and lie in the folder as `left-over-...`.
};

/// A locked folder. The lock lasts as long as this object and dies with the process, however that ends.
class InstanceRoot
{
public:
    /// Whether `state` may be a link.
    enum class State
    {
        no_link,
        may_be_link
    };

    /// Makes `<state>/<name>/instances` and `<state>/<name>/brokers` if need be, locks the first
    /// and removes what a dead predecessor left in it.
    ///
    /// All are ours: what is in the way of the inner ones is set aside, and modes are mended, since
    /// simulations run as the same user. Nobody else can have put them there, or put something else in their
    /// place later.
    /// Errors: `invalid_argument`, its detail says what to do, when `state` is another user's, or everybody
    /// may rename what is in the folder above it; another code where a later attempt may succeed: another
    /// server has the lock, or a disk is full.
    static result<InstanceRoot> open(std::filesystem::path const& state, std::string const& name,
                                     State link = State::no_link);

    InstanceRoot(InstanceRoot&& other) noexcept
        : lock_(std::exchange(other.lock_, -1)), left_overs_(other.left_overs_),
          path_(std::move(other.path_)), brokers_(std::move(other.brokers_)),
          notices_(std::move(other.notices_))
    {}
    InstanceRoot& operator=(InstanceRoot&& other) noexcept
    {
        std::swap(lock_, other.lock_);
        std::swap(left_overs_, other.left_overs_);
        std::swap(path_, other.path_);
        std::swap(brokers_, other.brokers_);
        std::swap(notices_, other.notices_);
        return *this;
    }
    ~InstanceRoot();

    /// The folder.
    std::filesystem::path const& path() const noexcept { return path_; }

    /// Beside it: a folder for the sockets of brokers (`ProcessNetwork::broker`), ours alone.
    std::filesystem::path const& brokers() const noexcept { return brokers_; }

    LeftOvers const& left_overs() const noexcept { return left_overs_; }

    /// Tries again to remove everything that is in the folder, which nothing may be that is in use yet.
    void remove_left_overs();

    /// What was found and mended: sentences for the operator.
    std::vector<std::string> const& notices() const noexcept { return notices_; }

private:
    InstanceRoot() = default;

    int lock_ = -1;
    LeftOvers left_overs_;
    std::filesystem::path path_;
    std::filesystem::path brokers_;
    std::vector<std::string> notices_;
};

} // namespace webots_cloud::adapters
