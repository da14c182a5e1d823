// Limits how many log lines clients may cause; the rest is only counted.
#pragma once

#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// Decides which lines that clients cause are written.
///
/// Of one client and topic ten lines are written, then one a minute, which says how many there were. All
/// clients together have a budget of bytes, one for lines of visits (`info`) and one for what was refused or
/// failed, so that neither can take the other's; what is over it is counted by topic. What a line says
/// decides nothing: a client that varies a text gets no more lines than one that repeats it.
///
/// Memory is bounded: clients that no longer fit into the table share only the common budget.
class LogBudget
{
public:
    static constexpr Duration window = std::chrono::seconds(60);
    static constexpr int lines_of_a_client = 10;
    static constexpr std::size_t max_clients = 1000;

    /// A line to be written.
    using Line = std::pair<LogLevel, std::string>;

    /// Whether the line is to be written; otherwise it was counted. `now` never goes back.
    bool take(TimePoint now, LogLevel level, LogCause const& cause, std::string_view line);

    /// What was counted and is to be told now: each the last of such lines, with how many like it were left
    /// out.
    std::vector<Line> sum_up(TimePoint now);

    /// The same of everything that was counted, because the log ends.
    std::vector<Line> sum_up_everything(TimePoint now);

private:
    /// Lines that were left out.
    struct Omitted
    {
        Omitted() = default;

        void add(TimePoint now, LogLevel level, std::string_view line);
        void add(Omitted const& others);
        Line tell(TimePoint now) const;

        std::uint64_t count = 0;
        TimePoint since{};
        LogLevel level = LogLevel::info; ///< The highest of them.
        std::string example;             ///< The last of them, cut.
    };

    /// A token for each byte of the log.
    struct Bucket
    {
        Bucket(double size, double a_second) : size(size), a_second(a_second), left(size) {}

        bool take(TimePoint now, std::string_view line);

        double size;
        double a_second;
        double left;
        TimePoint last{};
    };

    struct Client
    {
        Client() = default;

        std::string key;
        std::string topic;
        TimePoint ends{}; ///< Of the minute.
        int written = 0;
        Omitted omitted;
    };

    using Clients = std::list<Client>; ///< Whose minute ends first, first.

    Client* find(TimePoint now, LogCause const& cause);
    Bucket& bucket_of(LogLevel level) noexcept;
    void end_minute(TimePoint now, std::vector<Line>& lines);
    void forget(Clients::iterator client);

    // At once what a class of 300 causes; then 11 MB a day, while the log's files hold 5.5: strangers need
    // half a day to have them rotated away.
    Bucket visits_{300'000, 100};
    Bucket failures_{100'000, 30};
    Clients clients_;
    std::unordered_map<std::string, Clients::iterator> by_key_;
    std::map<std::string, Omitted, std::less<>> topics_; ///< Our own words: a few dozen.
};

} // namespace webots_cloud::core
