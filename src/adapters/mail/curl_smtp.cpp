#include "adapters/threads/blocking_pool.hpp"
#include "smtp_exchange.hpp"

#include "core/notices/mail_message.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/mail.hpp>

#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/error.hpp>

#include <utility>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
using adapters::LoadedCurl;
using adapters::SmtpExchange;

/// Ends an exchange that runs on another thread.
struct Abort
{
    void operator()(asio::cancellation_type) const { exchange->abort(); }

    std::shared_ptr<SmtpExchange> exchange;
};

/// One mail at a time on a thread of its own, which libcurl may block.
class SmtpNotifier final : public Notifier
{
public:
    SmtpNotifier(LoadedCurl const& curl, SmtpParams params)
        : curl_(curl), params_(std::move(params)), pool_(1)
    {}

    asio::awaitable<result<>> deliver(Notice notice) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        auto state = co_await asio::this_coro::cancellation_state;
        if (state.cancelled() != asio::cancellation_type::none)
            co_return Failure(asio::error::operation_aborted);
        auto message = core::mail_message(notice, params_.mail.sender, params_.mail.administrator);
        auto const exchange = std::make_shared<SmtpExchange>(curl_, params_, std::move(message));
        // The job itself is not cancellable, so the slot is free for what makes it end early.
        Abort on_cancel{exchange};
        auto slot = state.slot();
        if (slot.is_connected())
            slot.assign(std::move(on_cancel));
        auto work = [exchange] { return exchange->perform(); };
        auto sent = co_await pool_.run(std::move(work));
        if (slot.is_connected())
            slot.clear();
        co_return sent;
    }

private:
    LoadedCurl const curl_;
    SmtpParams params_;
    adapters::BlockingPool pool_;
};

} // namespace

result<std::unique_ptr<Notifier>> make_smtp_notifier(SmtpParams params)
{
    if (!core::is_mail_host(params.mail.server))
        return Failure(errc::invalid_argument, "the mail server is not a host name");
    if (!core::is_mail_address(params.mail.sender) || !core::is_mail_address(params.mail.administrator))
        return Failure(errc::invalid_argument, "a mail address is not a plain address");
    if (!core::is_printable(params.mail.user) || !core::is_printable(params.mail.password))
        return Failure(errc::invalid_argument, "the mail server's user or password has control characters");
    if (!core::is_mail_host(params.own_name))
        params.own_name = "localhost"; // it greets, no more
    auto const curl = LoadedCurl::load();
    if (!curl)
        return curl.error();
    return std::unique_ptr<Notifier>(std::make_unique<SmtpNotifier>(*curl, std::move(params)));
}

} // namespace webots_cloud
