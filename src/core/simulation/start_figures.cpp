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

constexpr std::pair<errc, std::string_view> failure_labels[] = {
    {errc::invalid_url, "invalid_url"},  {errc::invalid_argument, "invalid_mode"},
    {errc::refused, "refused"},          {errc::unavailable, "full"},
    {errc::not_found, "not_found"},      {errc::unreachable, "unreachable"},
    {errc::timed_out, "timed_out"},      {errc::too_large, "too_large"},
    {errc::start_failed, "start_failed"}};
constexpr std::string_view other_failure = "other";

} // namespace

std::string_view start_failure_label(Failure const& failure) noexcept
{
    for (auto const& [code, label] : failure_labels)
        if (failure == code)
            return label;
    return other_failure;
}

/// All of them are there from the beginning, with 0: a counter whose first value is 1 has never grown, as
/// Prometheus sees it.
std::map<std::string_view, std::uint64_t> no_failures()
{
    std::map<std::string_view, std::uint64_t> counts{{other_failure, 0}};
    for (auto const& [code, label] : failure_labels)
        counts.emplace(label, 0);
    return counts;
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
    text.family(metric("starts_total"))
        .add(static_cast<double>(ready.count()), {{"result", "ready"}, {"reason", ""}})
        .add(static_cast<double>(abandoned_), {{"result", "abandoned"}, {"reason", ""}});
    for (auto const& [reason, count] : failed_)
        text.add(static_cast<double>(count), {{"result", "failed"}, {"reason", reason}});
    text.family(metric("start_stage_seconds"));
    for (auto const stage : {StartStage::fetch, StartStage::launch, StartStage::ready})
        text.add(stages_[static_cast<std::size_t>(stage)], {{"stage", name_of(stage)}});
}

void FetchFigures::write(MetricsText& text) const
{
    text.family(metric("prefetches_total"))
        .add(static_cast<double>(fetched_), {{"result", "fetched"}, {"reason", ""}})
        .add(static_cast<double>(abandoned_), {{"result", "abandoned"}, {"reason", ""}});
    for (auto const& [reason, count] : failed_)
        text.add(static_cast<double>(count), {{"result", "failed"}, {"reason", reason}});
}

} // namespace webots_cloud::core
