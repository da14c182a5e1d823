// HTTP for project sources: blocking requests over libcurl that stop when they must.
#pragma once

#include "core/access/ip_address.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/network_config.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// When a request has to stop.
struct CurlLimits
{
    std::atomic<bool> const* aborted =
        nullptr; ///< Stops soon after it becomes true.   Lifetime: outlives the request.
    std::atomic<bool> const* abandoned = nullptr; ///< The same again, for another reason.
    TimePoint deadline = TimePoint::max();
    std::uint64_t bytes = std::uint64_t{64} << 20;         ///< Of the answer's body.
    std::uint64_t header_bytes = std::uint64_t{256} << 10; ///< Of all its headers and trailers.
    LowSpeed low_speed;
};

/// A request.
struct CurlRequest
{
    std::string peer; ///< The server's name in messages: "the git server".
    /// What the operator configured. Redirects that stay below it are followed with `headers`; about others
    /// `may_redirect` is asked.
    std::string base;
    std::string url;                  ///< Begins with `base` and a slash.
    std::string agent;                ///< Our `User-Agent`.
    std::vector<std::string> headers; ///< Lines without line ends.
    std::string body;                 ///< Of a POST; empty: GET.
    /// Gets the answer's body piece by piece when the status is 200; a failure stops the request and is its
    /// result.
    std::function<result<>(std::string_view)> sink;
    /// What to say of a failure that is not the sink's, which knows better. Empty: as it is.
    std::function<Failure(Failure const&)> explain;
    /// Called before a redirect that leads away from `base`, where `headers` are not sent; a failure is the
    /// result. Empty: never followed.
    std::function<result<>(std::string const& url)> may_redirect;
    /// Called before anything is sent, to allow or refuse a numeric address: that of the URL's
    /// host, or of a proxy. Empty: all may.
    std::function<bool(std::string const& url, core::IpAddress const& address)> may_contact;
    std::optional<core::IpAddress>* answered_by = nullptr; ///< Gets the address of who answered.
};

/// Sends requests and keeps connections open between them.   Thread-safety: any thread.
class CurlHttp
{
public:
    /// The file of `config.authorities` is read now.
    explicit CurlHttp(HttpClientConfig config = HttpClientConfig());
    ~CurlHttp();

    /// The status of the answer; the body has gone to the sink when it is 200, and of others at most 64 kB
    /// are read. Blocks.
    ///
    /// Errors: `unreachable` (also: cut), `timed_out`, `too_large`, `operation_aborted`, `protocol_error`,
    /// `refused` (`may_contact`), what the sink, `may_redirect` and `explain` returned.
    result<int> send(CurlRequest const& request, CurlLimits const& limits);

private:
    class Handle;

    std::unique_ptr<Handle> take();
    void give_back(std::unique_ptr<Handle> handle);

    HttpClientConfig const config_;
    std::string const authorities_; ///< The text of its file.
    std::mutex mutex_;
    std::vector<std::unique_ptr<Handle>> idle_;
};

} // namespace webots_cloud::adapters
