// Decisions: core/classes/class_paths, core/gallery/world_list.
#include "site_pages.hpp"

#include "core/classes/class_paths.hpp"
#include "core/gallery/world_list.hpp"
#include "core/pages/http_pages.hpp"
#include "core/pages/viewer_defaults.hpp"
#include "core/text.hpp"
#include "web/assets.hpp"

#include <string>
#include <utility>

namespace webots_cloud {
namespace {

/// Pages of other sites import modules, or learn that a build lacks one; and our own pages have no origin in
/// a sandboxed frame.
HttpResponse for_any_page(HttpResponse response)
{
    response.headers.emplace_back("Access-Control-Allow-Origin", "*");
    return response;
}

/// `to`: relative, for proxies that rewrite paths.
HttpResponse moved(std::string_view to)
{
    HttpResponse response(301, {}, {});
    response.headers.emplace_back("Location", to);
    return response;
}

} // namespace

Answer SitePages::viewer(IncomingRequest const& request)
{
    auto const path = request.path;
    if (path == "/viewer")
        return moved("viewer/");
    if (path == "/viewer/worlds")
        return moved("worlds/");
    if (path == "/viewer/worlds/list.json")
        return for_any_page(gallery_.answer(request.header("If-None-Match")));
    constexpr std::string_view picture_folder = "/viewer/worlds/picture/";
    if (path.starts_with(picture_folder))
        return for_any_page(
            gallery_.picture(path.substr(picture_folder.size()), request.header("If-None-Match")));
    if (path == "/viewer/defaults.json")
        return defaults();
    constexpr std::string_view page_folder = "/viewer/";
    constexpr std::string_view gallery_folder = "/viewer/worlds/";
    auto name = path == page_folder      ? std::string_view("viewer/index.html")
                : path == gallery_folder ? std::string_view("viewer/worlds/index.html")
                                         : path.substr(1);
    // The page finds the modules below itself, so that proxies need one rule for both.
    if (path.starts_with("/viewer/view/"))
        name = path.substr(page_folder.size());
    return embedded(name, request);
}

Answer SitePages::class_page(IncomingRequest const& request)
{
    if (request.path == "/class")
        return moved("class/");
    if (request.path == "/class/defaults.json")
        return defaults();
    return embedded(core::class_file(request.path), request);
}

HttpResponse SitePages::defaults() const
{
    return for_any_page(core::json_page(core::viewer_defaults_json(config_)));
}

/// A file of `src/web`: public, and the same for everybody.
HttpResponse SitePages::embedded(std::string_view name, IncomingRequest const& request)
{
    auto const asset = web::find_asset(name);
    if (!asset)
        return for_any_page(core::not_found_page());
    auto& page = files_[asset->content.data()];
    if (page.empty())
        page.set(std::string(asset->content), std::string(asset->gzip));
    // A page that was made of this script or style sheet names it so (cmake/embed_files.cmake).
    constexpr std::string_view version = "v=";
    constexpr std::size_t version_digits = 16;
    bool const is_named =
        request.query.starts_with(version) &&
        request.query.substr(version.size()) == asset->inline_hash.substr(0, version_digits);
    return for_any_page(page.answer(asset->content_type, request.header("If-None-Match"),
                                    is_named ? core::Kept::for_ever : core::Kept::until_asked));
}

boost::asio::awaitable<HttpResponse> SitePages::list_worlds(IncomingRequest const& request)
{
    auto const client = std::string(request.quota_key.empty() ? std::string_view() : request.client);
    auto listed = co_await gallery_.look_into(std::string(core::trim(request.body)), client);
    co_return for_any_page(std::move(listed));
}

HttpResponse SitePages::no_worlds(core::Refused why)
{
    return for_any_page(core::json_page(core::world_list_error(core::refused(why))));
}

} // namespace webots_cloud
