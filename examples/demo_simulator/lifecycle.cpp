#include "lifecycle.hpp"

#include "console.hpp"
#include "process_faults.hpp"

#include <boost/asio/post.hpp>

#include <stdexcept>

namespace webots_cloud::demo {
namespace {

using boost::system::error_code;

constexpr std::chrono::milliseconds old_heartbeat{5000};

} // namespace

Lifecycle::Lifecycle(Options const& options)
    : options_(options), server_(context_, options), heartbeat_(context_)
{}

template<class Action>
void Lifecycle::after(std::chrono::milliseconds delay, Action action)
{
    timers_.emplace_back(context_, delay);
    timers_.back().async_wait([action](error_code error) {
        if (!error)
            action();
    });
}

void Lifecycle::run()
{
    server_.listen();
    print_line("demo simulator: listening on port " + std::to_string(server_.endpoint().port()));
    print_unusual_lines(options_.faults);
    if (options_.faults.flood)
        flood();
    if (!options_.faults.never_ready)
        after(options_.faults.ready_delay, [this] { get_ready(); });
    context_.run();
}

void Lifecycle::get_ready()
{
    Faults const& faults = options_.faults;
    if (faults.exit_before_ready)
        leave(faults, *faults.exit_before_ready);
    if (faults.crash_before_ready)
        crash();
    server_.load();
    announce_ready();
    server_.draw_ahead(); // while the browser hears the address
    schedule_heartbeat();
    schedule_end();
}

void Lifecycle::announce_ready()
{
    print_line(options_.old_protocol ? "open" : ".");
}

void Lifecycle::schedule_heartbeat()
{
    heartbeat_.expires_after(options_.old_protocol ? old_heartbeat : options_.heartbeat);
    heartbeat_.async_wait([this](error_code error) {
        if (error)
            return;
        // Up to R2021b a heartbeat told of simulation steps rather than of life.
        if (!options_.old_protocol || server_.is_running())
            print_line(".");
        print_unusual_lines(options_.faults);
        schedule_heartbeat();
    });
}

void Lifecycle::schedule_end()
{
    Faults const& faults = options_.faults;
    if (faults.crash_after_ready)
        after(*faults.crash_after_ready, [] { crash(); });
    if (faults.hang)
        after(*faults.hang, [] { hang(); });
    bool const nothing_else = !faults.crash_after_ready && !faults.hang;
    if (faults.exit_after_ready)
        after(*faults.exit_after_ready, [&faults] { leave(faults, 0); });
    else if (faults.no_final_newline && nothing_else)
        after(std::chrono::milliseconds(500), [&faults] { leave(faults, 0); });
}

void Lifecycle::flood()
{
    boost::asio::post(context_, [this] {
        print_flood();
        flood();
    });
}

} // namespace webots_cloud::demo
