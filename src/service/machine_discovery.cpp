#include <webots_cloud/machine_discovery.hpp>

#include "async/cancellation.hpp"
#include "async/task_group.hpp"
#include "core/discovery/announcements.hpp"
#include "core/discovery/machine_name.hpp"
#include "core/discovery/named_machines.hpp"
#include "core/pages/http_pages.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// Changes of thousands of machines are taken over together.
constexpr Duration machines_step = std::chrono::seconds(1);
constexpr Duration lookup_limit = std::chrono::seconds(20);
constexpr std::size_t max_announcement = 1000;

/// A name that is looked up. Shared with its lookup, which may still run when its entry is gone.
struct WatchedName
{
    WatchedName(ServerSpec entry, core::MachineName name) : machines(std::move(entry), std::move(name)) {}

    core::NamedMachines machines;
    bool is_asked = false; ///< A lookup is under way.
    bool is_removed = false;
};

HttpResponse refused_announcement(unsigned status, std::string_view why)
{
    return HttpResponse(status, std::string(core::html_type), std::string(why));
}

} // namespace

struct MachineDiscovery::Impl
{
    Impl(MachineDiscoveryParams parameters, NameService& name_service, Clock& time, Logger logger,
         MachineDiscoveryHooks others)
        : names(name_service), clock(time), log(std::move(logger)), hooks(std::move(others))
    {
        take(std::move(parameters));
    }

    void take(MachineDiscoveryParams parameters);
    void assemble();
    std::optional<ServerSpec> announced_machine(std::string address) const;
    void add(ServerSpec machine, std::string_view origin);
    void begin_lookups();
    asio::awaitable<void> look_up(std::shared_ptr<WatchedName> watched);
    void forget_silent();
    HttpResponse take_announcement(IncomingRequest const& request);
    asio::awaitable<result<>> run();

    MachineDiscoveryParams params;
    NameService& names;
    Clock& clock;
    Logger log;
    MachineDiscoveryHooks hooks;
    std::map<std::string, std::shared_ptr<WatchedName>, std::less<>> watched; ///< By their entries.
    core::AnnouncedMachines announced;
    ServerSpec announced_as; ///< How they are treated.
    std::vector<ServerSpec> servers;
    std::unordered_map<std::string, std::string> origins; ///< Of each of them.
    bool is_outdated = false;                             ///< `servers` may have changed.
    std::optional<async::TaskGroup> lookups;              ///< While `run` is awaited.
};

MachineDiscovery::MachineDiscovery(MachineDiscoveryParams params, NameService& names, Clock& clock,
                                   Logger log, MachineDiscoveryHooks hooks)
    : impl_(std::make_unique<Impl>(std::move(params), names, clock, std::move(log), std::move(hooks)))
{}

MachineDiscovery::~MachineDiscovery() = default;

void MachineDiscovery::apply(MachineDiscoveryParams params)
{
    impl_->take(std::move(params));
}

std::vector<ServerSpec> const& MachineDiscovery::servers() const noexcept
{
    return impl_->servers;
}

std::string_view MachineDiscovery::origin(std::string_view address) const
{
    auto const found = impl_->origins.find(std::string(address));
    return found == impl_->origins.end() ? std::string_view() : found->second;
}

HttpResponse MachineDiscovery::take_announcement(IncomingRequest const& request)
{
    return impl_->take_announcement(request);
}

asio::awaitable<result<>> MachineDiscovery::run()
{
    return impl_->run();
}

void MachineDiscovery::Impl::take(MachineDiscoveryParams parameters)
{
    params = std::move(parameters);
    announced_as = ServerSpec();
    auto known = std::exchange(watched, {});
    for (auto const& entry : params.entries) {
        if (entry.address == core::announced_entry)
            announced_as = entry;
        auto name = core::parse_machine_name(entry.address);
        if (!name || watched.contains(entry.address))
            continue;
        auto const found = known.find(entry.address);
        if (found == known.end()) {
            watched.emplace(entry.address, std::make_shared<WatchedName>(entry, std::move(*name)));
            continue;
        }
        found->second->machines.treat_as(entry);
        watched.insert(known.extract(found));
    }
    for (auto const& [entry, removed] : known)
        removed->is_removed = true;
    assemble();
}

void MachineDiscovery::Impl::add(ServerSpec machine, std::string_view origin)
{
    if (origins.emplace(machine.address, origin).second)
        servers.push_back(std::move(machine));
}

/// The list of machines from all that is known.
void MachineDiscovery::Impl::assemble()
{
    bool const has_spares = std::any_of(watched.begin(), watched.end(), [](auto const& entry) {
        return entry.second->machines.has_spares();
    });
    std::unordered_set<std::string> lost;
    if (has_spares && hooks.unreachable)
        lost = hooks.unreachable();
    auto const is_lost = [&lost](std::string_view address) { return lost.contains(std::string(address)); };
    servers.clear();
    origins.clear();
    for (auto const& entry : params.entries) {
        if (entry.address == core::announced_entry)
            continue;
        auto const name = watched.find(entry.address);
        if (name == watched.end()) {
            add(entry, {});
            continue;
        }
        for (auto& machine : name->second->machines.machines(is_lost))
            add(std::move(machine), entry.address);
    }
    for (auto& machine : announced.machines())
        if (auto spec = announced_machine(std::move(machine)))
            add(std::move(*spec), core::announced_entry);
    is_outdated = has_spares; // nobody says when one of them is lost
}

/// Treated as the entry "announced" says, if there is one. Nothing: it says that machines are reached inside,
/// and this one can't be.
std::optional<ServerSpec> MachineDiscovery::Impl::announced_machine(std::string address) const
{
    auto machine = announced_as;
    machine.address = std::move(address);
    return core::reach_inside(machine, std::nullopt) ? std::optional(std::move(machine)) : std::nullopt;
}

void MachineDiscovery::Impl::begin_lookups()
{
    for (auto const& [entry, name] : watched)
        if (!name->is_asked && name->machines.due() <= clock.now()) {
            name->is_asked = true;
            lookups->spawn(look_up(name));
        }
}

asio::awaitable<void> MachineDiscovery::Impl::look_up(std::shared_ptr<WatchedName> watched_name)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const name = watched_name->machines.name();
    auto const deadline = clock.now() + lookup_limit;
    auto asking =
        name.is_service ? names.services(name.name, deadline) : names.addresses(name.name, deadline);
    auto const answer = co_await std::move(asking);
    watched_name->is_asked = false;
    bool const cancelled = co_await async::is_cancelled();
    if (cancelled || watched_name->is_removed)
        co_return;
    auto const news = watched_name->machines.take(answer, clock.now(), params.loopback);
    if (!news.info.empty())
        log.info(news.info);
    if (!news.warning.empty())
        log.warning(core::printable(news.warning));
    is_outdated = true;
}

void MachineDiscovery::Impl::forget_silent()
{
    for (auto const& machine : announced.forget_silent(clock.now(), clock.wall())) {
        log.warning(concat(machine, " announces itself no longer, and is forgotten"));
        is_outdated = true;
    }
}

asio::awaitable<result<>> MachineDiscovery::Impl::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    lookups.emplace(co_await asio::this_coro::executor);
    bool running = true;
    while (running) {
        begin_lookups();
        forget_silent();
        if (is_outdated) {
            auto const before = servers;
            assemble();
            if (servers != before && hooks.changed)
                hooks.changed(servers);
        }
        auto const waited = co_await clock.wait_until(clock.now() + machines_step);
        bool const cancelled = co_await async::is_cancelled();
        running = waited && !cancelled;
    }
    lookups->cancel_all();
    co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
    co_await lookups->join();
    lookups.reset();
    co_return Failure(asio::error::operation_aborted);
}

HttpResponse MachineDiscovery::Impl::take_announcement(IncomingRequest const& request)
{
    if (!hooks.mac)
        return core::not_found_page();
    if (request.query.size() > max_announcement ||
        !core::equal_in_constant_time(request.header("Authorization"),
                                      core::sign_announcement(hooks.mac, request.query))) {
        log.warning(LogCause("announcement", request.client),
                    concat("An announcement of ", request.client,
                           " was refused: it is not signed with our \"sessionSecret\""));
        return refused_announcement(403, "This announcement is not signed with the \"sessionSecret\" here.");
    }
    auto const announcement = core::parse_announcement(request.query);
    if (!announcement)
        return refused_announcement(400, "Expected /api/machines?machine=<address>&at=<milliseconds>.");
    if (!announcement->is_goodbye && !announced_machine(announcement->machine))
        return refused_announcement(403, "This session server reaches machines by plain HTTP, and that only "
                                         "at addresses: set \"server\" to one.");
    auto const before = announced.size();
    auto const verdict = announced.take(*announcement, params.loopback, clock.now(), clock.wall());
    if (announced.size() != before) {
        is_outdated = true;
        log.info(concat(core::printable(announcement->machine),
                        announcement->is_goodbye ? " says goodbye" : " announces itself"));
    }
    switch (verdict) {
    case core::AnnouncementVerdict::accepted:
        return core::page("known");
    case core::AnnouncementVerdict::outdated:
        return refused_announcement(409, "The clocks of the two machines differ by more than two minutes.");
    case core::AnnouncementVerdict::repeated:
        return refused_announcement(409, "A later announcement of this machine is known.");
    case core::AnnouncementVerdict::refused:
        return refused_announcement(
            403, "Browsers can't be sent to this address: set \"server\" to a name that they can reach.");
    case core::AnnouncementVerdict::too_many:
        break;
    }
    return refused_announcement(503, "Too many machines have announced themselves.");
}

} // namespace webots_cloud
