// Decisions: core/sandbox/limits.
#include "simulation_usage.hpp"

#include "core/sandbox/limits.hpp"

#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

bool SimulationUsage::is_running() const noexcept
{
    return simulation_ && life_.state() != core::SimulationLife::State::exited;
}

void SimulationUsage::begin(TimePoint now, std::filesystem::path folder)
{
    measured_ = now;
    folder_ = std::move(folder);
}

asio::awaitable<void> SimulationUsage::look_at_processes()
{
    if (!is_running())
        co_return;
    auto const used = co_await simulation_->usage(); // the simulation may have ended meanwhile
    if (!is_running())
        co_return;
    if (used.counted && *used.counted <= measured_)
        co_return; // we know that already
    // Jobs are counted on their node: what is used belongs to that moment, not to when we ask.
    auto const now = used.counted.value_or(context_.clock.now());
    cpu_ = core::process_cpu_percent(used_.processor, used.processor, now - measured_);
    graphics_ = core::process_cpu_percent(used_.graphics, used.graphics, now - measured_) / 100;
    used_ = used;
    measured_ = now;
}

void SimulationUsage::keep_process_limits()
{
    if (!is_running())
        return;
    core::Consumption used;
    used.memory = used_.own_memory_bytes;
    used.processes = used_.processes;
    used.memory_kills = used_.memory_kills;
    used.refused_forks = used_.refused_forks;
    if (auto const limit = core::overrun(context_.launcher.facts().limits, used))
        simulation_->terminate_at(*limit);
}

asio::awaitable<void> SimulationUsage::look_at_folder(FolderMeter& meter)
{
    auto const& limits = context_.launcher.facts().limits;
    if (!is_running() || context_.clock.now() < folder_due_)
        co_return;
    auto const began = context_.clock.now();
    auto directory = folder_;
    auto use = co_await meter.measure(std::move(directory), limits.disk);
    if (!simulation_)
        co_return;
    // Containers write into layers and volumes of Docker's, which are on no path below the folder.
    auto const elsewhere = co_await simulation_->written_elsewhere();
    auto const now = context_.clock.now();
    // A tenth of the time of one thread; more only while there is little room for others.
    bool const is_urgent = use.free_bytes < 2 * limits.disk;
    folder_due_ = is_urgent ? now : began + 10 * (now - began);
    if (!is_running()) // it may have ended meanwhile
        co_return;
    core::Consumption used;
    used.disk = use.bytes + elsewhere.files;
    used.images = elsewhere.images;
    used.too_many_files = use.too_many_files;
    if (auto const limit = core::overrun(limits, used))
        simulation_->terminate_at(*limit);
}

void SimulationUsage::describe(core::SimulationRow& row) const
{
    row.cpu = cpu_;
    row.more = !used_.complete;
    if (!cpu_)
        return;
    row.memory = static_cast<double>(used_.memory_bytes) / 1e6;
    row.processes = used_.processes;
    row.graphics = 100 * graphics_;
}

} // namespace webots_cloud
