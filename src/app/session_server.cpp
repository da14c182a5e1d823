#include "../core/text.hpp"
#include "network.hpp"
#include "signals.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/operator_mail.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/servers.hpp>
#include <webots_cloud/service_report.hpp>
#include <webots_cloud/session_service.hpp>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include <memory>
#include <optional>
#include <random>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;

LoadMonitorParams load_monitor_params(SessionConfig const& config)
{
    LoadMonitorParams params;
    params.interval = config.load_refresh;
    params.timeout = config.load_timeout;
    params.threshold = config.load_threshold;
    params.tls = config.ssl;
    return params;
}

SchedulerParams scheduler_params(SessionConfig const& config)
{
    SchedulerParams params;
    params.policy = config.scheduling;
    params.threshold = config.load_threshold;
    params.placement_timeout = config.placement_timeout;
    params.report_lifetime = 2 * config.load_refresh + config.load_timeout;
    params.seed = std::random_device()();
    return params;
}

SessionServiceParams session_service_params(SessionConfig const& config)
{
    SessionServiceParams params;
    params.ssl = config.ssl;
    params.threshold = config.load_threshold;
    params.port = config.port;
    params.history_step = config.load_refresh;
    params.decisions_for_all = config.decisions_for_all;
    boost::json::object defaults;
    if (!config.viewer_url.empty())
        defaults["url"] = config.viewer_url;
    params.viewer_defaults = boost::json::serialize(defaults);
    return params;
}

SmtpParams smtp_params(SessionConfig const& config)
{
    SmtpParams params;
    params.host = config.mail_server;
    params.port = config.mail_server_port;
    params.sender = config.mail_sender;
    params.recipient = config.administrator;
    params.user = config.mail_sender_user;
    params.password = config.mail_sender_password;
    params.own_name = config.server;
    return params;
}

OperatorMailParams operator_mail_params(SessionConfig const& config)
{
    OperatorMailParams params;
    params.administrator = config.administrator;
    params.server = config.server;
    params.port = config.port;
    params.ssl = config.ssl;
    params.port_rewrite = config.port_rewrite;
    return params;
}

/// Without an administrator: until cancelled, too.
asio::awaitable<result<>> tell_administrator(OperatorMail* mail, Clock& clock)
{
    if (mail)
        co_return co_await mail->run();
    co_return co_await clock.wait_until(TimePoint::max());
}

} // namespace

asio::awaitable<result<>> serve_sessions(asio::any_io_executor executor, SessionConfig config, Reread<SessionConfig> reread,
                                         Logger log)
{
    using namespace asio::experimental::awaitable_operators;
    auto const clock = make_steady_clock(executor);
    auto const http = make_http_client(executor);
    LoadMonitor monitor(load_monitor_params(config), *http, *clock, log);
    Scheduler scheduler(scheduler_params(config));
    std::unique_ptr<Notifier> notifier;
    std::optional<OperatorMail> mail;
    auto service_params = session_service_params(config);
    if (!config.administrator.empty()) {
        auto made = make_smtp_notifier(smtp_params(config));
        if (!made)
            co_return made.error();
        notifier = std::move(*made);
        mail.emplace(operator_mail_params(config), *notifier, *clock, log);
        service_params.tell_administrator = [&mail](LoadEvent const& event) { mail->note(event); };
    }
    SessionService service(std::move(service_params), monitor, scheduler, *clock, log);
    service.set_servers(config.simulation_servers);

    auto const server = make_http_server(executor, app::server_params(config.port, config.network), service, log);
    if (auto const listening = server->listen(); !listening)
        co_return listening.error();
    log.info(core::concat("Session server running on port ", std::to_string(config.port)));
    std::function<void(SessionConfig const&)> const apply = [&service](SessionConfig const& next) {
        service.set_servers(next.simulation_servers);
    };
    auto const manager = make_service_manager();
    auto const ended = co_await (server->run() || report_to(*manager, *clock) || service.run() || monitor.run() ||
                                 tell_administrator(mail ? &*mail : nullptr, *clock) ||
                                 app::obey_sighup(executor, std::move(reread), apply, log));
    co_return std::visit([](result<> const& outcome) { return outcome; }, ended);
}

} // namespace webots_cloud
