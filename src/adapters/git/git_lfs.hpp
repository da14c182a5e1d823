// Large files: Git LFS keeps them beside the repository, which has pointers in their place.
#pragma once

#include "adapters/http/curl_http.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "adapters/projects/fetch_interrupt.hpp"
#include "git_index.hpp"
#include "git_progress.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <string>

namespace webots_cloud::adapters {

struct LfsOrder
{
    std::string forge;               ///< Its address.
    std::string url;                 ///< Of the repository, with `.git`.
    std::string repository;          ///< `owner/name`, for sentences.
    std::uint64_t max_bytes = 0;     ///< Of all files of the project.
    CurlLimits limits;               ///< Of each request, but for its bytes.
    FetchShare* share = nullptr;     ///< Pays. Outlives the call.
    GitProgress* progress = nullptr; ///< May be null.
    FetchInterrupt interrupt;
};

/// Puts the content of large files where their pointers are, in `index` and below the open folder `files`;
/// `scratch` is another one on the same file system, for unfinished files. Without a pointer no request is
/// sent. Blocks.
///
/// Every file with the text of a pointer is treated as one, whatever `.gitattributes` says. What arrives
/// has to be what its pointer says: as long, and of the same SHA-256.
///
/// Errors: as `ProjectSource::fetch`, as sentences; then the folder holds anything.
result<> fetch_lfs_files(CurlHttp& http, LfsOrder const& order, GitIndex& index, int files, int scratch);

} // namespace webots_cloud::adapters
