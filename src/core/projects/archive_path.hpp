// Which names of an untrusted archive may become files here.
#pragma once

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::core {

struct ArchivePath
{
    /// Relative to the project's root. Every part is a harmless file name; of what is forbidden, every part
    /// but the last one.
    std::string path;
    /// The entry is left out, with all that is below `path`: its name leads elsewhere (`..`, absolute paths),
    /// or has a part that could do harm, such as `.git`.
    bool is_forbidden = false;
};

/// Where an entry with this name goes; a slash at the end, which folders have, is left out.
///
/// Errors: `too_large` for paths that are long or deep; the detail is a sentence.
result<ArchivePath> archive_path(std::string_view name);

} // namespace webots_cloud::core
