// Websites whose answers do not end, with limits that are shorter than a server's. Everything else is tested
// in tests/integration/website_test.py, with a real website.
#include "adapters/network/network_fixture.hpp"
#include "scratch_folder.hpp"

#include <boost/asio/read_until.hpp>

#include <filesystem>
#include <fstream>
#include <optional>

using namespace webots_cloud;
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

/// Accepts one request and sends the beginning of an archive; then more of it until the client leaves, or
/// nothing.
class EndlessWebsite
{
public:
    explicit EndlessWebsite(bool sends) : acceptor_(context_, {asio::ip::address_v4::loopback(), 0})
    {
        thread_ = std::thread([this, sends] { serve(sends); });
    }

    ~EndlessWebsite()
    {
        boost::system::error_code ignored; // ends the wait if there was no request
        asio::ip::tcp::socket(context_).connect(acceptor_.local_endpoint(), ignored);
        thread_.join();
    }

    std::string origin() const
    {
        return "http://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port());
    }

private:
    void serve(bool sends)
    {
        boost::system::error_code failed;
        asio::ip::tcp::socket socket(context_);
        acceptor_.accept(socket, failed);
        std::string request;
        asio::read_until(socket, asio::dynamic_buffer(request), "\r\n\r\n", failed);
        asio::write(socket, asio::buffer(std::string("HTTP/1.1 200 OK\r\nConnection: close\r\n\r\nPK\3\4")),
                    failed);
        std::string rest(4096, 'x');
        while (!failed && sends)
            asio::write(socket, asio::buffer(rest), failed);
        while (!failed)
            socket.read_some(asio::buffer(rest), failed);
    }

    asio::io_context context_;
    asio::ip::tcp::acceptor acceptor_;
    std::thread thread_;
};

struct WebsiteSourceFixture : ScratchFolder
{
    WebsiteSourceFixture()
    {
        fs::create_directories(folder / "projects" / "robots" / "worlds");
        std::ofstream(folder / "projects" / "robots" / "worlds" / "a.wbt") << "#VRML_SIM R2021b utf8\n";
        fs::create_directory(folder / "keys");
        std::ofstream(folder / "keys" / "127.0.0.1") << "secret\n";
        config.projects = folder / "projects";
        config.keys = folder / "keys";
        order.website.emplace();
        order.website->project = "robots";
        order.website->world = "a.wbt";
        order.website->user1_id = "42";
        order.directory = folder / "instance";
    }

    Failure failure_of(EndlessWebsite const& website)
    {
        order.website->origin = website.origin();
        auto const source = make_website_source(config, HttpClientConfig(), Logger());
        std::optional<result<FetchedProject>> fetched;
        asio::co_spawn(context, source->fetch(order),
                       [&](std::exception_ptr failed, result<FetchedProject> outcome) {
                           BOOST_TEST(!failed);
                           fetched = std::move(outcome);
                       });
        context.run();
        BOOST_TEST_REQUIRE(fetched->has_error());
        return fetched->error();
    }

    asio::io_context context{1};
    WebsiteSourceConfig config;
    FetchOrder order;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(website_source, WebsiteSourceFixture)

BOOST_AUTO_TEST_CASE(an_answer_without_end_is_cut_at_the_limit)
{
    order.limits.bytes = 1'000'000;
    BOOST_TEST((failure_of(EndlessWebsite(true)) == errc::too_large));
    BOOST_TEST(order.progress->bytes_received <= 1'000'000u);
}

BOOST_AUTO_TEST_CASE(a_website_that_falls_silent_is_given_up_at_the_deadline)
{
    order.limits.timeout = std::chrono::milliseconds(200);
    auto const failure = failure_of(EndlessWebsite(false));
    BOOST_TEST((failure == errc::timed_out));
    BOOST_TEST(failure.message().starts_with("Failed to download project from 127.0.0.1"));
}

BOOST_AUTO_TEST_CASE(a_silent_website_holds_up_nobody_who_wants_something_else)
{
    EndlessWebsite const website(false);
    order.website->origin = website.origin();
    order.limits.timeout = std::chrono::seconds(1);
    auto visitor = order;
    visitor.website->user1_id.clear();
    auto const source = make_website_source(config, HttpClientConfig(), Logger());
    std::vector<bool> arrived;
    auto const keep = [&](std::exception_ptr, result<FetchedProject> outcome) {
        arrived.push_back(outcome.has_value());
    };
    for (int user = 0; user < 10; ++user) {
        order.directory = folder / std::to_string(user);
        asio::co_spawn(context, source->fetch(order), keep);
    }
    asio::co_spawn(context, source->fetch(visitor), keep);
    context.run();
    BOOST_TEST_REQUIRE(arrived.size() == 11u);
    BOOST_TEST(arrived.front());
}

BOOST_AUTO_TEST_SUITE_END()
