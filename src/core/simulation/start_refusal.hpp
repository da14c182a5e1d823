// What a start that fails here means to a session server that relays it for a browser, and could ask another
// machine.
#pragma once

#include "core/refusals.hpp"

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// How far a start has come.
enum class StartStep
{
    admission,  ///< Whether this machine takes it: nothing was looked at but the address of the world.
    repository, ///< The project of a `start` is fetched.
    website,    ///< The project of an `init` is fetched.
    launch      ///< From the fetched project until the simulation is ready.
};

/// What a failure at this step tells: its row of the table of refusals knows, or else its code. Projects of
/// websites are the exception: which of them there are is a matter of each machine.
StartRefusal refusal_at(StartStep step, Failure const& failure);

/// What a session server is told before the error: `refusal: full`, `refusal: machine`, or nothing for what
/// is refused everywhere.
std::string_view refusal_message(StartRefusal refusal) noexcept;

/// `refusal: needs <labels>`: only a machine with all of them can run it.
std::string needs_message(std::vector<std::string> const& labels);

} // namespace webots_cloud::core
