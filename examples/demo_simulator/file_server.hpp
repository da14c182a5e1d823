#pragma once

#include "world_file.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::demo {

struct FileRequest
{
    std::string target;        ///< path and query as in the request line
    std::string host;          ///< Host header
    std::string if_none_match; ///< raw header text, or empty
};

/// Answers GET requests for the files of a project as Webots does, and for the signs of its robots.
class FileServer
{
public:
    /// Without `serve_project` only the built-in page is found. `robots` must outlive the server.
    FileServer(std::filesystem::path root, bool serve_project, std::vector<RobotDescription> const& robots);

    /// A complete HTTP answer: status line, header and body.
    std::string answer(FileRequest const& request) const;

private:
    std::filesystem::path root_;
    bool serve_project_;
    std::vector<RobotDescription> const& robots_;
};

} // namespace webots_cloud::demo
