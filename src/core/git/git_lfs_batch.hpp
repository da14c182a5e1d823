// The batch API of Git LFS: where a server says that large files are to be had.
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

/// What a server has said of one object.
struct LfsDownload
{
    std::string address;              ///< Empty: it is not to be had.
    std::vector<std::string> headers; ///< For the request: `Name: value`.
    int error = 0;                    ///< Why not: a status as of HTTP; 0: it has not said.
    std::string words;                ///< What it says of that, without control characters.
};

/// The question for these.
std::string lfs_batch_request(std::vector<LfsPointer> const& objects);

/// What it answers, object by object in the order of the question.
///
/// Errors: `protocol_error`, the detail being words about the server, as in "sends no JSON".
result<std::vector<LfsDownload>> parse_lfs_batch(std::string_view answer,
                                                 std::vector<LfsPointer> const& objects);

} // namespace webots_cloud::core
