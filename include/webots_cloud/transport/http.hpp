// What the HTTP client seam and the server seam share.
#pragma once

#include <webots_cloud/export.hpp>

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Header fields in order; names compare without case.
using HttpHeaders = std::vector<std::pair<std::string, std::string>>;

/// What answers a request that a gateway passes on, the least trusted first. It decides which header fields
/// pass (the tables of docs/gateway.md).
enum class UpstreamKind
{
    simulation, ///< A stranger's program: it learns nothing of the visitor, and has no say about the rest of
                ///< the site.
    machine,    ///< A simulation server: it is told the visitor's address, by which it counts.
    trusted_monitor ///< The monitor of one that the operator trusts: it is told the password that the visitor
                    ///< gives for it, too.
};

/// A body that many answers share: it is made once, and sent from the same memory to all.
/// Thread-safety: one executor.
struct SharedBody
{
    explicit SharedBody(std::string body) : text(std::move(body)) {}

    std::string const text;
    /// The same compressed. Where it is empty the adapter makes it, for the first client that takes it.
    mutable std::string gzip;
};

/// A response. The adapter adds `Content-Length`, `Date`, `Server` and `Connection`.
struct HttpResponse
{
    HttpResponse() = default;
    HttpResponse(int status, std::string content_type, std::string body)
        : status(status), content_type(std::move(content_type)), body(std::move(body))
    {}

    int status = 200;
    std::string content_type; ///< Empty: no such header.
    HttpHeaders headers;      ///< The other headers.
    /// More headers, as lines that end in CR LF, so that frequent answers need not build them. The text must
    /// stay valid until the next call of `Endpoint::respond`.
    std::string_view fixed_headers;
    std::string body;
    std::shared_ptr<SharedBody const> shared; ///< Instead of `body`, unless null.

    /// The body, shared or not.
    std::string const& text() const noexcept { return shared ? shared->text : body; }

    bool operator==(HttpResponse const&) const = default;
};

/// True when two header names, or two tokens, are the same but for the case of ASCII letters.
bool equal_ignoring_case(std::string_view left, std::string_view right) noexcept;

} // namespace webots_cloud
