// Keeps one list of machines from three sources (entries, names, announcements), and tells only what changes
// in it.
// Decisions: core/discovery/machine_list, core/discovery/named_machines, core/discovery/announcements.
#include <webots_cloud/machine_discovery.hpp>

#include "async/cancellation.hpp"
#include "async/task_group.hpp"
#include "core/discovery/announcements.hpp"
#include "core/discovery/machine_list.hpp"
#include "core/discovery/machine_name.hpp"
#include "core/discovery/named_machines.hpp"
#include "core/pages/http_pages.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// How often the machines are looked after. What happens in between is taken over together.
constexpr Duration machines_step = std::chrono::seconds(1);
// This many machines in one turn of the event loop, so that others have theirs in between: each that comes is
// polled, and the connection to each that goes is closed.
constexpr std::size_t machines_at_once = 10;
constexpr Duration machines_pause = std::chrono::milliseconds(2);
constexpr Duration lookup_limit = std::chrono::seconds(20);
// Bytes of a query, which has three short fields.
constexpr std::size_t max_announcement = 1000;

/// A name that is looked up. Shared with its lookup, which may still run when its entry is gone.
struct WatchedName
{
    WatchedName(ServerSpec entry, core::MachineName name) : machines(std::move(entry), std::move(name)) {}

    core::NamedMachines machines;
    std::vector<ServerSpec> named; ///< In the list, by this name, in the order of their addresses.
    std::size_t source = 0;        ///< There.
    bool is_asked = false;         ///< A lookup is under way.
    bool is_removed = false;
};

HttpResponse refused_announcement(unsigned status, std::string_view why)
{
    return HttpResponse(status, std::string(core::html_type), std::string(why));
}

} // namespace

struct MachineDiscovery::Impl
{
    Impl(std::vector<ServerSpec> listed, bool to_loopback, NameService& name_service, Clock& time,
         Logger logger, MachineDiscoveryHooks others)
        : names(name_service), clock(time), log(std::move(logger)), hooks(std::move(others)),
          announced(std::min(hooks.max_announced, core::AnnouncedMachines::max_machines))
    {
        take(std::move(listed), to_loopback);
    }

    void take(std::vector<ServerSpec> listed, bool to_loopback);
    void name_machines(WatchedName& name);
    void name_spares();
    std::size_t announced_source() const noexcept { return entries.size(); }
    void name_announced(std::string address);
    std::optional<ServerSpec> announced_machine(std::string address) const;
    void begin_lookups();
    asio::awaitable<void> look_up(std::shared_ptr<WatchedName> watched);
    void forget_silent();
    HttpResponse take_announcement(IncomingRequest const& request);
    void warn_of_too_many(std::string_view machine);
    asio::awaitable<result<>> run();

    std::vector<ServerSpec> entries;
    bool loopback = false;
    NameService& names;
    Clock& clock;
    Logger log;
    MachineDiscoveryHooks hooks;
    std::map<std::string, std::shared_ptr<WatchedName>, std::less<>> watched; ///< By their entries.
    core::AnnouncedMachines announced;
    ServerSpec announced_as; ///< How they are treated.
    core::MachineList list;  ///< Its sources are the entries by their places, and behind them announcements.
    bool has_warned_of_too_many = false;
    std::unordered_set<std::string> lost;    ///< Machines that can't be reached, as far as that matters.
    std::optional<async::TaskGroup> lookups; ///< While `run` is awaited.
};

MachineDiscovery::MachineDiscovery(std::vector<ServerSpec> entries, bool loopback, NameService& names,
                                   Clock& clock, Logger log, MachineDiscoveryHooks hooks)
    : impl_(std::make_unique<Impl>(std::move(entries), loopback, names, clock, std::move(log),
                                   std::move(hooks)))
{}

MachineDiscovery::~MachineDiscovery() = default;

void MachineDiscovery::apply(std::vector<ServerSpec> entries, bool loopback)
{
    // Otherwise thousands of machines would be listed anew for nothing.
    if (entries != impl_->entries || loopback != impl_->loopback)
        impl_->take(std::move(entries), loopback);
}

std::vector<ServerSpec> MachineDiscovery::servers() const
{
    return impl_->list.servers();
}

HttpResponse MachineDiscovery::take_announcement(IncomingRequest const& request)
{
    return impl_->take_announcement(request);
}

asio::awaitable<result<>> MachineDiscovery::run()
{
    return impl_->run();
}

void MachineDiscovery::Impl::take(std::vector<ServerSpec> listed, bool to_loopback)
{
    entries = std::move(listed);
    loopback = to_loopback;
    announced_as = ServerSpec();
    list = core::MachineList();
    // Names that stay keep what their lookups have found, so that their machines do not go and come back.
    auto known = std::exchange(watched, {});
    for (std::size_t source = 0; source != entries.size(); ++source) {
        auto const& entry = entries[source];
        auto name = core::parse_machine_name(entry.address);
        if (entry.address == core::announced_entry) {
            announced_as = entry;
        } else if (!name) {
            list.name(source, entry);
        } else if (!watched.contains(entry.address)) {
            auto const found = known.find(entry.address);
            auto const& machines =
                watched
                    .emplace(entry.address, found == known.end()
                                                ? std::make_shared<WatchedName>(entry, std::move(*name))
                                                : known.extract(found).mapped())
                    .first->second;
            machines->machines.treat_as(entry);
            machines->named.clear();
            machines->source = source;
        }
    }
    // A lookup of theirs may still be under way, and must name nothing any more.
    for (auto const& [entry, removed] : known)
        removed->is_removed = true;
    for (auto const& [entry, name] : watched)
        name_machines(*name);
    name_spares();
    for (auto& machine : announced.machines())
        name_announced(std::move(machine));
    // Taken, and told to nobody: whoever applies parameters takes all `servers()` next.
    (void)list.take(std::numeric_limits<std::size_t>::max());
}

/// The list gets what is different from before.
void MachineDiscovery::Impl::name_machines(WatchedName& name)
{
    auto machines = name.machines.machines(
        [this](std::string_view address) { return lost.contains(std::string(address)); });
    for (auto& machine : machines) {
        machine.elsewhere = !loopback;
        machine.found_by = name.machines.entry().address;
    }
    // Both are in the order of their addresses: one walk finds what is gone, what is new, and what is treated
    // otherwise now.
    auto before = name.named.begin();
    for (auto const& machine : machines) {
        for (; before != name.named.end() && before->address < machine.address; ++before)
            list.forget(name.source, before->address);
        bool const is_known = before != name.named.end() && before->address == machine.address;
        if (!is_known || *before != machine)
            list.name(name.source, machine);
        before += is_known ? 1 : 0;
    }
    for (; before != name.named.end(); ++before)
        list.forget(name.source, before->address);
    name.named = std::move(machines);
}

/// Nobody says when a machine is lost, or comes back.
void MachineDiscovery::Impl::name_spares()
{
    auto const has_spares = [](auto const& entry) { return entry.second->machines.has_spares(); };
    if (!hooks.unreachable || std::none_of(watched.begin(), watched.end(), has_spares))
        return;
    lost = hooks.unreachable();
    for (auto const& entry : watched)
        if (has_spares(entry))
            name_machines(*entry.second);
}

void MachineDiscovery::Impl::name_announced(std::string address)
{
    if (auto const machine = announced_machine(std::move(address)))
        list.name(announced_source(), *machine);
}

/// Treated as the entry "announced" says, if there is one. Nothing: it says that machines are reached inside,
/// and this one can't be.
std::optional<ServerSpec> MachineDiscovery::Impl::announced_machine(std::string address) const
{
    auto machine = announced_as;
    machine.address = std::move(address);
    machine.elsewhere = !loopback;
    machine.found_by = core::announced_entry;
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
    auto const news = watched_name->machines.take(answer, clock.now(), loopback);
    if (!news.info.empty())
        log.info(news.info);
    if (!news.warning.empty())
        log.warning(core::printable(news.warning));
    name_machines(*watched_name);
}

void MachineDiscovery::Impl::forget_silent()
{
    for (auto const& machine : announced.forget_silent(clock.now(), clock.wall())) {
        log.warning(concat(machine, " no longer announces itself, and is forgotten"));
        list.forget(announced_source(), machine);
    }
}

asio::awaitable<result<>> MachineDiscovery::Impl::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    lookups.emplace(co_await asio::this_coro::executor);
    auto next_look = clock.now();
    bool running = true;
    while (running) {
        if (clock.now() >= next_look) {
            begin_lookups();
            forget_silent();
            name_spares();
            next_look = clock.now() + machines_step;
        }
        auto const changes = list.take(machines_at_once);
        if (!changes.empty() && hooks.changed)
            hooks.changed(changes);
        auto const due = list.is_outdated() ? clock.now() + machines_pause : next_look;
        auto const waited = co_await clock.wait_until(due);
        bool const cancelled = co_await async::is_cancelled();
        running = waited && !cancelled;
    }
    co_await lookups->end();
    lookups.reset();
    co_return Failure(asio::error::operation_aborted);
}

HttpResponse MachineDiscovery::Impl::take_announcement(IncomingRequest const& request)
{
    if (!hooks.mac)
        return core::not_found_page();
    // The signature first: nothing else of a stranger's request is read.
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
        return refused_announcement(
            400, "Expected /api/machines?machine=<address>&at=<milliseconds>&to=<receiver>.");
    // A machine that has signed for another session server, or for our last run, is told for whom to sign. So
    // nothing that was overheard there counts here.
    if (announcement->receiver != hooks.receiver)
        return refused_announcement(421, core::receiver_answer(hooks.receiver));
    if (!announcement->is_goodbye && !announced_machine(announcement->machine))
        return refused_announcement(403, "This session server reaches machines by plain HTTP, and that only "
                                         "at addresses: set \"server\" to one.");
    // Only one that comes or goes changes the list: most announcements just renew the time of the last one.
    auto const before = announced.size();
    auto const verdict = announced.take(*announcement, loopback, clock.now(), clock.wall());
    if (announced.size() != before) {
        auto address = core::lower_case(announcement->machine);
        if (announcement->is_goodbye)
            list.forget(announced_source(), address);
        else
            name_announced(std::move(address));
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
    warn_of_too_many(announcement->machine);
    return refused_announcement(503, "Too many machines have announced themselves.");
}

/// Once: those that are refused try again every ten seconds.
void MachineDiscovery::Impl::warn_of_too_many(std::string_view machine)
{
    if (std::exchange(has_warned_of_too_many, true))
        return;
    log.warning(
        concat(core::printable(machine), " announces itself and is refused, as others may be from now on: ",
               "there are ", std::to_string(announced.max_here()),
               " such machines. That is a quarter of the limit of open files, and 10,000 at most: raise it "
               "(LimitNOFILE= of systemd, or \"ulimit -n\"), or see which of them are not yours"));
}

} // namespace webots_cloud
