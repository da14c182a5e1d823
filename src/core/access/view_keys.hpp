// Keys by which a page that has no origin keeps itself current: for a while everybody who knows one may read
// what the page shows.
#pragma once

#include "core/text.hpp"

#include <webots_cloud/time.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::core {

/// A key is told for a lifetime, and good for one more.
class ViewKeys
{
public:
    static constexpr auto lifetime = std::chrono::minutes(10);

    /// `make` returns random words. Empty: there are no keys.
    explicit ViewKeys(std::function<std::string()> make) : make_(std::move(make)) {}

    /// The one to tell; empty: there is none.
    std::string current(TimePoint now)
    {
        if (make_ && (keys_.front().text.empty() || now - keys_.front().made >= lifetime)) {
            keys_.back() = std::exchange(keys_.front(), Key());
            keys_.front().text = make_();
            keys_.front().made = now;
        }
        return keys_.front().text;
    }

    bool knows(std::string_view key, TimePoint now) const
    {
        return !key.empty() && std::any_of(keys_.begin(), keys_.end(), [&](Key const& each) {
            return now - each.made < 2 * lifetime && equal_in_constant_time(key, each.text);
        });
    }

private:
    struct Key
    {
        Key() = default;

        std::string text;
        TimePoint made;
    };

    std::function<std::string()> make_;
    std::array<Key, 2> keys_; ///< The younger one first.
};

} // namespace webots_cloud::core
