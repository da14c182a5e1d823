// Connections of controllers on other machines: what each says first is read, the door asked where it leads,
// the simulator asked whether it takes the controller, and from then on a tunnel relays, as for browsers. All
// before the tunnel has deadlines; who says nothing makes room for others. Decisions:
// core/access/controller_greeting, core/access/silent_clients, core/access/client_limit.
#include "adapters/network/acceptor.hpp"
#include "adapters/network/network_stream.hpp"
#include "adapters/network/peer.hpp"
#include "async/cancellation.hpp"
#include "async/task_count.hpp"
#include "core/access/accept_failure.hpp"
#include "core/access/controller_greeting.hpp"
#include "core/access/silent_clients.hpp"
#include "core/text.hpp"
#include "tunnels.hpp"
#include "upstream_socket.hpp"

#include <webots_cloud/adapters/controller_server.hpp>

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>

#include <array>
#include <map>
#include <optional>

namespace webots_cloud {
namespace adapters {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using core::concat;

// How late the end of an idle tunnel may be noticed.
constexpr auto controller_sweep_interval = std::chrono::seconds(1);
constexpr auto controller_accept_pause = std::chrono::milliseconds(100);

/// What all connections share.
struct CallContext
{
    ControllerServerParams const& params;
    ControllerDoor& door;
    Logger const& log;
    Upstreams& upstreams;
    core::ClientLimit& simulations; ///< How many connections each has.
};

/// A connection that is not passed on yet.
class ControllerCall final : public TunnelGroup::Tunnel, public std::enable_shared_from_this<ControllerCall>
{
public:
    ControllerCall(tcp::socket socket, std::string client, CallContext const& context)
        : context_(context), client_(std::move(client)), stream_(std::move(socket), nullptr),
          upstream_(stream_.socket().get_executor(), context.upstreams),
          timer_(stream_.socket().get_executor())
    {}

    /// What is relayed from here on. Nothing: the controller was refused, or has gone.
    asio::awaitable<std::optional<TunnelPlan>> answer();

    void cut() noexcept
    {
        is_cut_ = true;
        stream_.close();
        upstream_.close();
    }

    /// Its simulation has ended.
    void end() override { cut(); }

private:
    asio::awaitable<result<core::ControllerGreeting>> hear_greeting();
    asio::awaitable<result<>> ask_simulator(ControllerWay const& way);
    asio::awaitable<result<>> exchange_greetings(ControllerWay const& way);
    result<ControllerWay> find_way(core::ControllerGreeting const& greeting);
    void refuse(Failure const& why);
    void say_last(std::string_view text);
    void set_deadline(TimePoint when, void (ControllerCall::*action)());
    void stop_reading();
    void stop_asking() { upstream_.close(); }

    CallContext const& context_;
    std::string client_; ///< Its address.
    NetworkStream stream_;
    UpstreamSocket upstream_;
    asio::steady_timer timer_;
    std::uint64_t deadlines_ = 0; ///< Set so far: only the last one counts.
    std::string heard_;
    std::string answer_; ///< Of the simulator.
    core::ClientLimit::Ticket ticket_;
    bool is_cut_ = false;
};

void ControllerCall::set_deadline(TimePoint when, void (ControllerCall::*action)())
{
    timer_.expires_at(when);
    timer_.async_wait(
        [weak = weak_from_this(), number = ++deadlines_, action](boost::system::error_code error) {
            auto const self = weak.lock();
            if (!error && self && self->deadlines_ == number)
                (*self.*action)();
        });
}

void ControllerCall::stop_reading()
{
    boost::system::error_code ignored;
    stream_.socket().cancel(ignored);
}

asio::awaitable<result<core::ControllerGreeting>> ControllerCall::hear_greeting()
{
    constexpr int patience_with_half = 10; // pauses: of what has begun, more is to be expected
    auto const& params = context_.params;
    auto const latest = std::chrono::steady_clock::now() + params.greeting_timeout;
    std::array<char, core::max_controller_greeting> piece; // NOLINT(*-member-init): filled by reads
    for (;;) {
        // No mark ends a greeting: one that could be whole is taken as such only when nothing follows for a
        // while, or the name of its robot might be cut short.
        auto const greeting = core::read_controller_greeting(heard_);
        if (!greeting)
            co_return greeting.error();
        auto const pause = *greeting ? params.greeting_pause : patience_with_half * params.greeting_pause;
        auto const now = std::chrono::steady_clock::now();
        set_deadline(heard_.empty() ? latest : std::min<TimePoint>(latest, now + pause),
                     &ControllerCall::stop_reading);
        auto const got = co_await stream_.read_some(asio::buffer(piece));
        if (is_cut_)
            co_return Failure(errc::closed);
        if (!got.first) {
            heard_.append(piece.data(), got.second);
            continue;
        }
        // The end of the pause, or of what the controller wants to say; otherwise nobody is left to be
        // answered.
        bool const has_gone = got.first != asio::error::operation_aborted && got.first != asio::error::eof;
        if (has_gone || heard_.empty())
            co_return Failure(errc::closed);
        if (*greeting)
            co_return **greeting;
        co_return core::unfinished_greeting(heard_);
    }
}

result<ControllerWay> ControllerCall::find_way(core::ControllerGreeting const& greeting)
{
    auto way = context_.door.way_of_controller(greeting.machine, greeting.key, greeting.robot);
    if (!way)
        return way;
    if (context_.simulations.admit(greeting.key, ticket_) != core::ClientLimit::Verdict::admitted)
        return Failure(errc::refused,
                       concat("This simulation has ", std::to_string(context_.params.per_simulation),
                              " controllers, as many as it may have: end one of them first."));
    if (way->group && !way->group->join(*this))
        return Failure(errc::refused, "This simulation has just ended.");
    return way;
}

asio::awaitable<result<>> ControllerCall::exchange_greetings(ControllerWay const& way)
{
    auto const& params = context_.params;
    set_deadline(std::chrono::steady_clock::now() + params.connect_timeout, &ControllerCall::stop_asking);
    auto const reached = co_await upstream_.connect(way.upstream);
    if (!reached)
        co_return reached;
    set_deadline(std::chrono::steady_clock::now() + params.answer_timeout, &ControllerCall::stop_asking);
    auto const greeting = core::greeting_for(way.asks_for);
    // The answer tells whether the simulator takes this controller, which gets it as it came.
    auto const failed = co_await upstream_.write(greeting);
    if (failed)
        co_return Failure(errc::unreachable, failed.message());
    std::array<char, 512> piece; // NOLINT(*-member-init): filled by reads
    while (core::read_controller_answer(answer_) == core::ControllerAnswer::incomplete) {
        auto const got = co_await upstream_.read_some(piece.data(), piece.size());
        if (got.first)
            co_return Failure(errc::unreachable, got.first.message());
        answer_.append(piece.data(), got.second);
    }
    co_return result<>();
}

/// What the simulator answers, into `answer_`.
asio::awaitable<result<>> ControllerCall::ask_simulator(ControllerWay const& way)
{
    auto const answered = co_await exchange_greetings(way);
    // A deadline that has passed already, and whose handler waits for its turn, must not cut the tunnel.
    ++deadlines_;
    timer_.cancel();
    if (way.group)
        way.group->leave(*this);
    co_return answered;
}

asio::awaitable<std::optional<TunnelPlan>> ControllerCall::answer()
{
    auto const greeting = co_await hear_greeting();
    // Nobody is there who could be told why.
    if (is_cut_ || (!greeting && greeting.error() == errc::closed))
        co_return std::nullopt;
    if (!greeting) {
        refuse(greeting.error());
        co_return std::nullopt;
    }
    auto const way = find_way(*greeting);
    if (!way) {
        refuse(way.error());
        co_return std::nullopt;
    }
    auto const answered = co_await ask_simulator(*way);
    if (is_cut_)
        co_return std::nullopt;
    if (!answered) {
        context_.log.warning(
            LogCause("controller", client_),
            concat("A controller does not reach its simulator: ", answered.error().message()));
        say_last(core::controller_failed("The simulator does not answer: try again in a moment."));
        co_return std::nullopt;
    }
    if (core::read_controller_answer(answer_) == core::ControllerAnswer::refused) {
        say_last(answer_); // each try of libController is a connection, and it closes none
        co_return std::nullopt;
    }
    context_.log.info(LogCause("controller", client_),
                      concat("A controller", core::of_client(client_), " drives ",
                             greeting->robot.empty() ? "a robot" : core::printable(greeting->robot, 100)));
    // From here on the tunnel owns both connections. The ticket goes along: the simulation's limit counts a
    // controller for as long as it is connected.
    std::optional<TunnelPlan> plan(std::in_place);
    plan->browser = stream_.release();
    plan->upstream = upstream_.release();
    plan->to_browser = std::move(answer_);
    plan->is_two_way = true;
    plan->group = way->group;
    plan->ticket = std::move(ticket_);
    co_return plan;
}

void ControllerCall::refuse(Failure const& why)
{
    context_.log.warning(LogCause("controller", client_),
                         concat("A controller", core::of_client(client_), " is refused: ", why.message()));
    say_last(core::controller_forbidden(why.message()));
}

void ControllerCall::say_last(std::string_view text)
{
    boost::system::error_code ignored;
    stream_.try_write(text, ignored);
    stream_.shut_down();
}

/// The port for controllers on other machines. Each connection is a call first, until it is known where it
/// leads, and then a tunnel.
class ControllerPort final : public ControllerServer
{
public:
    ControllerPort(asio::any_io_executor executor, ControllerServerParams params, ControllerDoor& door,
                   Logger log)
        : executor_(std::move(executor)), params_(std::move(params)), log_(std::move(log)),
          tunnels_(executor_, tunnel_params_, statistics_),
          upstreams_(executor_, tunnel_params_, statistics_, log_),
          simulations_(params_.per_simulation), context_{params_, door, log_, upstreams_, simulations_},
          acceptor_(executor_), sweeper_(executor_),
          silent_(params_.max_greeting, params_.greeting_per_address), tasks_(executor_)
    {
        tunnel_params_.write_timeout = params_.write_timeout;
        tunnel_params_.tunnel_idle_timeout = params_.idle_timeout;
    }

    result<> listen() override { return acceptor_.listen(params_.address, params_.port); }
    asio::awaitable<result<>> run() override;
    std::uint16_t port() const override { return acceptor_.port(); }

private:
    asio::awaitable<void> accept();
    void admit(tcp::socket socket);
    asio::awaitable<void> serve(std::uint64_t id, std::shared_ptr<ControllerCall> call);
    void sweep();

    asio::any_io_executor executor_;
    ControllerServerParams params_;
    Logger log_;
    HttpServerParams tunnel_params_;
    HttpServerStatistics statistics_;
    Tunnels tunnels_;
    Upstreams upstreams_;
    core::ClientLimit simulations_;
    CallContext context_;
    Acceptor acceptor_;
    asio::steady_timer sweeper_;
    core::SilentClients silent_;
    std::map<std::uint64_t, std::shared_ptr<ControllerCall>> calls_; ///< By a number that only grows.
    std::uint64_t last_id_ = 0;
    async::TaskCount tasks_;
};

asio::awaitable<result<>> ControllerPort::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    sweep();
    co_await accept();
    co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
    acceptor_.close();
    sweeper_.cancel();
    // Calls first: until the last of them has ended, each may still open a tunnel.
    for (auto const& [id, call] : calls_)
        call->cut();
    co_await tasks_.join();
    tunnels_.cut_all();
    co_await tunnels_.join();
    co_return Failure(asio::error::operation_aborted);
}

/// Ends when cancelled.
asio::awaitable<void> ControllerPort::accept()
{
    for (;;) {
        auto [error] = co_await acceptor_.wait();
        tcp::socket socket(executor_);
        if (!error)
            error = acceptor_.take(socket);
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled || error == asio::error::operation_aborted)
            co_return;
        if (!error) {
            admit(std::move(socket));
        } else if (error != asio::error::would_block && error != asio::error::connection_aborted) {
            log_.error(LogCause("controller"),
                       core::describe_accept_failure("a controller's connection", error.value()));
            acceptor_.turn_away();
            asio::steady_timer timer(executor_, controller_accept_pause); // nothing can be freed at once
            (void)co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
        }
    }
}

void ControllerPort::admit(tcp::socket socket)
{
    boost::system::error_code gone;
    auto const from = socket.remote_endpoint(gone).address();
    if (gone)
        return;
    Peer const peer(from, core::IpNetworks());
    if (calls_.size() + tunnels_.open_ended() >= params_.max_connections) {
        log_.warning(LogCause("controller", peer.address),
                     concat("More than ", std::to_string(params_.max_connections),
                            " connections of controllers are refused"));
        return;
    }
    boost::system::error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored); // each step of a simulation waits for an answer
    auto const id = ++last_id_;
    // Whoever connects and says nothing gives way to the next one.
    if (auto const oldest = silent_.enter(id, peer.quota_key))
        if (auto const found = calls_.find(*oldest); found != calls_.end())
            found->second->cut();
    auto call = std::make_shared<ControllerCall>(std::move(socket), peer.address, context_);
    calls_.emplace(id, call);
    tasks_.spawn(serve(id, std::move(call)));
}

asio::awaitable<void> ControllerPort::serve(std::uint64_t id, std::shared_ptr<ControllerCall> call)
{
    auto plan = co_await call->answer();
    (void)silent_.leave(id);
    calls_.erase(id);
    if (plan)
        tunnels_.open(std::move(*plan));
}

void ControllerPort::sweep()
{
    tunnels_.check(std::chrono::steady_clock::now());
    acceptor_.renew_watches();
    sweeper_.expires_after(controller_sweep_interval);
    sweeper_.async_wait([this](boost::system::error_code error) {
        if (!error)
            sweep();
    });
}

} // namespace
} // namespace adapters

std::unique_ptr<ControllerServer> make_controller_server(boost::asio::any_io_executor executor,
                                                         ControllerServerParams params, ControllerDoor& door,
                                                         Logger log)
{
    return std::make_unique<adapters::ControllerPort>(std::move(executor), std::move(params), door,
                                                      std::move(log));
}

} // namespace webots_cloud
