// Which release of the library this is.
#pragma once

#include <webots_cloud/export.hpp>

#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// For instance "1.0.0".
std::string_view version() noexcept;

} // namespace webots_cloud
