// What web servers answer us: whatever it is, it ends in a response within its limits or in one printable
// sentence.
#include "fuzz.hpp"

#include "core/text.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>

#include <array>
#include <list>
#include <optional>
#include <string>

using namespace webots_cloud;
namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

constexpr std::size_t body_limit = 1000;

/// Says the same to whoever comes, and no more: then it waits until they have gone.
class WebServer
{
public:
    explicit WebServer(asio::io_context& context)
        : acceptor_(context, tcp::endpoint(asio::ip::address_v4::loopback(), 0))
    {}

    void answer_with(std::string_view text)
    {
        text_ = text;
        accept();
    }

    /// Nobody new is answered, and who is still there hears no more.
    void stop()
    {
        acceptor_.cancel();
        guests_.clear();
    }

    std::string url() const
    {
        return core::concat("http://127.0.0.1:", std::to_string(acceptor_.local_endpoint().port()), "/load");
    }

private:
    struct Guest
    {
        explicit Guest(tcp::socket connected) : socket(std::move(connected)) {}

        tcp::socket socket;
        std::array<char, 1024> heard{};
    };

    void accept()
    {
        acceptor_.async_accept([this](boost::system::error_code error, tcp::socket socket) {
            if (error)
                return;
            listen_to(guests_.emplace_back(std::move(socket)));
            accept();
        });
    }

    void listen_to(Guest& guest)
    {
        guest.socket.async_read_some(asio::buffer(guest.heard),
                                     [this, &guest](boost::system::error_code error, std::size_t) {
                                         if (error)
                                             return;
                                         boost::system::error_code gone;
                                         asio::write(guest.socket, asio::buffer(text_),
                                                     gone); // it fits into the buffers of two sockets
                                         guest.socket.shutdown(tcp::socket::shutdown_send, gone);
                                     });
    }

    tcp::acceptor acceptor_;
    std::list<Guest> guests_;
    std::string text_;
};

using Outcome = result<HttpResponse>;

asio::awaitable<void> send_twice(HttpClient& client, HttpRequest request, std::optional<Outcome>& first,
                                 std::optional<Outcome>& second)
{
    first.emplace(co_await client.send(request));
    if (*first) // a connection that may be used again has ended meanwhile
        second.emplace(co_await client.send(request));
}

void check(Outcome const& outcome)
{
    if (!outcome) {
        auto const message = outcome.error().message();
        fuzz::require(!message.empty() && message.size() < 1000 && core::is_printable(message));
        fuzz::require(!(outcome.error() == errc::timed_out));
        return;
    }
    fuzz::require(outcome->status >= 0 && outcome->status <= 999 && outcome->body.size() <= body_limit);
    std::size_t bytes = 0;
    for (auto const& [name, value] : outcome->headers) {
        fuzz::require(!name.empty() && name.find_first_of("\r\n: ") == std::string::npos);
        fuzz::require(value.find_first_of("\r\n") == std::string::npos);
        bytes += name.size() + value.size();
    }
    fuzz::require(bytes <= 64 * 1024);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    static asio::io_context context;
    static std::optional<WebServer> server;
    static int served = 0;
    if (served++ % 1000 == 0) // each port has so many connections that have just ended
        server.emplace(context);
    server->answer_with(fuzz::text_of(data, size));
    auto client = make_http_client(context.get_executor());
    HttpRequest request(server->url());
    request.body_limit = body_limit;
    request.timeout = std::chrono::seconds(30);
    std::optional<Outcome> first;
    std::optional<Outcome> second;
    asio::co_spawn(context, send_twice(*client, std::move(request), first, second),
                   [&](std::exception_ptr failed) {
                       fuzz::require(!failed);
                       server->stop();
                       client.reset();
                   });
    context.run();
    context.restart();
    check(*first);
    if (second) {
        check(*second);
        fuzz::require(second->has_value() && (*second)->status == (*first)->status &&
                      (*second)->body == (*first)->body);
    }
    return 0;
}
