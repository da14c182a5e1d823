// What a website's project is made of, and what the website's answer means (protocol section 5).
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/website_project.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The key in the text of a key file: its first line, without spaces around; empty when there is none.
std::string website_key(std::string_view key_file);

/// A request to `download-project.php`.
struct DownloadRequest
{
    DownloadRequest() = default;

    std::string url;
    std::string form; ///< The body: a web form.

    bool operator==(DownloadRequest const&) const = default;
};

/// What to do for an `init`.
struct WebsitePlan
{
    WebsitePlan() = default;

    std::filesystem::path project;           ///< The template, relative to the folder of all templates.
    std::string host_file;                   ///< The text of `host.txt` in the project's root.
    std::optional<DownloadRequest> download; ///< The user's changes; nothing when no user is logged in.
};

/// `key`: the website's key, empty when the operator has stored none. No request is sent to a website without
/// a key.
///
/// Errors: `refused`; the detail is a sentence for the browser.
result<WebsitePlan> plan_website_project(WebsiteProject const& project, std::string_view key);

/// The kinds of answer of `download-project.php`.
enum class DownloadAnswer
{
    unchanged, ///< The user has no files: only the template is used.
    refused,   ///< A text that begins with `Error:`.
    archive    ///< Anything else: it should be a zip.
};

/// Judges by the first bytes of an answer; 200 are enough.
DownloadAnswer classify_download(std::string_view beginning) noexcept;

/// The message for a browser whose download was refused with this text.
Failure download_refusal(std::string_view words);

} // namespace webots_cloud::core
