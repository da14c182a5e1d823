#include "start_figures.hpp"

namespace webots_cloud::core {
namespace {

std::string_view name_of(StartStage stage)
{
    switch (stage) {
    case StartStage::fetch:
        return "fetch";
    case StartStage::launch:
        return "launch";
    case StartStage::ready:
        return "ready";
    }
    return {};
}

} // namespace

std::string_view start_failure_label(Failure const& failure) noexcept
{
    for (auto const& [code, label] : {std::pair<errc, std::string_view>{errc::invalid_url, "invalid_url"},
                                      {errc::invalid_argument, "invalid_mode"},
                                      {errc::refused, "refused"},
                                      {errc::unavailable, "full"},
                                      {errc::not_found, "not_found"},
                                      {errc::unreachable, "unreachable"},
                                      {errc::timed_out, "timed_out"},
                                      {errc::too_large, "too_large"},
                                      {errc::start_failed, "start_failed"}})
        if (failure == code)
            return label;
    return "other";
}

void StartFigures::passed(StartStage stage, Duration took)
{
    stages_[static_cast<std::size_t>(stage)].add(std::chrono::duration<double>(took).count());
}

std::uint64_t StartFigures::lost() const noexcept
{
    std::uint64_t sum = abandoned_;
    for (auto const& [reason, count] : failed_)
        sum += count;
    return sum;
}

void StartFigures::write(MetricsText& text) const
{
    auto const& ready = stages_[static_cast<std::size_t>(StartStage::ready)];
    text.family("starts_total", "counter", "Simulations that browsers asked for, by how that ended.")
        .add(static_cast<double>(ready.count()), {{"result", "ready"}, {"reason", ""}})
        .add(static_cast<double>(abandoned_), {{"result", "abandoned"}, {"reason", ""}});
    for (auto const& [reason, count] : failed_)
        text.add(static_cast<double>(count), {{"result", "failed"}, {"reason", reason}});
    text.family("start_stage_seconds", "histogram",
                "How long the stages of starts took that were completed.");
    for (auto const stage : {StartStage::fetch, StartStage::launch, StartStage::ready})
        text.add(stages_[static_cast<std::size_t>(stage)], {{"stage", name_of(stage)}});
}

void FetchFigures::write(MetricsText& text) const
{
    text.family("prefetches_total", "counter",
                "Projects that were to be fetched for later starts, by how that ended.")
        .add(static_cast<double>(fetched_), {{"result", "fetched"}, {"reason", ""}})
        .add(static_cast<double>(abandoned_), {{"result", "abandoned"}, {"reason", ""}});
    for (auto const& [reason, count] : failed_)
        text.add(static_cast<double>(count), {{"result", "failed"}, {"reason", reason}});
}

} // namespace webots_cloud::core
