// A fake ProcessHost: its processes print, listen and end as a script says, at moments of the test's own
// clock. Nothing is started.
#include <webots_cloud/testing/scripted_processes.hpp>

#include "async/wakeup.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/this_coro.hpp>

#include <charconv>
#include <csignal>
#include <optional>

namespace webots_cloud::testing {

namespace asio = boost::asio;

ScriptedProcesses::Script& ScriptedProcesses::Script::after(Duration delay)
{
    delay_ += delay;
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::prints(std::string bytes)
{
    steps_.push_back({delay_, ProcessOutput(std::move(bytes))});
    delay_ = Duration::zero();
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::exits(int code)
{
    steps_.push_back({delay_, ExitStatus(code, false)});
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::crashes(int signal)
{
    steps_.push_back({delay_, ExitStatus(signal, true)});
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::stubborn()
{
    stubborn_ = true;
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::listens(std::vector<std::uint16_t> ports)
{
    has_ports_ = true;
    ports_ = std::move(ports);
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::is_reached()
{
    is_reported_ = true;
    steps_.push_back({delay_, ProcessListens()});
    delay_ = Duration::zero();
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::is_never_reached()
{
    is_reported_ = true;
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::consumes(double cpu_percent, std::uint64_t memory_bytes)
{
    cpu_percent_ = cpu_percent;
    memory_bytes_ = memory_bytes;
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::renders(double graphics_percent)
{
    graphics_percent_ = graphics_percent;
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::starts(std::uint64_t processes)
{
    processes_ = processes;
    return *this;
}

ScriptedProcesses::Script& ScriptedProcesses::Script::loses_a_process_for_memory()
{
    ++memory_kills_;
    return *this;
}

class ScriptedProcess final : public Process
{
public:
    ScriptedProcess(ScriptedProcesses& host, ScriptedProcesses::Script script, ProcessSpec const& spec,
                    asio::any_io_executor const& executor, int id)
        : host_(host), script_(std::move(script)), grace_(spec.grace), id_(id), started_(host.clock_.now()),
          due_(started_), asked_(executor)
    {
        if (!script_.has_ports_)
            script_.ports_ = ports_of(spec);
    }

    ~ScriptedProcess() override
    {
        if (!status_)
            --host_.alive_;
    }

    int id() const noexcept override { return id_; }
    Listening listening() const noexcept override
    {
        if (!script_.is_reported_)
            return Listening::unknown;
        return is_reached_ ? Listening::yes : Listening::no;
    }
    asio::awaitable<std::uint16_t> listening_port(std::uint16_t first, std::uint16_t last) override
    {
        host_.looks_.push_back(host_.clock_.now());
        std::uint16_t lowest = 0;
        for (auto const port : script_.ports_)
            if (port >= first && port <= last && (lowest == 0 || port < lowest))
                lowest = port;
        co_return lowest;
    }

    asio::awaitable<ProcessUsage> usage() override
    {
        ProcessUsage refused;
        refused.memory_kills = script_.memory_kills_;
        if (status_)
            co_return refused;
        auto const busy =
            std::chrono::duration<double>(host_.clock_.now() - started_) * (script_.cpu_percent_ / 100);
        ProcessUsage usage(std::chrono::duration_cast<Duration>(busy), script_.memory_bytes_);
        usage.own_memory_bytes = script_.memory_bytes_;
        usage.graphics = std::chrono::duration_cast<Duration>((host_.clock_.now() - started_) *
                                                              (script_.graphics_percent_ / 100));
        usage.processes = script_.processes_;
        usage.memory_kills = script_.memory_kills_;
        co_return usage;
    }

    void terminate() noexcept override
    {
        if (end_)
            return;
        end_ = host_.clock_.now() + (script_.stubborn_ ? grace_ : Duration::zero());
        asked_.notify();
    }

    asio::awaitable<result<ProcessEvent>> next_event() override
    {
        using namespace asio::experimental::awaitable_operators;
        co_await asio::this_coro::throw_if_cancelled(false);
        while (!status_) {
            auto const scripted =
                script_.steps_.empty() ? TimePoint::max() : due_ + script_.steps_.front().delay;
            auto const killed = end_.value_or(TimePoint::max());
            auto const next = std::min(scripted, killed);
            if (host_.clock_.now() < next) {
                auto const woken = co_await wait(next);
                if (!woken)
                    co_return woken.error();
                continue;
            }
            if (killed <= scripted) {
                ended(ExitStatus(script_.stubborn_ ? SIGKILL : SIGTERM, true));
                break;
            }
            auto const event = script_.steps_.front().event;
            due_ = scripted;
            script_.steps_.pop_front();
            is_reached_ = is_reached_ || std::holds_alternative<ProcessListens>(event);
            if (auto const* status = std::get_if<ExitStatus>(&event))
                ended(*status);
            else
                co_return event;
        }
        co_return ProcessEvent(*status_);
    }

private:
    static std::vector<std::uint16_t> ports_of(ProcessSpec const& spec)
    {
        constexpr std::string_view port_option = "--port=";
        constexpr std::string_view old_option = "--stream=\"port=";
        for (std::string_view const argument : spec.argv)
            for (auto const option : {port_option, old_option}) {
                std::uint16_t port = 0;
                if (!argument.starts_with(option))
                    continue;
                std::from_chars(argument.data() + option.size(), argument.data() + argument.size(), port);
                return {port};
            }
        return {};
    }

    /// Waits until `when`, or until the process is asked to end.
    asio::awaitable<result<>> wait(TimePoint when)
    {
        using namespace asio::experimental::awaitable_operators;
        if (when == TimePoint::max())
            co_return co_await asked_.wait();
        auto const woken = co_await (host_.clock_.wait_until(when) || asked_.wait());
        co_return woken.index() == 0 ? std::get<0>(woken) : std::get<1>(woken);
    }

    void ended(ExitStatus status)
    {
        status_ = status;
        --host_.alive_;
    }

    ScriptedProcesses& host_;
    ScriptedProcesses::Script script_;
    Duration grace_;
    int id_;
    TimePoint started_;
    TimePoint due_;
    async::Wakeup asked_;
    std::optional<TimePoint> end_;
    std::optional<ExitStatus> status_;
    bool is_reached_ = false;
};

class ScriptedHold final : public PortHold
{
public:
    ScriptedHold(ScriptedProcesses& host, std::uint16_t port) : host_(host), port_(port)
    {
        host_.held_.insert(port);
    }
    ~ScriptedHold() override { host_.held_.erase(port_); }

private:
    ScriptedProcesses& host_;
    std::uint16_t port_;
};

asio::awaitable<result<std::unique_ptr<Process>>> ScriptedProcesses::start(ProcessSpec spec)
{
    if (auto failure = fuse.strike())
        co_return std::move(*failure);
    if (scripts_.empty())
        co_return Failure(errc::start_failed, spec.argv.front() + " is not in the script");
    auto script = std::move(scripts_.front());
    scripts_.pop_front();
    started_.push_back(spec);
    ++alive_;
    auto const executor = co_await asio::this_coro::executor;
    co_return std::make_unique<ScriptedProcess>(*this, std::move(script), spec, executor,
                                                1000 + static_cast<int>(started_.size()));
}

result<std::unique_ptr<PortHold>> ScriptedProcesses::hold_port(std::uint16_t port)
{
    if (auto failure = fuse.strike())
        return std::move(*failure);
    if (taken.contains(port) || held_.contains(port))
        return Failure(errc::unavailable, "the port is taken");
    return std::make_unique<ScriptedHold>(*this, port);
}

} // namespace webots_cloud::testing
