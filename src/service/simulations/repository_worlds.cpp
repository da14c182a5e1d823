// Lists the worlds of a repository or folder whose address somebody has pasted. A look fetches from a forge:
// so there are few at once, each client has few in a minute, and lists are kept for a while.
// Decisions: core/gallery/world_list, core/projects/repository_policy, core/access/token_buckets.
#include "repository_worlds.hpp"

#include "async/deadline.hpp"
#include "core/access/tickets.hpp"
#include "core/gallery/world_list.hpp"
#include "core/pages/http_pages.hpp"
#include "core/refusals.hpp"
#include "core/simulation/start_refusal.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr std::size_t looks_at_once = 4;
constexpr std::size_t kept_lists = 32;
constexpr auto lists_are_kept = std::chrono::seconds(30);
// Somebody waits for the answer in a browser.
constexpr auto longest_fetch = std::chrono::seconds(15);
constexpr auto longest_look = std::chrono::seconds(20); // with the wait for other fetches
constexpr std::uint64_t most_bytes = std::uint64_t{64} << 20;

/// As the rules are asked about it, whatever the link looks like.
std::string address_of(ProjectRef const& folder)
{
    auto address = concat(folder.forge, "/", folder.owner, "/", folder.repository, "/tree");
    for (auto const part : core::split(folder.ref_and_folder, '/'))
        address += concat("/", core::percent_encode(part));
    return address;
}

/// 503: it says something of this machine, and another one may have the list.
int status_of(Failure const& why)
{
    constexpr int good = 200;
    constexpr int elsewhere = 503;
    return core::refusal_at(core::StartStep::repository, why) == core::StartRefusal::everywhere ? good
                                                                                                : elsewhere;
}

} // namespace

bool RepositoryWorlds::serves(IncomingRequest const& request) noexcept
{
    bool const has_ticket = request.path.ends_with(path) && !core::ticket_in(request.path).empty();
    return request.method == "POST" && (request.path == path || has_ticket);
}

asio::awaitable<HttpResponse> RepositoryWorlds::answer(IncomingRequest const& request)
{
    auto const worlds =
        co_await list(request.path, std::string(core::trim(request.body)), std::string(request.quota_key));
    if (worlds)
        co_return core::json_page(core::world_list_json(*worlds));
    auto const why = worlds.error();
    context_.log.info(
        LogCause("worlds", request.client),
        concat("No list of worlds for ", core::printable(request.body, 200), ": ", why.message()));
    co_return HttpResponse(status_of(why), "application/json", core::world_list_error(why));
}

/// Those that an idle machine would run.
asio::awaitable<result<RepositoryWorlds::Worlds>>
RepositoryWorlds::list(std::string_view asked_path, std::string url, std::string quota_key)
{
    if (context_.state.is_draining())
        co_return core::refused(core::Refused::server_drains);
    auto refused = context_.hooks.refuse_ticket ? context_.hooks.refuse_ticket(core::ticket_in(asked_path))
                                                : std::nullopt;
    if (refused)
        co_return std::move(*refused);
    // What costs nothing comes first. The rules are asked before anything is fetched: a repository that may
    // not run here need not be looked into.
    auto const forge = context_.fetcher.forge_of(url);
    auto const folder = context_.fetcher.parse_folder(url);
    if (!forge || !folder)
        co_return forge ? folder.error() : forge.error();
    core::ForgeOfWorld const place(forge->address.url, forge->source.get().ref_meaning(),
                                   forge->address.kind);
    auto const address = address_of(*folder);
    if (auto why = core::refusal(context_.policy, address, place, context_.load))
        co_return std::move(*why);
    result<Worlds> worlds = Worlds();
    // A folder of this machine has been searched already (`LocalWorlds`). Lists of servers are kept for a
    // while, since a whole class opens the same link. Only those who have one fetched are counted
    // (`may_look`).
    if (forge->source.get().is_local()) {
        auto const parse = [this](std::string_view each) { return context_.fetcher.parse(each); };
        worlds = local_.worlds_in(*folder, parse);
    } else if (auto const kept = kept_.find(address);
               kept != kept_.end() && context_.clock.now() - kept->second.made < lists_are_kept) {
        worlds = kept->second.worlds;
    } else {
        if (auto const allowed = may_look(quota_key); !allowed)
            co_return allowed.error();
        worlds = co_await look(*folder);
        if (!worlds)
            co_return worlds.error();
        keep(address, *worlds);
    }
    // Kept lists have all worlds: the rules may be others by the time of the next answer.
    std::erase_if(*worlds, [&](ListedWorld const& world) {
        return core::refusal(context_.policy, world.url, place, 0).has_value();
    });
    co_return worlds;
}

result<> RepositoryWorlds::may_look(std::string_view quota_key)
{
    auto const now = context_.clock.now();
    if (looks_.size() >= looks_at_once || asked_.take(quota_key, now) != core::TokenBuckets::Verdict::taken)
        return core::refused(core::Refused::too_many_lists);
    return {};
}

asio::awaitable<result<RepositoryWorlds::Worlds>> RepositoryWorlds::look(ProjectRef folder)
{
    FetchLimits limits;
    limits.bytes = most_bytes;
    limits.timeout = longest_fetch;
    auto const site = folder.forge;
    auto const latest = context_.clock.now() + longest_look;
    auto listed = context_.fetcher.list_worlds(std::move(folder), limits);
    auto outcome = co_await looks_.run(async::with_deadline(context_.clock, latest, std::move(listed)));
    // A failure that has a sentence of its own is passed on. The others are named by codes alone, which tell
    // a person nothing.
    if (outcome || outcome.error().info())
        co_return outcome;
    auto const why = outcome.error();
    if (why.code() == asio::error::operation_aborted)
        co_return core::refused(core::Refused::server_stops);
    if (why == errc::timed_out)
        co_return core::refused(core::Refused::site_unreachable,
                                {{"site", site}, {"why", "it takes too long"}});
    if (why == errc::unavailable)
        co_return core::refused(core::Refused::cannot_list);
    co_return why;
}

/// The oldest ones go.
void RepositoryWorlds::keep(std::string const& address, Worlds const& worlds)
{
    auto& kept = kept_[address];
    kept.made = context_.clock.now();
    kept.worlds = worlds;
    if (kept_.size() > kept_lists)
        kept_.erase(std::ranges::min_element(kept_, {}, [](auto const& entry) { return entry.second.made; }));
}

} // namespace webots_cloud
