// The session server's protocol: /session, availability, classes, /load and /monitor, over any server
// adapter.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/controllers.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Optional callbacks of a SessionService. None of them may block.
struct SessionServiceHooks
{
    SessionServiceHooks() = default;

    /// Called for every change of a server. True: the operator will be told, so it is not logged.
    std::function<bool(LoadEvent const&)> tell_operator;
    /// The ticket with which a browser comes to a server (its address, as in its ServerSpec): `/session`
    /// answers `wss://host/2000/ticket/<ticket>`. Empty: there are no tickets.
    std::function<std::string(std::string_view server)> make_ticket;
    /// Makes that many bytes that nobody can guess, for the codes and keys of classes. Empty: no classes.
    std::function<std::string(std::size_t size)> random_bytes;
    /// Where the other machines of our networks find this one, for teachers whose page is open as localhost,
    /// which nobody else can open. Empty: they are told of none.
    std::function<std::vector<std::string>()> shared_addresses;
    /// To simulation servers, for `SessionServiceConfig::relay` and for what they keep ready for classes.
    /// Must outlive the service. Null: nothing is relayed, whatever `relay` says, and nothing kept ready.
    WebSocketClient* websockets = nullptr;
    /// Asks simulation servers which worlds they have, for the gallery. Must outlive the service. Null: it
    /// shows what the configuration says.
    HttpClient* http = nullptr;
    /// Signs the tickets with which browsers that wait keep their places (HMAC-SHA256), the same after a
    /// restart. Empty: they keep none.
    std::function<std::string(std::string_view message)> sign_waiting_ticket;
    /// Answers `POST /api/machines`, with which simulation servers announce themselves. Empty: 404.
    std::function<HttpResponse(IncomingRequest const&)> take_announcement;
    /// More families for `GET /metrics`, in the text format of Prometheus, appended to the service's own.
    std::function<std::string()> more_metrics;
};

/// Tells browsers whether a simulation could be started, and sends each to a machine, or relays what they
/// say.
///
/// An adapter has to serve it. The charts of its monitor page have a point for each poll, at the interval
/// that the monitor had when the service was made: more would draw the same load twice. Its machines are
/// those of the fleet, which the monitor and the scheduler follow from then on, too. While `run()` is
/// awaited, reports are passed from the monitor to the scheduler, and changes of availability to the
/// browsers.
///
/// Lifetime: everything passed by reference must outlive the service, and the service must outlive its
/// operations: await their end before it is destroyed.
/// Thread-safety: one executor.
class SessionService final : public Endpoint, public ControllerDoor
{
public:
    /// Of `config` it obeys `service`. `address` and `access.host_names` say where the world outside reaches
    /// the server; the `ssl` of that is the machines', too: browsers are sent to `wss://` instead of `ws://`.
    /// With `relay` it matters whether machines are found (`announcements`, names in `simulation_servers`):
    /// then not all of them are known at the start.
    SessionService(SessionConfig config, Fleet& fleet, LoadMonitor& monitor, Scheduler& scheduler,
                   Clock& clock, Logger log, SessionServiceHooks hooks = SessionServiceHooks());
    ~SessionService() override;

    /// Obeys another configuration, but for the port, which stays. Browsers stay connected, and pages show at
    /// once what has changed, in the fleet and in the parameters of the monitor, too.
    void apply(SessionConfig config);

    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    Answer respond(IncomingRequest const& request) override;
    std::uint64_t max_body(IncomingRequest const& request) override;
    boost::asio::awaitable<HttpResponse> respond_to_body(IncomingRequest const& request) override;
    boost::asio::awaitable<void> serve_websocket(ChannelInfo info, Channel& channel) override;
    void stopping() override;
    result<ControllerWay> way_of_controller(std::uint16_t machine, std::string_view key,
                                            std::string_view robot) override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
