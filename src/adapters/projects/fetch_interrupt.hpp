// Stops long work on untrusted data.
#pragma once

#include <webots_cloud/error.hpp>

#include <functional>

namespace webots_cloud::adapters {

/// Called repeatedly by work that may take long; a failure ends the work and is its result. Empty: it is
/// never stopped.
using FetchInterrupt = std::function<result<>()>;

inline result<> ask(FetchInterrupt const& interrupt)
{
    return interrupt ? interrupt() : result<>();
}

} // namespace webots_cloud::adapters
