// What the session server's monitor page shows of its servers, and what of it changed: texts for browsers
// that watch, and a day of the site.
#pragma once

#include "core/site_state.hpp"
#include "day_history.hpp"
#include "load_history.hpp"

#include <webots_cloud/fleet.hpp>
#include <webots_cloud/server_load.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// One server on the page.
struct SessionRow
{
    SessionRow() = default;

    std::string address;
    std::optional<double> load;     ///< Percent; unknown unless the server is up.
    std::string problem;            ///< Why it is not up; empty while it is, and before its first answer.
    TimePoint reported{};           ///< When `load` came.
    std::optional<int> sessions;    ///< As the server reported them.
    std::optional<int> seats;       ///< The most sessions that it runs at once, as it reported.
    std::optional<SiteState> state; ///< What it is for somebody who comes now; none: not looked at yet.
    std::uint64_t placed = 0;       ///< By us, since we started.
    /// Who says that it gets no new sessions: `operator`, `configuration` or `machine`; empty: nobody.
    std::string_view drained_by;
    std::string refusal; ///< What it said when it refused the last start; empty: it did not.
};

/// What a page shows of a server. `drained_by`: whoever has drained it but itself.
SessionRow session_row(ServerLoad const& server, std::uint64_t placed, std::string_view drained_by = {});

/// Who waits, of a session server that relays.
struct WaitingFigures
{
    WaitingFigures() = default;

    std::size_t waiting = 0; ///< Browsers that wait for a machine.
    Duration longest{};      ///< How long the one that has waited longest has waited.
    std::size_t relayed = 0; ///< Browsers whose messages are relayed to a machine.
    /// Why the first of them wait: a word for programs, and how many.
    std::vector<std::pair<std::string_view, std::size_t>> reasons;

    bool operator==(WaitingFigures const&) const = default;
};

/// Keeps which rows of the page have changed since watchers were last told, ten minutes of loads, and a day
/// of the whole site.
///
/// What is known of the servers belongs to the Fleet, the LoadMonitor and the Scheduler: the board looks at
/// it whenever it writes a text.
///
/// Its texts are JSON and of bounded size: of many servers the history has fewer points. An update has only
/// the rows that changed since the last one, and each poll marks its own row, so that the work is spread.
class SessionBoard
{
public:
    /// A point of the history every `step`; `threshold` in percent.
    SessionBoard(Duration step, double threshold);

    /// What never changes while somebody watches: JSON, for the member `about` of snapshots.
    void describe(std::string about) { about_ = std::move(about); }

    /// Watchers learn it with the next `take`.
    void set_threshold(double threshold);

    /// A machine of the fleet, as FleetObserver::put, and what its polls tell, which lives until it is
    /// removed.
    void put(ServerLoad const& server, FleetMachine const& machine, FleetMachine const* was = nullptr,
             std::optional<std::string_view> before = std::nullopt);

    /// It has left the list. Servers that are not listed are ignored.
    void remove(std::string_view address);

    /// Something else is known of a server than before. Servers that are not listed are ignored.
    void change(std::string_view address);

    /// Asks how many sessions were placed on each server. O(n): to be called when somebody watches, or asks
    /// for a snapshot.
    void count_placed(std::function<std::uint64_t(std::string_view address)> const& placed);

    /// Asks what each server is for somebody who comes now. O(n): likewise.
    void note_states(std::function<SiteState(ServerLoad const& server)> const& state);

    /// Asks with which words each server has refused its last start. O(n): likewise.
    void note_refusals(std::function<std::string_view(std::string_view address)> const& refusal);

    /// What the site is for somebody who comes now.
    void note_site(SiteState state);

    /// Nothing: this server does not relay. To be called when somebody watches, or asks for a snapshot.
    void note_waiting(std::optional<WaitingFigures> figures);

    /// Whether the next `take` is the last of a minute, for which who waits is to be noted also where nobody
    /// watches.
    bool ends_minute(TimePoint now) const noexcept { return day_.is_due(now); }

    /// The next update has what changed since the last `take`. To be called about once a second.
    void take(TimePoint now, WallTime wall);

    /// Everything, for a browser that has just connected; times are those of the last `take`.
    std::string snapshot();

    /// The rows and figures that the last `take` found changed; a snapshot when other servers are listed than
    /// before; empty when nothing changed.
    std::string update();

private:
    struct Row
    {
        ServerLoad const* server = nullptr;
        FleetMachine const* machine = nullptr;
        std::uint64_t placed = 0; ///< As watchers are told.
        std::optional<SiteState> state;
        std::string refusal;
        std::size_t number = 0;  ///< Its place in the last snapshot, by which watchers know it.
        bool is_changed = false; ///< Since the last `take`.
        LoadHistory::Series history;
    };

    Row* find(std::string_view address);
    void change_row(Row& row);
    bool add_point();
    bool add_minute();
    void append_waiting(std::string& text) const;
    void append_site(std::string& text) const;
    SessionRow shown(Row const& row) const;
    void append_row(std::string& text, SessionRow const& row) const;

    LoadHistory history_;
    DayHistory day_;
    double threshold_;
    std::string about_;
    std::list<Row> rows_;
    std::unordered_map<std::string_view, std::list<Row>::iterator> by_address_; ///< Views into the servers.
    std::vector<Row*> changed_;                                                 ///< Since the last `take`.
    std::vector<Row*> told_;                                                    ///< Found so by it.
    std::optional<WaitingFigures> waiting_;
    std::optional<SiteState> site_;
    bool is_site_changed_ = false;    ///< Since the last `take`.
    bool tells_site_ = false;         ///< The last `take` found it changed.
    bool is_waiting_changed_ = false; ///< Since the last `take`.
    bool tells_waiting_ = false;      ///< The last `take` found it changed.
    bool must_restate_ = false;       ///< The next update is a snapshot.
    bool restates_ = false;           ///< This one is.
    bool has_new_point_ = false;
    bool has_new_minute_ = false;
    TimePoint now_{};
    WallTime wall_{};
};

} // namespace webots_cloud::core
