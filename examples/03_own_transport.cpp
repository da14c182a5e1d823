// Brings a transport of one's own: here an HttpClient that answers from a table instead of the network, as a
// program would that learns loads by other means. Links webots_cloud::core alone: no Beast, no libcurl, no
// git.
#include <webots_cloud/load_monitor.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <iostream>
#include <map>

using namespace webots_cloud;
namespace asio = boost::asio;

// [client]
/// Knows the answers beforehand.
class TableClient final : public HttpClient
{
public:
    explicit TableClient(std::map<std::string, std::string> answers) : answers_(std::move(answers)) {}

    asio::awaitable<result<HttpResponse>> send(HttpRequest request) override
    {
        auto const found = answers_.find(request.url);
        if (found == answers_.end())
            co_return Failure(errc::unreachable, "nobody is at " + request.url);
        co_return HttpResponse(200, "text/plain", found->second);
    }

private:
    std::map<std::string, std::string> answers_;
};
// [client]

class TimerClock final : public Clock
{
public:
    explicit TimerClock(asio::any_io_executor executor) : executor_(std::move(executor)) {}

    TimePoint now() const noexcept override { return std::chrono::steady_clock::now(); }
    WallTime wall() const noexcept override { return std::chrono::system_clock::now(); }
    asio::awaitable<result<>> wait_until(TimePoint when) override
    {
        asio::steady_timer timer(executor_, when);
        auto const [error] = co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
        if (error)
            co_return Failure(error);
        co_return result<>();
    }

private:
    asio::any_io_executor executor_;
};

int main()
{
    asio::io_context context(1);
    TableClient http(
        {{"http://sim1:2000/load", "40"}, {"http://sim2:2000/load", R"({"load":10,"sessions":1})"}});
    TimerClock clock(context.get_executor());
    LoadMonitor monitor(http, clock);
    monitor.set_servers({"sim1:2000", "sim2:2000", "sim3:2000"});

    asio::cancellation_signal stop;
    auto const ended = [](std::exception_ptr failure, result<> const&) {
        if (failure) // a mistake in a program: context.run() throws it
            std::rethrow_exception(failure);
    };
    asio::co_spawn(context, monitor.run(), asio::bind_cancellation_slot(stop.slot(), ended));
    auto const on_events = [&](std::exception_ptr failure, auto const&) {
        if (failure)
            std::rethrow_exception(failure);
        stop.emit(asio::cancellation_type::terminal);
    };
    asio::co_spawn(context, monitor.next_events(), on_events);
    context.run();

    for (ServerLoad const& server : monitor.servers())
        std::cout << server.address << ": "
                  << (server.state == ServerState::up ? std::to_string(server.report.load) + " %"
                                                      : server.problem)
                  << '\n';
}
