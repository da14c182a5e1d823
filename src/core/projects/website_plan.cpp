#include "website_plan.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"

namespace webots_cloud::core {
namespace {

constexpr std::string_view error_prefix = "Error:";
constexpr std::string_view unchanged_prefix = "Error: no such directory: ";
constexpr std::string_view end_of_archive = "PK\5\6"; // an archive that begins with it holds nothing

DownloadRequest download_request(WebsiteProject const& project, std::string_view key)
{
    DownloadRequest request;
    request.url = concat(project.origin, "/ajax/download-project.php");
    request.form = web_form({{"project", project.project},
                             {"key", key},
                             {"user1Id", project.user1_id},
                             {"user1Name", project.user1_name},
                             {"user1Authentication", project.user1_authentication},
                             {"user2Id", project.user2_id},
                             {"user2Name", project.user2_name},
                             {"customData", project.custom_data}});
    return request;
}

} // namespace

std::string website_key(std::string_view key_file)
{
    return std::string(trim(key_file.substr(0, key_file.find('\n'))));
}

result<WebsitePlan> plan_website_project(WebsiteProject const& project, std::string_view key)
{
    WebsitePlan plan;
    plan.project = project.project;
    plan.host_file = project.origin;
    if (project.user1_id.empty())
        return plan;
    if (key.empty())
        return refused(Refused::no_website_key, {{"host", project.host()}});
    plan.download = download_request(project, key);
    return plan;
}

DownloadAnswer classify_download(std::string_view beginning) noexcept
{
    if (beginning.starts_with(unchanged_prefix) || beginning.starts_with(end_of_archive))
        return DownloadAnswer::unchanged;
    return beginning.starts_with(error_prefix) ? DownloadAnswer::refused : DownloadAnswer::archive;
}

Failure download_refusal(std::string_view words)
{
    if (words.starts_with(error_prefix))
        words.remove_prefix(error_prefix.size());
    words = trim(words);
    if (words.empty())
        return refused(Refused::website_without_reason);
    return refused(Refused::website_refuses, {{"words", printable(words, 200)}});
}

} // namespace webots_cloud::core
