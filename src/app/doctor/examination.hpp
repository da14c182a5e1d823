// Many checks at the same time, each with its deadline.
#pragma once

#include "core/doctor/finding.hpp"

#include <webots_cloud/transport/clock.hpp>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>

#include <functional>
#include <string>
#include <vector>

namespace webots_cloud::app {

/// Something to look at.
struct Check
{
    Check(std::string subject, boost::asio::awaitable<core::Findings> work,
          Duration limit = std::chrono::seconds(6))
        : subject(std::move(subject)), work(std::move(work)), limit(limit)
    {}

    std::string subject; ///< For a check that does not end in time.
    boost::asio::awaitable<core::Findings> work;
    Duration limit; ///< It is cancelled then.
};

/// Is told, once a second, what is still being looked at.
using Progress = std::function<void(std::vector<std::string> const& subjects)>;

/// What all checks have found, in their order. In the place of one that takes too long stands a warning.
///
/// Cancellation: terminal; then nothing is found.
boost::asio::awaitable<core::Findings> examine(std::vector<Check> checks, Clock& clock,
                                               Progress progress = {});

/// Puts what `work` finds behind `findings`. Runs the event loop of `context` until then, as there is no
/// other where no server runs.
void run_to_end(boost::asio::awaitable<core::Findings> work, boost::asio::io_context& context,
                core::Findings& findings);

} // namespace webots_cloud::app
