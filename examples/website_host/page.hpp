// The page, kept in memory.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/http.hpp>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace website_host {

class Page
{
public:
    /// Reads all files.
    ///
    /// Errors: `invalid_config`, naming the file that can't be read.
    static webots_cloud::result<Page> load(std::filesystem::path const& folder);

    /// The page itself. `session_server` is the only other place that scripts come from.
    webots_cloud::HttpResponse html(std::string_view session_server) const;

    /// Scripts and styles; null where there is no such file.
    std::shared_ptr<webots_cloud::SharedBody const> file(std::string_view path) const;

private:
    Page() = default;

    std::string html_;
    std::map<std::string, std::shared_ptr<webots_cloud::SharedBody const>, std::less<>> files_; ///< By path.
};

/// `http` for `ws`, `https` for `wss`.
std::string http_address(std::string_view websocket_address);

} // namespace website_host
