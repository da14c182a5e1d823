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

    bool operator==(SessionRow const&) const = default;
};

/// `placed`: how many sessions were placed on the server of an address.
std::vector<SessionRow> session_rows(std::vector<ServerLoad> servers,
                                     std::function<std::uint64_t(std::string_view)> const& placed);

/// Keeps what watchers have been told, and ten minutes of loads.
///
/// Its texts are JSON and of bounded size: of many servers the history has fewer points. An update names the
/// rows that changed since the last one, so that a calm minute costs next to nothing.
class SessionBoard
{
public:
    /// A point of the history every `step`; `threshold` in percent.
    SessionBoard(Duration step, double threshold) : history_(step), threshold_(threshold) {}

    /// Watchers learn it with the next `take`.
    void set_threshold(double threshold);

    /// Takes the state of now. To be called about once a second.
    void take(std::vector<SessionRow> rows, TimePoint now, WallTime wall);

    /// Everything, for who has just come, as of the last `take`.
    std::string snapshot() const;

    /// What the last `take` changed; a snapshot when other servers are listed than before; empty when nothing
    /// did.
    std::string update() const;

private:
    bool add_point();
    void append_row(std::string& text, std::size_t row) const;

    LoadHistory history_;
    double threshold_;
    std::vector<SessionRow> rows_;
    std::vector<std::size_t> changed_; ///< Rows, by the last `take`.
    bool relisted_ = false;
    bool must_restate_ = false; ///< The next update is a snapshot.
    bool has_new_point_ = false;
    TimePoint now_{};
    WallTime wall_{};
};

} // namespace webots_cloud::core
