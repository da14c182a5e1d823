#include "unit_test.hpp"

#include "app/signals.hpp"

#include <webots_cloud/testing/recording_log.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <atomic>
#include <chrono>
#include <csignal>
#include <exception>
#include <future>
#include <vector>

using namespace webots_cloud;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(signals)

namespace {

constexpr auto patience = std::chrono::seconds(30);

/// A configuration whose file is on a disk that does not answer until it is told to.
class SlowReload
{
public:
    SlowReload()
    {
        auto const apply = [](SessionConfig const&, SessionConfig const&) { return result<>(); };
        auto task = app::obey_sighup<SessionConfig>(
            context.get_executor(), [this] { return read(); }, running_, apply, log.logger());
        asio::co_spawn(
            context, std::move(task),
            asio::bind_cancellation_slot(stop.slot(), [this](std::exception_ptr failure, result<> const&) {
                BOOST_TEST(!failure);
                has_ended = true;
            }));
        context.poll();
        std::raise(SIGHUP);
        auto began = began_.get_future();
        do
            context.poll();
        while (began.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready);
    }

    /// Lets the event loop do all that it can do now.
    bool is_alive()
    {
        bool had_its_turn = false;
        asio::post(context, [&had_its_turn] { had_its_turn = true; });
        context.poll();
        return had_its_turn && !was_late_;
    }

    void answer() { answered_.set_value(); }

    asio::io_context context;
    asio::cancellation_signal stop;
    testing::RecordingLog log;
    bool has_ended = false;

private:
    result<Configured<SessionConfig>> read()
    {
        began_.set_value();
        was_late_ = answered_.get_future().wait_for(patience) != std::future_status::ready;
        return Failure(errc::invalid_config, "it says nothing");
    }

    SessionConfig running_;
    std::promise<void> began_;
    std::promise<void> answered_;
    std::atomic<bool> was_late_ = false;
};

} // namespace

BOOST_AUTO_TEST_CASE(nobody_waits_for_a_configuration_that_is_read_again)
{
    SlowReload reload;
    BOOST_TEST(reload.is_alive());
    BOOST_TEST(reload.log.lines.empty());
    reload.answer();
    while (reload.log.lines.empty())
        reload.context.run_one();
    BOOST_TEST(reload.log.lines.front().find("The configuration stays as it was: it says nothing") !=
               std::string::npos);
    reload.stop.emit(asio::cancellation_type::terminal);
    reload.context.run();
    BOOST_TEST(reload.has_ended);
}

BOOST_AUTO_TEST_CASE(a_server_ends_after_its_configuration_has_been_read)
{
    SlowReload reload;
    reload.stop.emit(asio::cancellation_type::terminal);
    BOOST_TEST(reload.is_alive());
    BOOST_TEST(!reload.has_ended); // what it reads may refer to what goes then
    reload.answer();
    reload.context.run();
    BOOST_TEST(reload.has_ended);
    BOOST_TEST(reload.log.lines.empty());
}

BOOST_AUTO_TEST_CASE(a_configuration_that_is_refused_halfway_is_taken_back)
{
    asio::io_context context;
    testing::RecordingLog log;
    SessionConfig running;
    running.polls.threshold = 50;
    std::vector<double> read{60, 70, 80};
    auto const reload = [&read]() -> result<Configured<SessionConfig>> {
        Configured<SessionConfig> configured;
        configured.config.polls.threshold = read.front();
        read.erase(read.begin());
        return configured;
    };
    std::vector<double> applied;
    auto const apply = [&applied](SessionConfig const& next, SessionConfig const&) -> result<> {
        applied.push_back(next.polls.threshold);
        return next.polls.threshold == 70 ? result<>(Failure(errc::invalid_config, "70 is refused"))
                                          : result<>();
    };
    asio::cancellation_signal stop;
    auto task = app::obey_sighup<SessionConfig>(context.get_executor(), reload, running, apply, log.logger());
    asio::co_spawn(context, std::move(task), asio::bind_cancellation_slot(stop.slot(), asio::detached));
    context.poll();
    for (std::size_t told = 1; told <= 3; ++told) {
        std::raise(SIGHUP);
        while (log.lines.size() < told)
            context.run_one();
    }
    BOOST_TEST(applied == (std::vector<double>{60, 70, 60, 80}), boost::test_tools::per_element());
    BOOST_TEST(log.lines[1].find("The configuration stays as it was: 70 is refused") != std::string::npos);
    stop.emit(asio::cancellation_type::terminal);
    context.run();
}

BOOST_AUTO_TEST_SUITE_END()
