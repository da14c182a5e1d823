// Decisions: core/gallery/world_list, core/simulation/first_picture.
#include "world_pictures.hpp"

#include "async/cancellation.hpp"
#include "core/gallery/world_list.hpp"
#include "core/pages/http_pages.hpp"
#include "core/simulation/first_picture.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr auto picture_look = std::chrono::seconds(2);
constexpr int first_look = 3; // by then something moves
constexpr int last_look = 10; // nobody watches, or it shows nothing
constexpr std::size_t most_pictures = 32;
constexpr std::size_t least_picture = 2000; // bytes: one of a single colour is smaller

} // namespace

asio::awaitable<result<>> WorldPictures::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        auto const waited = co_await clock_.wait_until(clock_.now() + picture_look);
        if (!waited)
            co_return waited;
        auto const session = taker_ ? next() : nullptr;
        if (!session)
            continue;
        auto key = core::picture_key(session->address());
        auto picture = co_await taker_->take(session->gateway().simulator());
        if (picture && picture->size() >= least_picture)
            keep(std::move(key), std::move(*picture));
        bool const cancelled = co_await async::is_cancelled(); // while it was taken
        if (cancelled)
            co_return Failure(asio::error::operation_aborted);
    }
}

/// The next simulation whose picture is to be taken; null: none.
std::shared_ptr<SimulationSession> WorldPictures::next()
{
    std::erase_if(looks_, [this](auto const& entry) { return !sessions_.contains(entry.first); });
    std::shared_ptr<SimulationSession> chosen;
    for (auto const& [id, session] : sessions_) {
        if (!session->streams_pictures() || kept_.contains(core::picture_key(session->address())))
            continue;
        auto& looks = looks_[id];
        if (looks < last_look && ++looks >= first_look && !chosen)
            chosen = session;
    }
    return chosen;
}

void WorldPictures::keep(std::string key, std::string picture)
{
    if (!core::is_world_picture(picture))
        return;
    auto& kept = kept_[std::move(key)];
    kept.number = ++last_number_;
    kept.page.set(std::move(picture));
    auto const by_number = [](auto const& entry) { return entry.second.number; };
    if (kept_.size() > most_pictures)
        kept_.erase(std::ranges::min_element(kept_, {}, by_number));
}

HttpResponse WorldPictures::answer(std::string_view key, std::string_view if_none_match) const
{
    auto const found = kept_.find(key);
    return found == kept_.end() ? core::not_found_page()
                                : found->second.page.answer("image/jpeg", if_none_match);
}

std::vector<std::string> WorldPictures::keys() const
{
    std::vector<std::string> keys;
    for (auto const& [key, kept] : kept_)
        keys.push_back(key);
    return keys;
}

} // namespace webots_cloud
