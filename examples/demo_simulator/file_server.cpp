// Answers requests by HTTP at the simulator's port, as Webots does: its page and, where it serves the
// project, the files of that.
#include "file_server.hpp"

#include "name_sign.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>

namespace webots_cloud::demo {
namespace {

constexpr std::uintmax_t max_served_file = std::uintmax_t{64} << 20;

constexpr std::string_view page = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>webots_cloud demo simulator</title></head>
<body><h1>webots_cloud demo simulator</h1>
<p>This is not Webots. In mjpeg mode the picture below is live.</p>
<p><img alt="live picture of the arena"></p>
<script>
const socket = new WebSocket(new URL('.', location.href.replace('http', 'ws')));
socket.onopen = () => socket.send('mjpeg: 640x480');
socket.onmessage = () => { // it knows the size
  socket.onmessage = null;
  document.querySelector('img').src = 'mjpeg';
};
</script></body></html>
)";

int hex_digit(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    c = static_cast<char>(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/// Nothing when the text holds a malformed escape or a control character.
std::optional<std::string> percent_decoded(std::string_view text)
{
    std::string result;
    for (std::size_t i = 0; i < text.size(); ++i) {
        char c = text[i];
        if (c == '%') {
            if (i + 2 >= text.size())
                return std::nullopt;
            int const high = hex_digit(text[i + 1]);
            int const low = hex_digit(text[i + 2]);
            if (high < 0 || low < 0)
                return std::nullopt;
            c = static_cast<char>(high * 16 + low);
            i += 2;
        }
        if (static_cast<unsigned char>(c) < 0x20)
            return std::nullopt;
        result += c;
    }
    return result;
}

/// The regular file that `path` names under `root`, never one outside it, symbolic links included.
std::optional<std::filesystem::path> locate(std::filesystem::path const& root, std::string_view path)
{
    while (path.starts_with("/"))
        path.remove_prefix(1);
    std::error_code error;
    auto const base = std::filesystem::canonical(root, error);
    if (error)
        return std::nullopt;
    auto const file = std::filesystem::canonical(base / path, error);
    if (error || !std::filesystem::is_regular_file(file, error) ||
        std::filesystem::file_size(file, error) > max_served_file)
        return std::nullopt;
    auto const [end, unused] = std::mismatch(base.begin(), base.end(), file.begin(), file.end());
    return end == base.end() ? std::optional(file) : std::nullopt;
}

std::string content_type(std::string extension)
{
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
    struct Type
    {
        std::string_view extension;
        std::string_view type;
    };
    static constexpr Type types[] = {
        {".png", "image/png"},
        {".jpg", "image/jpg"},
        {".jpeg", "image/jpeg"},
        {".ico", "image/ico"},
        {".svg", "image/svg+xml"},
        {".html", "text/html"},
        {".css", "text/css"},
        {".js", "application/javascript"},
        {".dae", "model/vnd.collada+xml"},
        {".obj", "model/obj"},
        {".mtl", "model/mtl"},
        {".stl", "model/stl"},
    };
    for (Type const& type : types)
        if (type.extension == extension)
            return std::string(type.type);
    return "application/octet-stream";
}

/// 32 hexadecimal digits. Webots sends an MD5 sum; a client only ever sends it back.
std::string fingerprint(std::string_view bytes)
{
    auto const hash = [bytes](std::uint64_t value) {
        for (char const c : bytes)
            value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL; // FNV-1a
        return static_cast<unsigned long long>(value);
    };
    std::array<char, 40> text{};
    std::snprintf(text.data(), text.size(), "%016llx%016llx", hash(0xcbf29ce484222325ULL),
                  hash(0x84222325cbf29ce4ULL));
    return text.data();
}

/// With a path, as gateways send it, from which this server is reached.
bool is_host_name(std::string_view host)
{
    return !host.empty() && host.size() < 260 && std::all_of(host.begin(), host.end(), [](unsigned char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
               std::string_view{".:-[]_/"}.find(static_cast<char>(c)) != std::string_view::npos;
    });
}

/// Files name assets of the Webots installation by `webots://`; a browser must ask this server for them.
void redirect_assets(std::string& text, std::string const& host)
{
    constexpr std::string_view scheme = "webots://";
    if (!is_host_name(host))
        return;
    std::string const replacement = "http://" + host + "/";
    std::string result;
    std::size_t from = 0;
    for (std::size_t at; (at = text.find(scheme, from)) != std::string::npos; from = at + scheme.size())
        result.append(text, from, at - from).append(replacement);
    if (from != 0)
        text = result.append(text, from);
}

std::string response(std::string_view status, std::string const& type, std::string_view extra,
                     std::string_view body)
{
    std::string text = "HTTP/1.1 ";
    text.append(status).append("\r\nAccess-Control-Allow-Origin: *\r\n").append(extra);
    if (!type.empty())
        text += "Content-Type: " + type + "\r\n";
    text += "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n";
    return text.append(body);
}

std::string not_found()
{
    return response("404 Not Found", "text/html", "",
                    "<!DOCTYPE html><html><body><h1>404: File Not Found</h1></body></html>");
}

std::string found(FileRequest const& request, std::string const& type, std::string body)
{
    redirect_assets(body, request.host);
    std::string const tag = fingerprint(body);
    std::string const caching = "Cache-Control: public, max-age=3600\r\netag: " + tag + "\r\n";
    if (request.if_none_match == tag)
        return response("304 Not modified", "", caching, "");
    return response("200 OK", type, caching, body);
}

} // namespace

FileServer::FileServer(std::filesystem::path root, bool serve_project,
                       std::vector<RobotDescription> const& robots)
    : root_(std::move(root)), serve_project_(serve_project), robots_(robots)
{}

std::string FileServer::answer(FileRequest const& request) const
{
    std::string_view const target = request.target;
    auto const path = percent_decoded(target.substr(0, target.rfind('?')));
    if (!path)
        return not_found();
    if (serve_project_) {
        if (auto const file = locate(root_, *path)) {
            std::ifstream stream(*file, std::ios::binary);
            std::string body{std::istreambuf_iterator<char>(stream), {}};
            return found(request, content_type(file->extension().string()), std::move(body));
        }
        for (auto const& robot : robots_)
            if (*path == "/" + sign_path(robot))
                return found(request, "image/png", sign_picture(robot));
    }
    if (*path == "/" || *path == "/index.html")
        return found(request, "text/html", std::string(page));
    return not_found();
}

} // namespace webots_cloud::demo
