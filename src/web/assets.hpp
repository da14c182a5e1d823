// The pages that the servers show, embedded at build time.
#pragma once

#include <optional>
#include <string_view>

namespace webots_cloud::web {

/// A file of `src/web`.
struct Asset
{
    std::string_view content;
    /// The same, compressed, for clients that take gzip; empty where that is not worth it.
    std::string_view gzip;
    std::string_view content_type;
    /// Of texts: SHA-256 of a newline and the content, in hexadecimal. It allows the script, embedded in a
    /// page, in the page's Content-Security-Policy.
    std::string_view inline_hash;
};

/// Finds a file by its path below `src/web`, such as `viewer/index.html`.
std::optional<Asset> find_asset(std::string_view path);

} // namespace webots_cloud::web
