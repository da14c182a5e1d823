// The range of ports from which each simulator gets one.
#pragma once

#include "core/refusals.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <functional>
#include <set>
#include <string>

namespace webots_cloud::core {

/// The answer when all of `max` places for simulations are taken (protocol section 4.3).
inline Failure too_many_simulations(int max)
{
    return refused(Refused::no_place, {{"max", std::to_string(max)}});
}

/// Numbers from `first` to `first + size - 1`, each lent to one simulation at a time.
class PortPool
{
public:
    PortPool(std::uint16_t first, int size) : first_(first), size_(size) {}

    /// The lowest number that is not lent and for which `take` succeeds.
    ///
    /// Errors: `too_many_simulations`.
    result<std::uint16_t> acquire(std::function<bool(std::uint16_t)> const& take)
    {
        for (int i = 0; i < size_ && first_ + i <= 65535; ++i) {
            auto const port = static_cast<std::uint16_t>(first_ + i);
            if (!lent_.contains(port) && take(port)) {
                lent_.insert(port);
                return port;
            }
        }
        return too_many_simulations(size_);
    }

    void release(std::uint16_t port) { lent_.erase(port); }

    std::size_t lent() const noexcept { return lent_.size(); }

private:
    std::uint16_t first_;
    int size_;
    std::set<std::uint16_t> lent_;
};

} // namespace webots_cloud::core
