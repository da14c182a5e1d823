#pragma once

namespace webots_cloud::demo {

/// The text of `controller.py`.
extern char const* const controller_module;

} // namespace webots_cloud::demo
