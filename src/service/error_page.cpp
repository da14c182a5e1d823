#include "error_page.hpp"

#include "core/pages/http_pages.hpp"
#include "core/pages/page_language.hpp"
#include "core/text.hpp"
#include "web/assets.hpp"

#include <algorithm>
#include <string>

namespace webots_cloud {
namespace {

using core::concat;

/// From the page's language to its title: everything stands in it, since nothing else of us may be reachable.
std::string begin_of_page()
{
    std::string styles;
    for (auto const* style : {"view/tokens.css", "viewer/base.css", "viewer/page.css", "viewer/error.css"})
        styles += web::find_asset(style).value_or(web::Asset()).content;
    return concat(
        "\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta name=\"color-scheme\" content=\"light dark\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"script-src 'none'; object-src 'none'; "
        "base-uri 'none'; form-action 'none'\">\n"
        "<link rel=\"icon\" href=\"data:,\">\n<style>\n",
        styles, "</style>\n<title>");
}

bool is_opened_as_page(IncomingRequest const& request)
{
    auto const mode = request.header("Sec-Fetch-Mode"); // scripts ask with another one
    return request.method == "GET" && !request.upgrade && (mode.empty() || mode == "navigate") &&
           request.header("Accept").find("text/html") != std::string_view::npos;
}

/// Where our first page is, by a path that proxies may rewrite.
std::string way_home(std::string_view path)
{
    auto const depth = std::ranges::count(path, '/');
    std::string way = "./";
    for (auto level = depth; level > 1; --level)
        way += "../";
    return way;
}

} // namespace

void dress_for_people(HttpResponse& response, IncomingRequest const& request)
{
    if (response.status < 400 || response.shared || response.content_type != core::html_type ||
        !is_opened_as_page(request))
        return;
    static std::string const begin = begin_of_page();
    auto const status = std::to_string(response.status);
    // Tornado's pages say nothing but the status.
    bool const is_bare = response.body.empty() || response.body.starts_with("<html>");
    std::string_view const sentence =
        !is_bare                 ? core::trim(response.body)
        : response.status == 404 ? "There is nothing at this address. Please check it: perhaps the link is "
                                   "old, or a part of it is missing."
                                 : "This address can't be used in this way. Please check the link.";
    // What only programs read is in English alone.
    static core::Translations const texts(
        web::find_asset("viewer/error.json").value_or(web::Asset()).content);
    auto const language =
        core::preferred_language(request.header("Accept-Language"), texts.languages_of(sentence));
    response.body = concat("<!DOCTYPE html>\n<html lang=\"", language, begin, status,
                           "</title>\n</head>\n<body>\n<main class=\"refusal\">\n",
                           web::find_asset("viewer/favicon.svg").value_or(web::Asset()).content,
                           "<p class=\"status\">", status, "</p>\n<h1>", texts.in(language, sentence),
                           "</h1>\n<p><a class=\"button\" href=\"", way_home(request.path), "\">",
                           texts.in(language, "Start page"), "</a></p>\n</main>\n</body>\n</html>\n");
    response.headers.emplace_back("Vary", "Accept-Language");
}

} // namespace webots_cloud
