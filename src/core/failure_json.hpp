// A failure as pages and other servers read it (protocol section 4.1.6).
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/json/object.hpp>

namespace webots_cloud::core {

/// What varies in its sentence; empty for a failure without a row.
boost::json::object values_of(Failure const& failure);

/// Adds `error`, the sentence, and of a failure with a row `code` and `values`.
void add_failure(boost::json::object& object, Failure const& failure);

} // namespace webots_cloud::core
