// Which names of an untrusted archive may become files here.
#pragma once

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The path, relative to the project's root, of an entry with this name; a slash at the end, which folders
/// have, is left out.
///
/// Errors: `protocol_error` unless every part is a harmless file name (so `..` and absolute paths are
/// refused), `too_large` for paths that are long or deep; the detail is a sentence.
result<std::string> archive_path(std::string_view name);

} // namespace webots_cloud::core
