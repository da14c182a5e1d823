// What the guard exits with when it is not the status of its program.
#pragma once

namespace webots_cloud::guard {

inline constexpr int exec_failed = 127; ///< As in shells and coreutils.

} // namespace webots_cloud::guard
