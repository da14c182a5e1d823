// Tells the administrator of changes of simulation servers, through any Notifier. For session servers.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/server_load.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/notifier.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Numbers of mails. All but `waiting` are counts since the start.
struct OperatorMailStatistics
{
    OperatorMailStatistics() = default;

    std::size_t waiting = 0; ///< Not delivered yet; a digest counts once it is complete.
    std::uint64_t sent = 0;
    std::uint64_t failed = 0;   ///< Failed attempts; one mail may have several.
    std::uint64_t given_up = 0; ///< Mails that were never sent; the log has them.
};

/// Turns changes of simulation servers into notices and delivers them one at a time, with retries.
///
/// A change is mailed at once. Servers that keep changing are collected in one digest every ten minutes.
/// Retries back off from 15 s to 15 min; a failing mail server is logged once, as `Error: unable to send
/// email to <administrator>: <reason>`, until it fails for another reason. What can't be delivered in the end
/// is written to the log. Nothing is sent until `run()` is awaited; changes may be noted before.
///
/// Lifetime: `notifier` and `clock` must outlive it. It must outlive its operations: await their end before
/// it is destroyed.
/// Thread-safety: one executor.
class OperatorMail
{
public:
    /// `administrator`: the address that gets the mails; it is named in the log. Empty: nobody, and changes
    /// are ignored. `server`: where the session server is, for the link in each mail.
    OperatorMail(std::string administrator, PublicAddress const& server, Notifier& notifier, Clock& clock,
                 Logger log);
    ~OperatorMail();

    /// Writes to another one from now on, and tries at once to deliver what is waiting. To be called also
    /// when `notifier` starts to deliver by another mail server. Without an administrator, what is waiting is
    /// written to the log.
    void apply(std::string administrator, PublicAddress const& server);

    /// Takes note of a change. False: it will not be mailed, because there is no administrator or because the
    /// server was only too slow. Never waits.
    bool note(LoadEvent const& event);

    /// Delivers until cancelled; then tries for five seconds to deliver what waits, a digest that is being
    /// collected, too, unless the mail server is down, and writes the rest to the log.
    ///
    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    OperatorMailStatistics statistics() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
