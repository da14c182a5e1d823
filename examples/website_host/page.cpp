#include "page.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/json.hpp>

#include <algorithm>
#include <set>
#include <vector>

namespace website_host {

namespace fs = std::filesystem;
namespace json = boost::json;
using webots_cloud::errc;
using webots_cloud::Failure;
using webots_cloud::HttpResponse;
using webots_cloud::result;
using webots_cloud::SharedBody;

namespace {

constexpr std::size_t max_page_file = std::size_t{4} << 20;
constexpr std::size_t max_modules = 100;

void replace(std::string& text, std::string_view what, std::string_view with)
{
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
        text.replace(at, what.size(), with);
}

/// The file of a package that `import "<package>"` means, from the package's folder; empty: none.
std::string entry_of(fs::path const& package)
{
    auto const text = webots_cloud::read_regular_file(package / "package.json", max_page_file);
    if (!text)
        return {};
    boost::system::error_code malformed;
    auto const description = json::parse(*text, malformed);
    auto const* const object = malformed ? nullptr : description.if_object();
    auto const* const exports = object ? object->if_contains("exports") : nullptr;
    auto const* const module = exports && exports->is_object() ? exports->get_object().if_contains("import")
                               : object                        ? object->if_contains("module")
                                                               : nullptr;
    return module && module->is_string() ? std::string(module->get_string()) : std::string();
}

/// The packages that npm has installed: `name` and `@scope/name`.
std::vector<std::string> packages_in(fs::path const& modules)
{
    std::vector<std::string> names;
    std::error_code failed;
    for (auto const& entry : fs::directory_iterator(modules, failed)) {
        auto const name = entry.path().filename().string();
        if (!name.starts_with('@')) {
            names.push_back(name);
            continue;
        }
        for (auto const& scoped : fs::directory_iterator(entry.path(), failed))
            names.push_back(name + "/" + scoped.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    names.resize(std::min(names.size(), max_modules));
    return names;
}

} // namespace

result<Page> Page::load(fs::path const& folder, fs::path const& modules)
{
    Page page;
    for (auto const* const name : {"index.html", "page.js", "editor.js", "page.css"}) {
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
    std::map<std::string, std::string> found;
    for (auto const& name : packages_in(modules)) {
        auto const entry = fs::path(entry_of(modules / name)).lexically_normal();
        if (entry.empty() || entry.is_absolute() || *entry.begin() == ".." || entry.extension() != ".js")
            continue;
        auto text = webots_cloud::read_regular_file(modules / name / entry, max_page_file);
        if (!text)
            continue;
        auto const path = "/modules/" + name + ".js";
        page.files_.emplace(path, std::make_shared<SharedBody>(*std::move(text)));
        found.emplace(name, path);
    }
    if (found.contains("@codemirror/view"))
        page.modules_ = std::move(found);
    return page;
}

HttpResponse Page::html(std::string_view session_server) const
{
    auto const nonce = webots_cloud::make_token();
    json::object imports;
    for (auto const& [name, path] : modules_)
        imports[name] = path;
    json::object map;
    map["imports"] = imports;
    auto text = html_;
    replace(text, "{{nonce}}", nonce);
    replace(text, "{{imports}}", json::serialize(map));
    replace(text, "{{view}}", http_address(session_server) + "/view");
    HttpResponse response(200, "text/html; charset=UTF-8", std::move(text));
    // Simulations may be anywhere: session servers name them. Scripts are ours and those of the session
    // server.
    response.headers.emplace_back(
        "Content-Security-Policy",
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval' 'nonce-" + nonce + "' " +
            http_address(session_server) + "; style-src 'self' 'nonce-" + nonce + "' " +
            http_address(session_server) +
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
