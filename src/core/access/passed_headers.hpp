// Which header fields gateways pass on: all that simulations and their browsers need, and nothing else. What
// is not in these tables stays where it is: passwords, cookies and addresses of visitors on one side,
// commands to a browser about the rest of the site on the other. docs/gateway.md shows the tables.
#pragma once

#include <webots_cloud/transport/http.hpp>

#include <array>
#include <string_view>

namespace webots_cloud::core {

/// A field of requests, or of answers.
struct PassedHeader
{
    std::string_view name;
    UpstreamKind least; ///< The least trusted peer with which it is exchanged.
    std::string_view why;
};

// tests/hygiene/passed_headers.py reads these lines and writes the tables of docs/gateway.md.

/// Of what a browser asks. The gateway itself writes how long the body is (there is none), and what concerns
/// one connection alone: `Connection`, `Upgrade`.
inline constexpr auto passed_request_headers = [] {
    using enum UpstreamKind;
    return std::to_array<PassedHeader>({
        // clang-format off
        {"Host", simulation, "where the visitor asks"},
        {"Accept", simulation, "which kinds of file the browser takes"},
        {"Accept-Charset", simulation, "the same of characters"},
        {"Accept-Encoding", simulation, "the same of compression"},
        {"Accept-Language", simulation, "the same of languages"},
        {"Range", simulation, "a part of a file"},
        {"If-Match", simulation, "only if the file is that one"},
        {"If-None-Match", simulation, "only if the file has changed"},
        {"If-Modified-Since", simulation, "the same by its time"},
        {"If-Unmodified-Since", simulation, "only if it has not"},
        {"If-Range", simulation, "a part, if the rest has not changed"},
        {"Cache-Control", simulation, "whether an older copy will do"},
        {"User-Agent", simulation, "which browser it is"},
        {"Origin", simulation, "which page asks: simulators check it, too"},
        {"Sec-WebSocket-Key", simulation, "a WebSocket handshake"},
        {"Sec-WebSocket-Version", simulation, "a WebSocket handshake"},
        {"Sec-WebSocket-Protocol", simulation, "a WebSocket handshake"},
        {"Sec-WebSocket-Extensions", simulation, "a WebSocket handshake"},
        {"Authorization", trusted_monitor, "the password of a machine's monitor"},
        // clang-format on
    });
}();

/// Of what the other server answers. The gateway itself writes `Content-Length`, `Connection` and `Upgrade`.
inline constexpr auto passed_answer_headers = [] {
    using enum UpstreamKind;
    return std::to_array<PassedHeader>({
        // clang-format off
        {"Content-Type", simulation, "what the file is"},
        {"Content-Encoding", simulation, "how it is compressed"},
        {"Content-Language", simulation, "its language"},
        {"Content-Range", simulation, "which part it is"},
        {"Content-Disposition", simulation, "under which name to save it"},
        {"Accept-Ranges", simulation, "whether parts may be asked for"},
        {"Cache-Control", simulation, "how long a copy is good"},
        {"Expires", simulation, "the same"},
        {"Age", simulation, "the same"},
        {"Vary", simulation, "for which requests it is good"},
        {"ETag", simulation, "which version of the file it is"},
        {"Last-Modified", simulation, "the same by its time"},
        {"Date", simulation, "when it was sent"},
        {"Server", simulation, "which program has answered"},
        {"Allow", simulation, "which methods there are"},
        {"Location", simulation, "where the file is now"},
        {"Retry-After", simulation, "when to ask again"},
        {"Access-Control-Allow-Origin", simulation, "which pages may read it"},
        {"Access-Control-Allow-Methods", simulation, "the same of requests"},
        {"Access-Control-Allow-Headers", simulation, "the same of requests"},
        {"Access-Control-Expose-Headers", simulation, "what pages may read of these fields"},
        {"Access-Control-Max-Age", simulation, "how long that is good"},
        {"Content-Security-Policy", simulation, "what its own page may not do"},
        {"Cross-Origin-Embedder-Policy", simulation, "the same"},
        {"Cross-Origin-Opener-Policy", simulation, "the same"},
        {"Cross-Origin-Resource-Policy", simulation, "which pages may show it"},
        {"Permissions-Policy", simulation, "what its own page may not do"},
        {"Referrer-Policy", simulation, "what its own page says of itself"},
        {"X-Content-Type-Options", simulation, "the type is not guessed"},
        {"X-Frame-Options", simulation, "which pages may frame it"},
        {"Sec-WebSocket-Accept", simulation, "a WebSocket handshake"},
        {"Sec-WebSocket-Protocol", simulation, "a WebSocket handshake"},
        {"Sec-WebSocket-Extensions", simulation, "a WebSocket handshake"},
        {"WWW-Authenticate", trusted_monitor, "a machine's monitor asks for its password"},
        // clang-format on
    });
}();

/// Whether a field of a request to such a server is passed on.
bool is_request_header_passed(std::string_view name, UpstreamKind upstream) noexcept;

/// Whether a field of its answer is.
bool is_answer_header_passed(std::string_view name, UpstreamKind upstream) noexcept;

/// Whether it is told who asks, by `X-Forwarded-For`: machines are, since they count simulations by visitor.
constexpr bool is_told_clients(UpstreamKind upstream) noexcept
{
    return upstream != UpstreamKind::simulation;
}

} // namespace webots_cloud::core
