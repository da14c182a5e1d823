#include "page.hpp"

#include <webots_cloud/adapters.hpp>

namespace website_host {

namespace fs = std::filesystem;
using webots_cloud::errc;
using webots_cloud::Failure;
using webots_cloud::HttpResponse;
using webots_cloud::result;
using webots_cloud::SharedBody;

namespace {

constexpr std::size_t max_page_file = std::size_t{4} << 20;

void replace(std::string& text, std::string_view what, std::string_view with)
{
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
        text.replace(at, what.size(), with);
}

} // namespace

result<Page> Page::load(fs::path const& folder)
{
    Page page;
    for (auto const* const name : {"index.html", "page.js", "page.css"}) {
        auto text = webots_cloud::read_regular_file(folder / name, max_page_file);
        if (!text)
            return Failure(errc::invalid_config,
                           (folder / name).string() + " can't be read (" + text.error().message() +
                               "): \"pageDir\" has to be the folder examples/website_host/page.");
        if (std::string_view(name) == "index.html")
            page.html_ = *std::move(text);
        else
            page.files_.emplace(std::string("/") + name, std::make_shared<SharedBody>(*std::move(text)));
    }
    return page;
}

HttpResponse Page::html(std::string_view session_server) const
{
    auto text = html_;
    replace(text, "{{view}}", http_address(session_server) + "/view");
    HttpResponse response(200, "text/html; charset=UTF-8", std::move(text));
    // Simulations may be anywhere: session servers name them. Scripts are ours and those of the session
    // server.
    response.headers.emplace_back(
        "Content-Security-Policy",
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval' " + http_address(session_server) +
            "; style-src 'self' " + http_address(session_server) +
            "; img-src * data: blob:; connect-src *; frame-src http: https:; "
            "font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    response.headers.emplace_back("Cache-Control", "no-store");
    response.headers.emplace_back("Referrer-Policy", "no-referrer");
    return response;
}

std::shared_ptr<SharedBody const> Page::file(std::string_view path) const
{
    auto const found = files_.find(path);
    return found == files_.end() ? nullptr : found->second;
}

std::string http_address(std::string_view websocket_address)
{
    return "http" + std::string(websocket_address.substr(2));
}

} // namespace website_host
