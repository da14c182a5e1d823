// Makes the first, the second, the third ... fallible call of a scenario fail.
#pragma once

#include <webots_cloud/error.hpp>

#include <optional>
#include <utility>

namespace webots_cloud::testing {

/// Blows at the n-th call; a default-constructed one never does. Sits in every fake.
///
/// A torture test runs its scenario with n = 1, 2, 3 ... until a run ends with `blown()` false.
class Fuse
{
public:
    Fuse() = default;
    explicit Fuse(int calls, Failure failure = Failure(errc::unreachable, "the fuse blew"))
        : left_(calls), failure_(std::move(failure))
    {}

    /// The failure to report, or nothing when the call may go on.
    std::optional<Failure> strike()
    {
        if (left_ == 0 || --left_ > 0)
            return std::nullopt;
        blown_ = true;
        return failure_;
    }

    bool blown() const noexcept { return blown_; }

private:
    int left_ = 0;
    Failure failure_;
    bool blown_ = false;
};

} // namespace webots_cloud::testing
