// The texts of mails to the operator about simulation servers, word for word (protocol section 10).
#pragma once

#include <webots_cloud/notice.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/server_load.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// True when the operator is notified of such a change. One that was merely too slow is logged, and never
/// mailed.
bool is_news(LoadTransition transition) noexcept;

/// A change of one simulation server that the operator is notified of.
struct News
{
    News() = default;
    /// Precondition: `is_news(event.transition)`.
    News(LoadEvent const& event, WallTime when);

    std::string subject;
    std::string sentence;
    WallTime when;
};

/// Where the administrator looks: `https://server/port/monitor`, with `:` instead of `/` where no proxy
/// rewrites ports.
std::string monitor_url(PublicAddress const& address);

/// One change.
Notice news_notice(News const& news, std::string_view monitor);

/// Several changes, in the order given, each with its time. `left_out` older ones are no longer known. A
/// single one is told as ever.   Precondition: `news` is not empty.
Notice digest_notice(std::vector<News> const& news, std::size_t left_out, std::string_view monitor);

} // namespace webots_cloud::core
