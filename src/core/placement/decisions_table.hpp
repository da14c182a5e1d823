// The decisions of the Scheduler as people read them: what `--decisions` prints.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// A line for each of the decisions that `/api/decisions` tells, the last one first; those that follow each
/// other and have refused a browser for the same reasons are one line. What is no such answer is returned as
/// it is.
std::string decisions_table(std::string_view json);

} // namespace webots_cloud::core
