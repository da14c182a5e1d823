#include "config_reload.hpp"

#include "config_keys.hpp"

namespace webots_cloud::core {
namespace {

ConfigChanges take_reloaded(std::span<ConfigTopic const> topics, void* in_force, void const* next)
{
    ConfigChanges changes;
    for (auto const& topic : topics)
        for (auto const& key : topic.keys) {
            if (!key.value.equal || key.value.equal(in_force, next))
                continue;
            (key.reloaded ? changes.applied : changes.waiting).push_back(key.name);
            if (key.reloaded)
                key.value.copy(next, in_force);
        }
    return changes;
}

} // namespace

ConfigChanges take_reloaded(SessionConfig& in_force, SessionConfig const& next)
{
    return take_reloaded(session_topics(), &in_force, &next);
}

ConfigChanges take_reloaded(SimulationConfig& in_force, SimulationConfig const& next)
{
    return take_reloaded(simulation_topics(), &in_force, &next);
}

} // namespace webots_cloud::core
