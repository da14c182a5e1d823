#include "log_budget.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::size_t max_client_length = 64;
constexpr std::size_t max_example_length = 600;
constexpr std::size_t line_overhead = 40; // time, level, and the end of the line

} // namespace

void LogBudget::Omitted::add(TimePoint now, LogLevel line_level, std::string_view line)
{
    if (count++ == 0)
        since = now;
    level = std::max(level, line_level);
    example = line.substr(0, max_example_length);
}

void LogBudget::Omitted::add(Omitted const& others)
{
    since = count == 0 ? others.since : std::min(since, others.since);
    count += others.count;
    level = std::max(level, others.level);
    example = others.example;
}

LogBudget::Line LogBudget::Omitted::tell(TimePoint now) const
{
    auto const more = count - 1;
    auto line = printable(example, 2 * max_example_length); // a character may have been cut
    if (more > 0)
        line += concat(" (", std::to_string(more), " more like this in the last ",
                       seconds_rounded_up(std::max<Duration>(now - since, std::chrono::seconds(1))), " s)");
    return {level, std::move(line)};
}

bool LogBudget::Bucket::take(TimePoint now, std::string_view line)
{
    auto const passed = std::chrono::duration<double>(now - last).count();
    left = std::min(size, left + std::max(0.0, passed) * a_second);
    last = now;
    auto const cost = static_cast<double>(line.size() + line_overhead);
    if (left < cost)
        return false;
    left -= cost;
    return true;
}

LogBudget::Bucket& LogBudget::bucket_of(LogLevel level) noexcept
{
    return level <= LogLevel::info ? visits_ : failures_;
}

bool LogBudget::take(TimePoint now, LogLevel level, LogCause const& cause, std::string_view line)
{
    auto* const client = find(now, cause);
    if (client && client->written >= lines_of_a_client) {
        client->omitted.add(now, level, line);
        return false;
    }
    if (!bucket_of(level).take(now, line)) {
        topics_[std::string(cause.topic)].add(now, level, line);
        return false;
    }
    if (client)
        ++client->written;
    return true;
}

/// Nobody for a line that is about no client in particular, and when there are too many.
LogBudget::Client* LogBudget::find(TimePoint now, LogCause const& cause)
{
    if (cause.client.empty())
        return nullptr;
    auto key = concat(cause.topic, " ", cause.client.substr(0, max_client_length));
    if (auto const known = by_key_.find(key); known != by_key_.end())
        return &*known->second;
    // Without anything to tell its minute need not be summed up.
    while (!clients_.empty() && clients_.front().ends <= now && clients_.front().omitted.count == 0)
        forget(clients_.begin());
    if (clients_.size() >= max_clients)
        return nullptr;
    auto& client = clients_.emplace_back();
    client.key = key;
    client.topic = cause.topic;
    client.ends = now + window;
    by_key_.emplace(std::move(key), std::prev(clients_.end()));
    return &client;
}

void LogBudget::forget(Clients::iterator client)
{
    by_key_.erase(client->key);
    clients_.erase(client);
}

/// Of the first client: if it has gone on, that is told, and it is watched for another minute.
void LogBudget::end_minute(TimePoint now, std::vector<Line>& lines)
{
    auto const client = clients_.begin();
    if (client->omitted.count == 0)
        return forget(client);
    if (auto line = client->omitted.tell(now); bucket_of(line.first).take(now, line.second))
        lines.push_back(std::move(line));
    else
        topics_[client->topic].add(client->omitted);
    client->omitted = {};
    client->ends = now + window;
    clients_.splice(clients_.end(), clients_, client);
}

std::vector<LogBudget::Line> LogBudget::sum_up(TimePoint now)
{
    std::vector<Line> lines;
    while (!clients_.empty() && clients_.front().ends <= now)
        end_minute(now, lines);
    std::erase_if(topics_, [&](auto const& entry) {
        auto const& omitted = entry.second;
        bool const is_due = omitted.since + window <= now;
        if (is_due)
            lines.push_back(omitted.tell(now));
        return is_due;
    });
    return lines;
}

std::vector<LogBudget::Line> LogBudget::sum_up_everything(TimePoint now)
{
    for (auto const& client : clients_)
        if (client.omitted.count > 0)
            topics_[client.topic].add(client.omitted);
    by_key_.clear();
    clients_.clear();
    std::vector<Line> lines;
    for (auto const& [topic, omitted] : topics_)
        lines.push_back(omitted.tell(now));
    topics_.clear();
    return lines;
}

} // namespace webots_cloud::core
