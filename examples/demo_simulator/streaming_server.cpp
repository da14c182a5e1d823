// The port of the simulator: finds one that is free, accepts browsers, requests and controllers, and
// carries to each what the Simulator has for it.
#include "streaming_server.hpp"

#include "console.hpp"
#include "process_faults.hpp"
#include "text.hpp"

#include <boost/asio/error.hpp>
#include <boost/asio/ip/v6_only.hpp>

#include <algorithm>
#include <exception>
#include <stdexcept>

namespace webots_cloud::demo {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr int fast_factor = 20; ///< times real time: fast enough to watch, and far from taking a whole core
constexpr int max_ticks_to_catch_up = 8;
constexpr std::chrono::milliseconds min_picture_time{50};
constexpr int ports_to_try = 11;

std::string part(std::string const& jpeg)
{
    return "--WebotsFrame\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size()) +
           "\r\n\r\n" + jpeg + "\r\n";
}

} // namespace

StreamingServer::StreamingServer(asio::io_context& context, Options const& options)
    : context_(context), options_(options), programs_(context),
      simulator_(options, *this, programs_, print_line),
      extern_consoles_(context, [this](std::string const& line) { simulator_.say(line); }),
      acceptor_(context), accept_pause_(context), tick_timer_(context), picture_timer_(context)
{}

bool StreamingServer::bind(tcp::endpoint const& endpoint, error_code& error)
{
    tcp::acceptor acceptor(context_);
    error_code ignored;
    acceptor.open(endpoint.protocol(), error);
    if (!error) {
        acceptor.set_option(tcp::acceptor::reuse_address(true), ignored);
        if (endpoint.address().is_v6() && endpoint.address().is_unspecified())
            acceptor.set_option(asio::ip::v6_only(false), ignored);
        acceptor.bind(endpoint, error);
    }
    if (!error)
        acceptor.listen(max_connections, error);
    if (error)
        return false;
    acceptor_ = std::move(acceptor);
    return true;
}

void StreamingServer::listen()
{
    error_code error;
    auto address = asio::ip::make_address(options_.address.empty() ? "::" : options_.address, error);
    if (error)
        throw std::runtime_error("invalid address '" + printable(options_.address, 80) +
                                 "': an IP address was expected");
    bool const wrong = options_.faults.wrong_port;
    for (int i = 0; i < ports_to_try && options_.port + i <= 65535; ++i) {
        auto const port = static_cast<unsigned short>(wrong ? 0 : options_.port + i);
        bool bound = bind({address, port}, error);
        if (!bound && error != asio::error::address_in_use && options_.address.empty() && address.is_v6()) {
            address = asio::ip::address_v4::any(); // the machine has no IPv6
            bound = bind({address, port}, error);
        }
        if (bound)
            return accept();
        print_line("demo simulator: port " + std::to_string(port) + ": " + error.message());
    }
    throw std::runtime_error("cannot listen on port " + std::to_string(options_.port) + ": " +
                             error.message());
}

void StreamingServer::load()
{
    simulator_.load();
    extern_consoles_.open(simulator_.extern_robots(), endpoint().port());
    if (!options_.extern_urls)
        return;
    for (auto const& robot : simulator_.extern_robots()) {
        auto const place = std::to_string(endpoint().port()) + "/" + encoded_name(robot);
        print_line("ipc://" + place);
        print_line("tcp://<ip_address>:" + place);
    }
}

void StreamingServer::accept()
{
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
        if (error) { // out of file descriptors, most likely
            accept_pause_.expires_after(std::chrono::milliseconds(100));
            return accept_pause_.async_wait([this](error_code) { accept(); });
        }
        if (*connections_ < max_connections) {
            ++*connections_;
            Seat seat(nullptr, [connections = connections_](void*) { --*connections; });
            serve(std::move(socket), *this, std::move(seat));
        }
        accept();
    });
}

void StreamingServer::send(ClientId client, Text text, bool is_state)
{
    auto const found = clients_.find(client);
    if (found == clients_.end())
        return;
    if (auto const outlet = found->second.lock())
        outlet->send(std::move(text), is_state);
}

ClientId StreamingServer::open_client(std::weak_ptr<ClientOutlet> outlet)
{
    ClientId const client = next_client_++;
    clients_.emplace(client, std::move(outlet));
    simulator_.connect(client);
    return client;
}

void StreamingServer::close_client(ClientId client)
{
    simulator_.disconnect(client);
    clients_.erase(client);
}

std::string StreamingServer::answer_file(FileRequest const& request) const
{
    return FileServer(simulator_.project_root(), !simulator_.streams_pictures(), simulator_.robots())
        .answer(request);
}

ControllerAnswer StreamingServer::answer_controller(std::string_view greeting)
{
    if (!simulator_.is_loaded())
        return {"PROCESSING", {}};
    auto answer = extern_controllers_.connect(greeting, simulator_.extern_robots());
    if (!answer.robot.empty())
        simulator_.say("INFO: '" + answer.robot + "' extern controller: connected.");
    return answer;
}

void StreamingServer::hear_controller(std::string const& robot, std::string const& line)
{
    if (auto const cruise = cruise_in(line))
        simulator_.set_cruise(robot, *cruise);
    simulator_.say("'" + robot + "' extern controller: " + printable(line));
}

void StreamingServer::close_controller(std::string const& robot)
{
    extern_controllers_.disconnect(robot);
    simulator_.say("INFO: '" + robot + "' extern controller: disconnected.");
}

// --- the simulation's clock

void StreamingServer::mode_changed()
{
    ++run_;
    tick_timer_.cancel();
    if (!simulator_.is_running())
        return;
    // The first step is made at once, unless one was made a moment ago: to pause and to go on gains no time.
    next_tick_ = std::max(next_tick_, Clock::now()) - std::chrono::milliseconds(simulator_.tick_time());
    schedule_tick();
}

void StreamingServer::schedule_tick()
{
    next_tick_ += std::chrono::milliseconds(simulator_.tick_time());
    tick_timer_.expires_at(next_tick_);
    tick_timer_.async_wait([this, run = run_](error_code error) {
        if (!error)
            tick(run);
    });
}

void StreamingServer::tick(std::uint64_t run)
{
    if (run != run_)
        return;
    auto const period = std::chrono::milliseconds(simulator_.tick_time());
    auto const late = (Clock::now() - next_tick_) / period;
    int const ticks = static_cast<int>(std::min<long long>(1 + late, max_ticks_to_catch_up));
    int const steps = ticks * simulator_.steps_per_tick();
    // What cannot be caught up is lost: simulated time falls behind instead of racing later.
    next_tick_ = late < max_ticks_to_catch_up ? next_tick_ + late * period : Clock::now();
    simulator_.advance(simulator_.mode() == Mode::fast ? fast_factor * steps : steps);
    if (run == run_ && simulator_.is_running())
        schedule_tick();
}

// --- pictures

void StreamingServer::picture_changed()
{
    ++revision_;
    schedule_picture();
}

void StreamingServer::picture_resized()
{
    next_picture_ = Clock::now();
    picture_timer_.cancel(); // which schedules it again
    picture_changed();
}

/// Webots, by its source (R2020 to R2023), ends by a fault when it has a picture to send but no size.
void StreamingServer::open_pictures(std::weak_ptr<PictureOutlet> outlet)
{
    if (!simulator_.has_picture_size())
        crash("demo simulator: ends by a fault, as Webots would: GET /mjpeg came before any WebSocket has "
              "said \"mjpeg: <width>x<height>\"");
    std::erase_if(streams_, [](Stream const& stream) { return stream.outlet.expired(); });
    streams_.push_back({std::move(outlet), 0});
}

bool StreamingServer::wants_picture() const
{
    return simulator_.is_loaded() &&
           std::any_of(streams_.begin(), streams_.end(), [this](Stream const& stream) {
               auto const outlet = stream.outlet.lock();
               return outlet && outlet->is_ready() && stream.seen < revision_;
           });
}

void StreamingServer::schedule_picture()
{
    if (picture_scheduled_ || !wants_picture())
        return;
    picture_scheduled_ = true;
    picture_timer_.expires_at(std::max(next_picture_, Clock::now()));
    picture_timer_.async_wait([this](error_code error) {
        picture_scheduled_ = false;
        error ? schedule_picture() : send_picture();
    });
}

void StreamingServer::send_picture()
{
    if (!wants_picture())
        return;
    auto const begin = Clock::now();
    std::string bytes = part(simulator_.draw_picture());
    // A browser shows a part when the next one begins.
    if (!simulator_.is_running())
        bytes += bytes;
    auto const text = std::make_shared<std::string const>(std::move(bytes));
    std::erase_if(streams_, [](Stream const& stream) { return stream.outlet.expired(); });
    for (Stream& stream : streams_) {
        auto const outlet = stream.outlet.lock();
        if (!outlet || !outlet->is_ready() || stream.seen >= revision_)
            continue;
        stream.seen = revision_;
        outlet->send(text);
    }
    // Big pictures are drawn less often, so that drawing takes at most a third of a core.
    next_picture_ = begin + std::max<Clock::duration>(min_picture_time, 3 * (Clock::now() - begin));
}

} // namespace webots_cloud::demo
