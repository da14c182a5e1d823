// Downloads of a stranger's files, which no fetch may keep without paying for them.
#pragma once

#include "adapters/files/file_descriptor.hpp"
#include "adapters/http_client/curl_http.hpp"
#include "fetch_budget.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <cstddef>
#include <string>

namespace webots_cloud::adapters {

/// What a server has answered.
struct Download
{
    static constexpr std::size_t beginning_size = 512;

    int status = 0;
    FileDescriptor file;   ///< The body, if the status is 200.
    std::string beginning; ///< Of the body, for a look at what it is.
};

/// Sends the request and keeps what is answered in a file of `folder` that has no name, and so is gone when
/// it is closed. It is paid for from `share`, the disk piece by piece, and counted from 0 in
/// `progress.bytes_received`. Blocks.
///
/// Errors: as `CurlHttp::send`, with the request's `explain`; as `FetchShare::take`; `unavailable` (disk).
result<Download> download(CurlHttp& http, CurlRequest request, CurlLimits const& limits, int folder,
                          FetchShare& share, FetchProgress& progress);

} // namespace webots_cloud::adapters
