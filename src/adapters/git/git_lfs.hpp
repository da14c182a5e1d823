// Large files: Git LFS keeps them beside the repository, which has pointers in their place.
#pragma once

#include "adapters/git_packs/git_index.hpp"
#include "adapters/http_client/curl_http.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "adapters/projects/fetch_interrupt.hpp"
#include "git_progress.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <memory>
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

class LfsFetch;

/// The large files of a folder. Every file with the text of a pointer is treated as one, whatever
/// `.gitattributes` says. What arrives has to be what its pointer says: as long, and of the same SHA-256.
///
/// Lifetime: client and index must outlive it.   Thread-safety: one thread at a time.
class GitLargeFiles
{
public:
    /// `index` and the open folder `files` have the pointers; `scratch` is another one on the same file
    /// system, for unfinished files.
    GitLargeFiles(CurlHttp& http, LfsOrder order, GitIndex& index, int files, int scratch);
    ~GitLargeFiles();

    /// Finds the pointers; sends no request.   False: there are none.
    ///
    /// Errors: as `fetch`.
    result<bool> find();

    /// After `find`: puts the content of all large files where their pointers are. Blocks.
    ///
    /// Errors: as `ProjectSource::fetch`, as sentences; then the folder holds anything.
    result<> fetch();

private:
    std::unique_ptr<LfsFetch> fetch_;
};

} // namespace webots_cloud::adapters
