// What the session server's monitor page shows of its servers, and what of it changed: texts for browsers
// that watch.
#pragma once

#include "load_history.hpp"

#include <webots_cloud/server_load.hpp>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace webots_cloud::core {

/// One server on the page.
struct SessionRow
{
    SessionRow() = default;

    std::string address;
    std::optional<double> load;  ///< Percent; unknown unless the server is up.
    std::string problem;         ///< Why it is not up; empty while it is, and before its first answer.
    TimePoint reported{};        ///< When `load` came.
    std::optional<int> sessions; ///< As the server reported them.
    std::uint64_t placed = 0;    ///< By us, since we started.
};

/// What a page shows of a server.
SessionRow session_row(ServerLoad const& server, std::uint64_t placed);

/// Keeps what watchers have been told, and ten minutes of loads.
///
/// Its texts are JSON and of bounded size: of many servers the history has fewer points. An update names the
/// rows that changed since the last one, so that a calm minute costs next to nothing. Each poll changes its
/// own row, so that no moment has the work of thousands.
class SessionBoard
{
public:
    /// A point of the history every `step`; `threshold` in percent.
    SessionBoard(Duration step, double threshold) : history_(step), threshold_(threshold) {}

    /// Watchers learn it with the next `take`.
    void set_threshold(double threshold);

    /// The servers from now on, each with an address of its own.
    void list(std::vector<SessionRow> rows);

    /// What is known of a server after a poll. Servers that are not listed are left out.
    void note(ServerLoad const& server);

    /// Asks how many sessions were placed on each server. Takes longer the more there are: for who watches,
    /// or asks for a snapshot.
    void count_placed(std::function<std::uint64_t(std::string_view address)> const& placed);

    /// What was noted since the last `take` is the next update. To be called about once a second.
    void take(TimePoint now, WallTime wall);

    /// Everything, for who has just come; times are those of the last `take`.
    std::string snapshot() const;

    /// What the last `take` changed; a snapshot when other servers are listed than before; empty when nothing
    /// did.
    std::string update() const;

private:
    struct Row
    {
        SessionRow shown;
        bool is_changed = false; ///< Since the last `take`.
    };

    void change(std::size_t row);
    bool add_point();
    void append_row(std::string& text, SessionRow const& row) const;

    LoadHistory history_;
    double threshold_;
    std::vector<Row> rows_;
    std::unordered_map<std::string_view, std::size_t> places_; ///< In `rows_`, which owns the addresses.
    std::vector<std::size_t> changed_;                         ///< Rows, since the last `take`.
    std::vector<std::size_t> told_;                            ///< Rows that the last `take` found changed.
    bool must_restate_ = false;                                ///< The next update is a snapshot.
    bool restates_ = false;                                    ///< This one is.
    bool has_new_point_ = false;
    TimePoint now_{};
    WallTime wall_{};
};

} // namespace webots_cloud::core
