#include "output_budget.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <chrono>

namespace webots_cloud::core {
namespace {

constexpr auto first_notice = std::chrono::seconds(1);
constexpr auto notice_interval = std::chrono::minutes(1);

} // namespace

void OutputBudget::Allowance::fill(TimePoint now)
{
    auto const passed = std::chrono::duration<double>(now - filled_).count();
    left_ = std::min(max_, left_ + std::max(0.0, passed) * a_second_);
    filled_ = now;
}

bool OutputBudget::Allowance::take(double amount, TimePoint now)
{
    fill(now);
    if (left_ < amount)
        return false;
    left_ -= amount;
    return true;
}

void OutputBudget::Allowance::spend(double amount, TimePoint now)
{
    fill(now);
    left_ -= amount;
}

TimePoint OutputBudget::Allowance::recovered(TimePoint now) const
{
    if (left_ >= 0)
        return now;
    return now + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(-left_ / a_second_));
}

bool OutputBudget::take_line(TimePoint now)
{
    if (lines_.take(1, now))
        return true;
    if (left_out_++ == 0)
        notice_due_ = std::max(now + first_notice, last_notice_ ? *last_notice_ + notice_interval : now);
    return false;
}

TimePoint OutputBudget::read(std::size_t bytes, TimePoint now)
{
    bytes_.spend(static_cast<double>(bytes), now);
    return bytes_.recovered(now);
}

std::optional<std::string> OutputBudget::take_notice(TimePoint now)
{
    if (left_out_ == 0)
        return std::nullopt;
    auto const text = concat(std::to_string(left_out_), left_out_ == 1 ? " line was" : " lines were",
                             " left out: more than ", std::to_string(static_cast<int>(lines_a_second)),
                             " a second were printed");
    left_out_ = 0;
    last_notice_ = now;
    notice_due_ = TimePoint::max();
    return text;
}

} // namespace webots_cloud::core
