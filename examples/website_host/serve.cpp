#include "serve.hpp"

#include "website.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>

#include <sys/prctl.h>

#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <utility>

namespace website_host {
namespace {

namespace asio = boost::asio;
using webots_cloud::result;

asio::awaitable<result<>> listen_and_run(asio::any_io_executor executor,
                                         webots_cloud::HttpServerParams params, Website& website,
                                         webots_cloud::Logger log)
{
    auto const server = webots_cloud::make_http_server(executor, params, log);
    if (auto const listening = server->listen(); !listening)
        co_return listening.error();
    std::cout << "listening on port " << server->port() << std::endl;
    auto const ended = co_await server->run(website);
    co_return ended;
}

result<> serve_until_signal(webots_cloud::HttpServerParams const& params, Website& website,
                            webots_cloud::Logger const& log)
{
    ::prctl(PR_SET_DUMPABLE, 0);   // simulations of the same user must not trace it
    std::signal(SIGPIPE, SIG_IGN); // a browser that leaves
    asio::io_context context(1);
    asio::cancellation_signal stop;
    asio::signal_set signals(context, SIGINT, SIGTERM);
    signals.async_wait([&](boost::system::error_code cancelled, int) {
        if (!cancelled)
            stop.emit(asio::cancellation_type::terminal);
    });
    result<> outcome;
    auto const ended = [&](std::exception_ptr failure, result<> const& served) {
        signals.cancel();
        if (failure)
            std::rethrow_exception(failure);
        outcome = served;
    };
    asio::co_spawn(context, listen_and_run(context.get_executor(), params, website, log),
                   asio::bind_cancellation_slot(stop.slot(), ended));
    context.run();
    if (outcome.has_error() && outcome.error().code() == asio::error::operation_aborted)
        return {}; // by a signal
    return outcome;
}

} // namespace

result<> serve(Configuration configuration, Page page, std::string key)
{
    std::error_code failed;
    std::filesystem::create_directories(configuration.users_folder, failed);
    webots_cloud::OwnFiles files; // all else is in memory by now
    files.write.push_back(std::filesystem::absolute(configuration.users_folder));
    if (auto const confined = webots_cloud::confine_to_files(files); !confined)
        std::cout << "This server is not confined to its files: " << confined.error().message() << '.'
                  << std::endl;
    auto const log = webots_cloud::make_logger(webots_cloud::LogParams()); // on standard output
    if (!log)
        return log.error();
    webots_cloud::HttpServerParams params;
    params.network.listen_address = configuration.address;
    params.port = configuration.port;
    asio::thread_pool disk(1);
    Website website(std::move(configuration), std::move(page), std::move(key), disk, *log);
    auto const served = serve_until_signal(params, website, *log);
    disk.join();
    return served;
}

} // namespace website_host
