// The batch API of Git LFS, by which a server tells the download addresses of large files.
#pragma once

#include "git_lfs_pointer.hpp"

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

constexpr std::size_t max_lfs_objects = 100;                     ///< That servers answer for at once.
constexpr std::uint64_t max_lfs_answer = std::uint64_t{1} << 20; ///< Bytes; most take 1 kB for each object.

/// A server's answer about one object.
struct LfsDownload
{
    std::string address;              ///< Empty: not available.
    std::vector<std::string> headers; ///< For the request: `Name: value`.
    int error = 0;                    ///< Why not: an HTTP status; 0: unknown.
    std::string words;                ///< The server's explanation, without control characters.
};

/// The request for these objects.
std::string lfs_batch_request(std::vector<LfsPointer> const& objects);

/// Parses the answer, object by object in the order of the request.
///
/// Errors: `protocol_error`, the detail being words about the server, as in "sends no JSON".
result<std::vector<LfsDownload>> parse_lfs_batch(std::string_view answer,
                                                 std::vector<LfsPointer> const& objects);

} // namespace webots_cloud::core
