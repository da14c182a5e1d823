// What the addresses of classes mean: files of the page, and who asks for a simulation.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The file of `src/web` that a path below `/class/` means. `/class/K7M2Q` is the page, whatever the code:
/// whether there is such a class is not told here.
std::string class_file(std::string_view path);

/// The student's token in the query of `/session`; empty: there is none.
std::string_view class_token(std::string_view query) noexcept;

} // namespace webots_cloud::core
