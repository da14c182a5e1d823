// Downloads a user's changes to a project from a website.
#pragma once

#include "adapters/files/file_descriptor.hpp"
#include "adapters/http_client/curl_http.hpp"
#include "fetch_budget.hpp"

#include "core/projects/website_plan.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/project_source.hpp>
#include <webots_cloud/website_project.hpp>

#include <optional>

namespace webots_cloud::adapters {

/// Sends the request and keeps the answer in a file of `folder` that has no name, and so is gone when it is
/// closed. What it takes of the disk is taken from `share`. Blocks.
///
/// Nothing: the user has changed nothing.
/// Errors: `refused` (by the website), `unreachable`, `timed_out`, `too_large`, `protocol_error`,
/// `unavailable` (disk), `operation_aborted`; the detail is a sentence.
result<std::optional<FileDescriptor>> download_archive(CurlHttp& http, WebsiteProject const& project,
                                                       core::DownloadRequest const& request,
                                                       CurlLimits const& limits, int folder,
                                                       FetchShare& share, FetchProgress& progress);

} // namespace webots_cloud::adapters
