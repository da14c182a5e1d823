#include "news_digest.hpp"

#include <utility>

namespace webots_cloud::core {

bool NewsDigest::at_once(std::string_view server, News const& news, TimePoint now)
{
    forget_calm_ones(now);
    auto& account = servers_[std::string(server)];
    account.last = now;
    if (account.spent < rule_.server_at_once && total_spent_ < rule_.total_at_once) {
        ++account.spent;
        ++total_spent_;
        return true;
    }
    if (!due_)
        due_ = now + rule_.interval;
    collected_.news.push_back(news);
    if (collected_.news.size() > rule_.longest) {
        collected_.news.erase(collected_.news.begin());
        ++collected_.left_out;
    }
    return false;
}

Digest NewsDigest::take()
{
    due_.reset();
    return std::exchange(collected_, Digest());
}

void NewsDigest::forget_calm_ones(TimePoint now)
{
    std::erase_if(servers_, [&](auto const& entry) { return now - entry.second.last >= rule_.interval; });
    if (servers_.empty())
        total_spent_ = 0;
}

} // namespace webots_cloud::core
