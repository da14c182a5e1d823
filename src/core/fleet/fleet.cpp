// The list of machines, and the order in which its observers are told. Each change is made in the list before
// it is told; a machine that leaves is still there while that is told.
#include <webots_cloud/fleet.hpp>

#include "core/access/machine_paths.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

namespace webots_cloud {

std::string_view FleetMachine::drained_by() const noexcept
{
    if (is_drained)
        return "operator";
    return spec.drain ? "configuration" : "";
}

FleetObserver::~FleetObserver()
{
    if (fleet_)
        fleet_->remove_observer(*this);
}

/// The machines in the order in which the operator gives them; a list, so that each stays where it is, as
/// observers and `by_address` rely on, when others come and go.
struct Fleet::Impl
{
    using Place = std::list<FleetMachine>::iterator;

    explicit Impl(core::Mac made_with) : mac(std::move(made_with)) {}

    Place place_of(std::string_view address)
    {
        auto const found = by_address.find(address);
        return found == by_address.end() ? machines.end() : found->second;
    }

    void put(ServerSpec const& server, std::optional<std::string_view> before);
    void add(ServerSpec const& server, Place place, std::string_view before);
    void remove(Place machine);
    void set(std::vector<ServerSpec> const& servers);
    bool drain(std::string_view address, bool is_drained);
    void tell_put(FleetMachine const& machine, FleetMachine const* was,
                  std::optional<std::string_view> before);
    void settle();

    core::Mac mac;
    std::list<FleetMachine> machines;
    std::unordered_map<std::string, Place, core::TextHash, std::equal_to<>> by_address;
    std::vector<FleetObserver*> observers; ///< The one that has followed longest is the first.
    std::size_t drained = 0;
    bool has_changed = false; ///< Since observers were told that nothing else does.
};

void Fleet::Impl::tell_put(FleetMachine const& machine, FleetMachine const* was,
                           std::optional<std::string_view> before)
{
    has_changed = true;
    for (auto* const observer : observers)
        observer->put(machine, was, before);
}

void Fleet::Impl::settle()
{
    if (!std::exchange(has_changed, false))
        return;
    for (auto* const observer : observers)
        observer->settled();
}

void Fleet::Impl::add(ServerSpec const& server, Place place, std::string_view before)
{
    auto const machine = machines.emplace(place);
    machine->spec = server;
    machine->path = core::machine_path(mac, server);
    by_address.emplace(server.address, machine);
    tell_put(*machine, nullptr, before);
}

void Fleet::Impl::put(ServerSpec const& server, std::optional<std::string_view> before)
{
    auto const place = before ? place_of(*before) : machines.end();
    auto const machine = place_of(server.address);
    if (machine == machines.end())
        return add(server, place, before.value_or(std::string_view()));
    bool const moves = before && place != machine && place != std::next(machine);
    if (!moves && machine->spec == server)
        return;
    if (moves)
        machines.splice(place, machines, machine);
    auto const was = *machine;
    machine->spec = server;
    machine->path = core::machine_path(mac, server);
    tell_put(*machine, &was, before);
}

void Fleet::Impl::remove(Place machine)
{
    has_changed = true;
    std::for_each(observers.rbegin(), observers.rend(),
                  [machine](FleetObserver* observer) { observer->remove(*machine); });
    if (machine->is_drained)
        --drained;
    by_address.erase(by_address.find(machine->spec.address));
    machines.erase(machine);
}

void Fleet::Impl::set(std::vector<ServerSpec> const& servers)
{
    std::unordered_set<std::string_view> listed;
    for (auto const& server : servers)
        listed.insert(server.address);
    for (auto machine = machines.begin(); machine != machines.end();)
        if (auto const known = machine++; !listed.contains(known->spec.address))
            remove(known);
    // Those that are in their places stay there. Of thousands of machines most are as before, and nobody is
    // told of them.
    auto next = machines.begin();
    for (auto const& server : servers) {
        if (listed.erase(server.address) == 0)
            continue; // the first one of an address counts
        if (next != machines.end() && next->spec.address == server.address)
            ++next;
        put(server, next == machines.end() ? std::string_view() : next->spec.address);
    }
}

bool Fleet::Impl::drain(std::string_view address, bool is_drained)
{
    auto const machine = place_of(address);
    if (machine == machines.end())
        return false;
    if (machine->is_drained == is_drained)
        return true;
    auto const was = *machine;
    machine->is_drained = is_drained;
    if (is_drained)
        ++drained;
    else
        --drained;
    tell_put(*machine, &was, std::nullopt);
    return true;
}

Fleet::Fleet(std::function<std::string(std::string_view message)> mac)
    : impl_(std::make_unique<Impl>(std::move(mac)))
{}

Fleet::~Fleet()
{
    for (auto* const observer : impl_->observers)
        observer->fleet_ = nullptr;
}

void Fleet::set(std::vector<ServerSpec> const& servers)
{
    impl_->set(servers);
    impl_->settle();
}

void Fleet::change(std::vector<ServerChange> const& changes)
{
    for (auto const& change : changes) {
        auto const machine = impl_->place_of(change.server.address);
        if (change.kind != ServerChange::Kind::removed)
            impl_->put(change.server, change.before);
        else if (machine != impl_->machines.end())
            impl_->remove(machine);
    }
    impl_->settle();
}

void Fleet::put(ServerSpec const& server, std::optional<std::string_view> before)
{
    impl_->put(server, before);
    impl_->settle();
}

void Fleet::remove(std::string_view address)
{
    if (auto const machine = impl_->place_of(address); machine != impl_->machines.end())
        impl_->remove(machine);
    impl_->settle();
}

bool Fleet::drain(std::string_view address, bool is_drained)
{
    bool const is_known = impl_->drain(address, is_drained);
    impl_->settle();
    return is_known;
}

std::list<FleetMachine> const& Fleet::machines() const noexcept
{
    return impl_->machines;
}

FleetMachine const* Fleet::find(std::string_view address) const
{
    auto const machine = impl_->place_of(address);
    return machine == impl_->machines.end() ? nullptr : &*machine;
}

std::size_t Fleet::drained() const noexcept
{
    return impl_->drained;
}

void Fleet::add_observer(FleetObserver& observer)
{
    if (observer.fleet_ == this)
        return;
    if (observer.fleet_)
        observer.fleet_->remove_observer(observer);
    observer.fleet_ = this;
    impl_->observers.push_back(&observer);
    for (auto const& machine : impl_->machines)
        observer.put(machine, nullptr, std::string_view());
    if (!impl_->machines.empty())
        observer.settled();
}

void Fleet::remove_observer(FleetObserver& observer) noexcept
{
    if (std::erase(impl_->observers, &observer) != 0)
        observer.fleet_ = nullptr;
}

} // namespace webots_cloud
