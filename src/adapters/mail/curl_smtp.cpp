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
    SmtpNotifier(LoadedCurl const& curl, MailConfig mail, std::string own_name)
        : curl_(curl), mail_(std::move(mail)), own_name_(std::move(own_name)), pool_(1)
    {}

    asio::awaitable<result<>> deliver(Notice notice) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        auto state = co_await asio::this_coro::cancellation_state;
        if (state.cancelled() != asio::cancellation_type::none)
            co_return Failure(asio::error::operation_aborted);
        auto message = core::mail_message(notice, mail_.sender, mail_.administrator);
        auto const exchange = std::make_shared<SmtpExchange>(curl_, mail_, own_name_, std::move(message));
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
    MailConfig const mail_;
    std::string const own_name_;
    adapters::BlockingPool pool_;
};

} // namespace

result<std::unique_ptr<Notifier>> make_smtp_notifier(MailConfig mail, std::string own_name)
{
    if (!core::is_mail_host(mail.server))
        return Failure(errc::invalid_argument, "the mail server is not a host name");
    if (!core::is_mail_address(mail.sender) || !core::is_mail_address(mail.administrator))
        return Failure(errc::invalid_argument, "a mail address is not a plain address");
    if (!core::is_printable(mail.user) || !core::is_printable(mail.password))
        return Failure(errc::invalid_argument, "the mail server's user or password has control characters");
    auto const curl = LoadedCurl::load();
    if (!curl)
        return curl.error();
    return std::unique_ptr<Notifier>(
        std::make_unique<SmtpNotifier>(*curl, std::move(mail), std::move(own_name)));
}

} // namespace webots_cloud
