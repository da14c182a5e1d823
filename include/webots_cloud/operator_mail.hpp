// Tells the administrator what happens to simulation servers, through any Notifier. For session servers.
#pragma once

#include <webots_cloud/error.hpp>
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

namespace webots_cloud {

struct OperatorMailParams
{
    OperatorMailParams() = default;

    /// Who gets the mails: named in the log. Empty: nobody, and changes are not taken note of.
    std::string administrator;
    PublicAddress address; ///< Of the session server, for the link in each mail.
};

/// What became of mails. All but the first are counts since the start.
struct OperatorMailStatistics
{
    OperatorMailStatistics() = default;

    std::size_t waiting = 0; ///< Mails that are not delivered yet; what a digest collects is none.
    std::uint64_t sent = 0;
    std::uint64_t failed = 0;   ///< Attempts; a mail may cost several.
    std::uint64_t given_up = 0; ///< Mails that were never sent; the log has them.
};

/// Turns changes of simulation servers into notices and delivers them, one at a time, again and again if need
/// be.
///
/// A change is told at once. A server that changes on and on is told of in digests, one in ten minutes for
/// all of them, and a mail server that is down is tried less and less often (every 15 s at first, every 15
/// min in the end) and costs one line of the log, `Error: unable to send email to <administrator>: <reason>`,
/// until the kind of the failure changes. What can't be delivered in the end is written to the log. Inert
/// until `run()` is awaited; changes may be noted before.
/// Lifetime: `notifier` and `clock` must outlive it.
/// Thread-safety: one executor.
class OperatorMail
{
public:
    OperatorMail(OperatorMailParams params, Notifier& notifier, Clock& clock, Logger log);
    ~OperatorMail();

    /// Takes other parameters, and tries at once to deliver what waits: to be called also when `notifier`
    /// delivers elsewhere from now on. Without an administrator what waits is written to the log.
    void apply(OperatorMailParams params);

    /// Takes note of a change. False: nobody gets mails, or it is none to be mailed (merely too slow); then
    /// it is left alone. Never waits.
    bool note(LoadEvent const& event);

    /// Delivers until cancelled; what is not delivered then is written to the log.
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
