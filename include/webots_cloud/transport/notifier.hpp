// Telling the operator as a seam: e-mail, or whatever an embedder prefers.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/notice.hpp>

#include <boost/asio/awaitable.hpp>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Delivers notices, one at a time, with one attempt each: the caller retries.
///
/// Contract: an attempt ends after a bounded time by itself.
/// Cancellation: terminal; the attempt is abandoned without leaving anything, and `operation_aborted` is
/// reported.
/// Errors: `unreachable` (name, connection, TLS); `timed_out`; `unavailable` when the other side can't take
/// it now; `refused` when it will not take it; `protocol_error`. The detail names the reason.
/// Thread-safety: one executor.
class Notifier
{
public:
    virtual ~Notifier() = default;
    virtual boost::asio::awaitable<result<>> deliver(Notice notice) = 0;
};

} // namespace webots_cloud
