// Fetches worlds with the git source and prints the results, a line of JSON per world, for the tests of the
// git source and its benchmark.
//
//     git_source_probe --cache FOLDER --forge URL --into FOLDER [options] WORLD_URL...
//
//     --fastest             in the fastest way that the folder allows; else by copying
//     --bytes N, --files N, --timeout MS, --cache-bytes N, --low-speed BYTES MS, --patience MS
//     --memory N, --disk N  limits for all fetches together, in bytes
//     --together            all worlds at once instead of one after the other
//     --discard             remove each project again
//     --cancel-after MS     cancel everything then
//     --cancel-at BYTES     cancel everything when a fetch has received so much
//     --idle MS             do nothing for so long: measures the delays that the machine alone causes
#include "adapters/threads/low_latency_scheduling.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/project_ref.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <time.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace webots_cloud;
namespace asio = boost::asio;
using SteadyClock = std::chrono::steady_clock;

struct Options
{
    GitSourceConfig source;
    GitFolders folders;
    std::shared_ptr<FetchBudget> budget;
    FetchLimits limits;
    std::vector<ForgeAddress> forges;
    std::filesystem::path into;
    std::vector<std::string> worlds;
    bool together = false;
    bool discard = false;
    int cancel_after = -1;
    std::uint64_t cancel_at = 0; ///< 0: never.
    int idle = 0;
};

Options parse(int argc, char** argv)
{
    Options options;
    bool fastest = false;
    std::uint64_t memory = std::uint64_t{1} << 30;
    std::uint64_t disk = std::uint64_t{8} << 30;
    for (int i = 1; i < argc; ++i) {
        std::string const word = argv[i];
        auto const next = [&] { return std::string(argv[++i]); };
        if (word == "--cache")
            options.folders.cache = next();
        else if (word == "--fastest")
            fastest = true;
        else if (word == "--cache-bytes")
            options.source.cache_bytes = std::stoull(next());
        else if (word == "--low-speed") {
            options.source.low_speed.bytes = std::stoull(next());
            options.source.low_speed.time = std::chrono::milliseconds(std::stol(next()));
        } else if (word == "--patience")
            options.source.patience = std::chrono::milliseconds(std::stol(next()));
        else if (word == "--memory")
            memory = std::stoull(next());
        else if (word == "--disk")
            disk = std::stoull(next());
        else if (word == "--forge")
            options.forges.push_back(next());
        else if (word == "--into")
            options.into = next();
        else if (word == "--bytes")
            options.limits.bytes = std::stoull(next());
        else if (word == "--files")
            options.limits.files = static_cast<std::uint32_t>(std::stoul(next()));
        else if (word == "--timeout")
            options.limits.timeout = std::chrono::milliseconds(std::stol(next()));
        else if (word == "--together")
            options.together = true;
        else if (word == "--discard")
            options.discard = true;
        else if (word == "--idle")
            options.idle = std::stoi(next());
        else if (word == "--cancel-after")
            options.cancel_after = std::stoi(next());
        else if (word == "--cancel-at")
            options.cancel_at = std::stoull(next());
        else
            options.worlds.push_back(word);
    }
    if (fastest)
        options.folders.instances = options.into;
    options.budget = make_fetch_budget(memory, disk);
    return options;
}

std::string quoted(std::string const& text)
{
    constexpr char digits[] = "0123456789abcdef";
    std::string json = "\"";
    for (char const c : text) {
        auto const byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || c == '"' || c == '\\') {
            json += "\\u00";
            json += digits[byte >> 4];
            json += digits[byte & 15];
        } else {
            json += c;
        }
    }
    return json += '"';
}

double milliseconds(SteadyClock::duration time)
{
    return std::chrono::duration<double, std::milli>(time).count();
}

/// Of this thread.
SteadyClock::duration processor_time()
{
    timespec time;
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

/// What somebody sees of a fetch who looks at it every millisecond.
struct Shown
{
    explicit Shown(std::shared_ptr<FetchProgress const> of) : progress(std::move(of)) {}

    void look()
    {
        auto const total = progress->objects_total.load();
        auto const now =
            total == 0 ? -1 : static_cast<int>(std::uint64_t{100} * progress->objects_received / total);
        fell_back += now < percent;
        percent = now;
    }

    std::shared_ptr<FetchProgress const> progress;
    int percent = -1;
    int fell_back = 0; ///< How often the progress went back.
};

class Probe
{
public:
    Probe(asio::io_context& context, Options options)
        : options_(std::move(options)), pulse_(context),
          source_(make_git_source(context.get_executor(), options_.source, HttpClientConfig(),
                                  options_.folders, log(), options_.budget))
    {}

    asio::awaitable<void> one(std::size_t number)
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        auto const project = parse_world_url(options_.worlds[number], options_.forges);
        if (!project) {
            print(number, {}, project.error(), FetchProgress(), 0);
            co_return;
        }
        FetchOrder order;
        order.project = *project;
        order.directory = options_.into / make_token();
        order.limits = options_.limits;
        auto const directory = order.directory;
        auto const progress = order.progress;
        auto& shown = shown_.emplace_back(progress);
        auto const start = SteadyClock::now();
        auto const fetched = co_await source_->fetch(std::move(order));
        print(number, milliseconds(SteadyClock::now() - start), fetched, *progress, shown.fell_back);
        if (options_.discard) {
            co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
            auto const removed = co_await source_->discard(directory);
            if (!removed)
                std::cout << "{\"discard\": " << quoted(removed.error().message()) << "}\n";
        }
    }

    asio::awaitable<void> all_in_turn()
    {
        for (std::size_t i = 0; i < options_.worlds.size(); ++i)
            co_await one(i);
        asio::steady_timer timer(co_await asio::this_coro::executor,
                                 std::chrono::milliseconds(options_.idle));
        co_await timer.async_wait(asio::use_awaitable);
    }

    /// Measures how long the event loop is blocked, and how much of that time it uses the processor.
    void beat(SteadyClock::time_point expected)
    {
        max_pause_length_ = std::max(max_pause_length_, SteadyClock::now() - expected);
        auto const worked = processor_time();
        longest_work_ = std::max(longest_work_, worked - std::exchange(worked_, worked));
        for (auto& each : shown_) {
            each.look();
            if (options_.cancel_at > 0 && each.progress->bytes_received >= options_.cancel_at)
                cancel();
        }
        if (running == 0)
            return;
        auto const due = SteadyClock::now() + std::chrono::milliseconds(1);
        pulse_.expires_at(due);
        pulse_.async_wait([this, due](boost::system::error_code) { beat(due); });
    }

    double max_pause() const { return milliseconds(max_pause_length_); }
    double longest_work() const { return milliseconds(longest_work_); }

    int running = 0;
    std::function<void()> cancel; ///< All of it; safe more than once.

private:
    static Logger log()
    {
        return Logger([](LogLevel, std::string_view line) { std::cerr << line << '\n'; });
    }

    void print(std::size_t number, double time, result<FetchedProject> const& fetched,
               FetchProgress const& progress, int fell_back)
    {
        std::cout << "{\"world\": " << number << ", \"ms\": " << time;
        if (fetched) {
            std::cout << ", \"root\": " << quoted(fetched->root.string())
                      << ", \"revision\": " << quoted(fetched->revision)
                      << ", \"header\": " << quoted(fetched->world_header) << ", \"forbidden\": [";
            for (auto const& path : fetched->forbidden)
                std::cout << (&path == fetched->forbidden.data() ? "" : ", ") << quoted(path);
            std::cout << "]";
        } else
            std::cout << ", \"error\": " << quoted(fetched.error().message())
                      << ", \"code\": " << quoted(fetched.error().code().message());
        std::cout << ", \"objects\": " << progress.objects_received
                  << ", \"objects_total\": " << progress.objects_total << ", \"fell_back\": " << fell_back
                  << ", \"bytes\": " << progress.bytes_received
                  << ", \"large_bytes\": " << progress.large_bytes_received
                  << ", \"large_bytes_total\": " << progress.large_bytes_total << "}" << std::endl;
    }

    Options options_;
    asio::steady_timer pulse_;
    std::deque<Shown> shown_;
    SteadyClock::duration max_pause_length_{};
    SteadyClock::duration longest_work_{};
    std::unique_ptr<ProjectSource> source_;
    SteadyClock::duration worked_ = processor_time(); ///< Until now; making the source does not count.
};

} // namespace

int main(int argc, char** argv)
{
    auto const options = parse(argc, argv);
    adapters::use_low_latency_scheduling(); // as the servers
    asio::io_context context(1);
    Probe probe(context, options);
    std::deque<asio::cancellation_signal> signals;
    auto const done = [&probe](std::exception_ptr failed) {
        --probe.running;
        if (failed)
            std::rethrow_exception(failed);
    };
    auto const spawn = [&](asio::awaitable<void> work) {
        ++probe.running;
        asio::co_spawn(context, std::move(work),
                       asio::bind_cancellation_slot(signals.emplace_back().slot(), done));
    };
    if (options.together) {
        for (std::size_t i = 0; i < options.worlds.size(); ++i)
            spawn(probe.one(i));
    } else {
        spawn(probe.all_in_turn());
    }
    probe.cancel = [&signals] {
        for (auto& signal : signals)
            signal.emit(asio::cancellation_type::terminal);
    };
    asio::steady_timer timer(context);
    if (options.cancel_after >= 0) {
        timer.expires_after(std::chrono::milliseconds(options.cancel_after));
        timer.async_wait([&](boost::system::error_code) { probe.cancel(); });
    }
    probe.beat(SteadyClock::now());
    context.run();
    std::cout << "{\"longest_pause_ms\": " << probe.max_pause()
              << ", \"longest_work_ms\": " << probe.longest_work() << "}\n";
}
