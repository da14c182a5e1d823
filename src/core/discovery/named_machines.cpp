// Decides what a lookup means for the list of machines: new ones are taken at once, missing ones are kept for
// as long as a name server may simply be wrong. machine_discovery.cpp asks the questions.
#include "named_machines.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace webots_cloud::core {
namespace {

// What one machine may count for, in parts of the mean weight of its priority.
constexpr double min_weight = 0.1;
constexpr double max_weight = 10;

std::string counted(std::size_t count)
{
    return concat(std::to_string(count), count == 1 ? " machine" : " machines");
}

} // namespace

LookupNews NamedMachines::take(result<NameAnswer> const& answer, TimePoint now, bool loopback)
{
    if (!answer && answer.error() != errc::not_found)
        return fail(answer.error(), now);
    std::string warning;
    auto told = answer ? read(*answer, loopback, warning) : Machines();
    if (!answer)
        warning = answer.error().message();
    auto news = replace(std::move(told), std::move(warning));
    answered_ = now;
    pause_ = Duration::zero();
    bool const lacks = !answer || std::any_of(machines_.begin(), machines_.end(),
                                              [](auto const& machine) { return machine.second.is_missing; });
    due_ = now + std::clamp(answer ? answer->ttl : Duration::zero(), name_limits::min_ttl,
                            lacks ? name_limits::max_ttl_missing : name_limits::max_ttl);
    return news;
}

NamedMachines::Machines NamedMachines::read(NameAnswer const& answer, bool loopback,
                                            std::string& warning) const
{
    Machines told;
    std::size_t refused = 0;
    for (auto const& text : answer.addresses) {
        auto const address = IpAddress::parse(text);
        if (address && is_machine_address(*address, loopback))
            told.emplace(machine_at(*address, name_.port), Machine());
        else
            ++refused;
    }
    for (auto const& service : answer.services) {
        auto target = service.target;
        if (target.ends_with('.'))
            target.pop_back();
        Machine machine;
        machine.priority = service.priority;
        machine.weight = service.weight;
        auto const is_plain = parse_machine_name(concat("srv:", target)).has_value();
        if (service.port != 0 && is_plain && is_machine_host(target, loopback))
            told.emplace(concat(lower_case(target), ":", std::to_string(service.port)), machine);
        else
            ++refused;
    }
    if (refused != 0)
        warning = concat(std::to_string(refused),
                         " of its answers are no addresses of machines: loopback (see \"discoverLoopback\"), "
                         "link-local, multicast, or no address at all");
    if (told.size() <= name_limits::machines)
        return told;
    // The order of names is always the same, so these are the same the next time.
    warning = concat("it names ", counted(told.size()), ", of which ", std::to_string(name_limits::machines),
                     " are used");
    told.erase(std::next(told.begin(), static_cast<std::ptrdiff_t>(name_limits::machines)), told.end());
    return told;
}

LookupNews NamedMachines::replace(Machines told, std::string warning)
{
    std::size_t added = 0;
    std::size_t removed = 0;
    // Name servers sometimes leave out some of their answers: a machine that is missing goes when it is
    // missing the next time, too.
    for (auto& [address, machine] : machines_) {
        if (auto const found = told.find(address); found != told.end())
            continue;
        if (machine.is_missing || told.size() >= name_limits::machines) {
            ++removed;
            continue;
        }
        machine.is_missing = true;
        told.emplace(address, machine);
    }
    for (auto const& [address, machine] : told)
        added += machines_.contains(address) ? 0 : 1;
    machines_ = std::move(told);
    LookupNews news;
    if (added != 0 || removed != 0)
        news.info = concat(entry_.address, " stands for ", counted(machines_.size()), ": ",
                           std::to_string(added), " added, ", std::to_string(removed), " removed");
    if (warning != warning_ && !warning.empty())
        news.warning = concat(entry_.address, ": ", warning);
    warning_ = std::move(warning);
    return news;
}

LookupNews NamedMachines::fail(Failure const& failure, TimePoint now)
{
    pause_ = std::clamp(2 * pause_, name_limits::first_pause, name_limits::max_pause);
    due_ = now + pause_;
    LookupNews news;
    bool const is_over = !machines_.empty() && now - answered_ >= name_limits::memory;
    if (is_over)
        machines_.clear();
    auto warning =
        concat(failure.message(), machines_.empty() ? "" : "; its last machines are used for an hour");
    if (warning != warning_)
        news.warning = concat(entry_.address, ": ", warning);
    warning_ = std::move(warning);
    return news;
}

bool NamedMachines::has_spares() const noexcept
{
    return std::any_of(machines_.begin(), machines_.end(), [this](auto const& machine) {
        return machine.second.priority != machines_.begin()->second.priority;
    });
}

std::vector<ServerSpec>
NamedMachines::machines(std::function<bool(std::string_view address)> const& unreachable) const
{
    std::set<std::uint16_t> priorities;
    std::set<std::uint16_t> usable; // with a machine that can be reached, as far as is known
    std::map<std::uint16_t, std::pair<double, int>> weights; // of each priority: their sum and number
    for (auto const& [address, machine] : machines_) {
        priorities.insert(machine.priority);
        if (!unreachable || !unreachable(address))
            usable.insert(machine.priority);
        if (machine.weight != 0) {
            weights[machine.priority].first += machine.weight;
            ++weights[machine.priority].second;
        }
    }
    // Machines of a later priority are a reserve: drained, unless none before them can be reached.
    auto const first = usable.empty() ? priorities : usable;
    std::vector<ServerSpec> found;
    for (auto const& [address, machine] : machines_) {
        auto spec = entry_;
        spec.address = address;
        // Weights compare machines of one priority alone, so each counts by how it differs from their mean.
        if (auto const known = weights.find(machine.priority); known != weights.end()) {
            auto const mean = known->second.first / known->second.second;
            spec.weight *= std::clamp(machine.weight / mean, min_weight, max_weight);
        }
        spec.drain = spec.drain || machine.priority > *first.begin();
        if (reach_inside(spec, name_))
            found.push_back(std::move(spec));
    }
    return found;
}

} // namespace webots_cloud::core
