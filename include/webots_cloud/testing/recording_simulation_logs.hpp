// Logs of simulations that stay in memory for the test to read.
#pragma once

#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/simulation_logs.hpp>

#include <map>
#include <string>
#include <vector>

namespace webots_cloud::testing {

/// Lifetime: `clock` must outlive it.
class RecordingSimulationLogs final : public SimulationLogs
{
public:
    explicit RecordingSimulationLogs(Clock& clock) : clock_(clock) {}

    std::unique_ptr<SimulationLog> open(std::uint64_t simulation) override
    {
        return std::make_unique<Recording>(*this, simulation);
    }

    boost::asio::awaitable<result<>> run() override
    {
        co_return co_await clock_.wait_until(TimePoint::max());
    }

    std::map<std::uint64_t, std::vector<std::string>> lines; ///< By simulation.
    int open_logs = 0;                                       ///< Should be 0 at the end of a test.

private:
    class Recording final : public SimulationLog
    {
    public:
        Recording(RecordingSimulationLogs& logs, std::uint64_t simulation)
            : logs_(logs), simulation_(simulation), name_(std::to_string(simulation) + ".log")
        {
            ++logs_.open_logs;
        }
        ~Recording() override { --logs_.open_logs; }

        std::string const& name() const noexcept override { return name_; }
        void write(std::string_view line) override { logs_.lines[simulation_].emplace_back(line); }

    private:
        RecordingSimulationLogs& logs_;
        std::uint64_t simulation_;
        std::string name_;
    };

    Clock& clock_;
};

} // namespace webots_cloud::testing
