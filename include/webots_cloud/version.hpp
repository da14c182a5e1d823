// Which release of the library this is.
#pragma once

#include <string_view>

namespace webots_cloud {

/// For instance "0.1.0".
std::string_view version() noexcept;

} // namespace webots_cloud
