// The WebSocket /client of a session server: finds a machine for each browser, has it wait where none is
// free, and relays what both say (protocol section 13.16).
#pragma once

#include "async/task_group.hpp"
#include "core/access/quota_counts.hpp"
#include "core/access/silent_clients.hpp"
#include "core/access/tickets.hpp"
#include "core/classes/class_book.hpp"
#include "core/pages/histogram.hpp"
#include "core/refusals.hpp"
#include "core/relay/machine_conversation.hpp"
#include "core/relay/machine_faults.hpp"
#include "core/relay/machine_questions.hpp"
#include "core/site_state.hpp"
#include "core/waiting/wait_estimate.hpp"
#include "core/waiting/waiting_messages.hpp"
#include "core/waiting/waiting_room.hpp"
#include "core/waiting/waiting_ticket.hpp"

#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace webots_cloud {

struct ClientRelayParams
{
    ClientRelayParams() = default;

    bool tls = false;               ///< Machines without an internal address are reached by `wss://`.
    std::size_t waiting_places = 0; ///< 0: nobody waits.
    bool finds_machines = false;    ///< Not all of them are known at the start.
};

/// None of them may block.
struct ClientRelayHooks
{
    ClientRelayHooks() = default;

    WebSocketClient* websockets = nullptr; ///< Null: nothing is relayed.
    /// As in SessionServiceHooks; empty: machines want no tickets.
    std::function<std::string(std::string_view server)> make_ticket;
    /// Signs the tickets of those who wait; empty: nobody gets one.
    core::Mac waiting_mac;
    std::function<std::string(std::size_t size)> random_bytes;
    /// Whether a client may ask for a simulation once more.
    std::function<bool(std::string_view quota_key)> may_ask;
    /// Somebody was placed, or was not.
    std::function<void(bool placed)> note_placement;
    /// What a student of a class gets.
    std::function<core::SeatRequest(std::string_view student)> ask_for_seat;
    /// A student was sent to that machine, by a browser that has asked us so.
    std::function<void(std::string_view student, core::SeatRequest seat, std::string_view entry,
                       AskedAddress const& asked)>
        take_seat;
    /// Where a browser that has asked us so reaches a machine that is below this server; empty: others.
    std::function<std::string(std::string_view entry, AskedAddress const& asked)> public_address;
    /// What the site were if nobody waited.
    std::function<core::SiteState()> supply;
    /// Somebody has come to the line, or left it.
    std::function<void()> note_line;
    /// What students of one class have in common; empty: there is no such student.
    std::function<std::string(std::string_view student)> class_of;
};

/// Serves browsers, and gives seats to those who wait.
///
/// Lifetime: everything passed by reference must outlive it, and the browsers must have left.
/// Thread-safety: one executor.
class ClientRelay final : public FleetObserver
{
public:
    ClientRelay(ClientRelayParams params, Fleet const& fleet, LoadMonitor& monitor, Scheduler& scheduler,
                Clock& clock, Logger log, ClientRelayHooks hooks);
    ~ClientRelay() override;

    void apply(ClientRelayParams params);
    void put(FleetMachine const& machine, FleetMachine const* was,
             std::optional<std::string_view> before) override;
    void remove(FleetMachine const& machine) override;

    std::size_t waiting() const noexcept { return room_.size(); }

    /// Whether a browser that comes now is served or may wait.
    bool takes_more(TimePoint now) const;

    boost::asio::awaitable<void> serve(ChannelInfo info, Channel& channel);

    /// A poll of that machine has ended, and the scheduler knows its report.
    void heard_from(std::string_view entry);

    /// Machines may have become free, or the time may have come to tell those who wait where they are.
    void update();

    /// Looks after those who wait, as long as it is awaited.
    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// The server is being stopped: simulations outlive it for their grace.
    void stop();

    struct Figures
    {
        Figures() = default;

        std::size_t waiting = 0;
        Duration longest_wait{};
        core::WaitCounts reasons{}; ///< Why the first of them wait.
        std::size_t relayed = 0;    ///< Browsers with a machine, or on their way to one.
        std::uint64_t given_up = 0;
        std::uint64_t refused = 0;
        std::uint64_t questions = 0;                        ///< To machines, before somebody was placed.
        std::map<std::string_view, std::uint64_t> attempts; ///< At machines, by how they ended.
    };

    Figures figures() const;
    /// As in MachineFaults.
    std::string_view last_refusal(std::string_view entry) const { return faults_.last_refusal(entry); }
    core::Histogram const& waits() const noexcept { return waits_; } ///< Seconds, of those who got a seat.

private:
    using Id = core::WaitingRoom::Id;
    struct Browser;
    struct Ride;
    struct Refusals;
    struct Machine;

    enum class Next
    {
        another_machine,
        line,
        end
    };

    boost::asio::awaitable<void> talk(Browser& browser);
    void take(Browser& browser, std::string text);
    void take_first(Browser& browser, std::string text, std::string const& quota_key);
    void drop_silent(TimePoint now);
    TimePoint end_of_silence(Id silent) const;
    void begin(Browser& browser, std::string text, std::string const& quota_key);
    void ask_for_seat(Browser& browser);
    void serve_now(Browser& browser, PlacementRequest const& request, TimePoint now);
    void line_up(Browser& browser, TimePoint now);
    void come_back(Browser& browser, std::string_view text, std::string const& quota_key);
    static void refuse(Browser& browser, Failure const& why);
    static void refuse(Browser& browser, core::Refused why);
    boost::asio::awaitable<void> leave(Browser& browser, Failure const& why);

    std::string group_of(Browser const& browser, std::string const& quota_key) const;
    bool is_settling(TimePoint now) const;
    Browser& browser_at(std::size_t ahead) const;
    bool wait_in_line(Browser& browser, TimePoint now);
    bool leave_line(Browser& browser);
    static std::vector<std::string> wishes_of(Browser const& browser, TimePoint now);
    bool may_be_taken(Browser const& browser, TimePoint now) const;
    static void tell_refusal(Browser& browser);
    bool must_fit(Browser const& browser, TimePoint now) const noexcept;
    bool is_known_to_be_too_large(Browser const& browser, TimePoint now) const;
    void set_wants_room(Browser& browser, bool wants);
    std::optional<core::WaitRange> expected_wait(Browser const& browser, core::WaitReason why,
                                                 std::size_t ahead, TimePoint now) const;
    void note_supply();
    void claim_ticket(Browser& browser);
    void give_ticket(Browser& browser, TimePoint now);
    void note_change();
    boost::asio::awaitable<result<>> wait_for_work();
    boost::asio::awaitable<void> tell_places();
    void tell_part(std::size_t first, std::size_t end, TimePoint now);
    void tell_place(Browser& browser, std::size_t ahead, TimePoint now);
    void give_out_seats(TimePoint now);
    void look_for_freed_seats(TimePoint now);

    std::vector<std::string> ask_machines(Browser const& browser, PlacementRequest const& request,
                                          TimePoint now);
    boost::asio::awaitable<void> serve_when_answered(Browser& browser, std::vector<std::string> asked,
                                                     TimePoint since);
    boost::asio::awaitable<bool> hear_answers(Browser& browser, std::vector<std::string> const& asked,
                                              TimePoint latest);

    result<> try_to_place(Browser& browser, PlacementRequest const& request, TimePoint now);
    PlacementRequest request_of(Browser const& browser, TimePoint now) const;
    result<Placement> find_machine(PlacementRequest const& request, TimePoint now);
    void start_carrying(Browser& browser);
    boost::asio::awaitable<void> carry(Browser& browser);
    boost::asio::awaitable<bool> carry_to_end(Browser& browser);
    boost::asio::awaitable<core::MachineRefusal> converse(Browser& browser);
    boost::asio::awaitable<result<std::unique_ptr<Channel>>> connect(Browser const& browser);
    boost::asio::awaitable<result<std::string>> hear(Channel& machine, Duration patience);
    bool is_ours(std::string_view entry) const;
    void note_ready(Browser& browser);
    void pass_on(Browser& browser, std::string message);
    static void end_browser(Browser& browser, Failure const& why);
    void give_back(Ride& ride);
    void note_refusal(Browser& browser, core::MachineRefusal refusal);
    Next try_again(Browser& browser);

    ClientRelayParams params_;
    Fleet const& fleet_;
    LoadMonitor& monitor_;
    Scheduler& scheduler_;
    Clock& clock_;
    Logger log_;
    ClientRelayHooks hooks_;
    std::map<std::string, Machine, std::less<>> machines_; ///< By entry.
    core::MachineFaults faults_;
    core::MachineQuestions questions_;
    core::SilentClients silent_;
    core::WaitingRoom room_;
    core::WaitEstimate estimate_;
    core::WaitingTickets tickets_;
    core::Histogram waits_;
    std::unordered_map<Id, Browser> browsers_;
    core::QuotaCounts held_; ///< Seats, by group.
    std::optional<async::TaskGroup> tasks_;
    std::optional<async::Wakeup> line_changed_;
    std::size_t kept_ = 0;                              ///< Bytes of the requests of those who wait.
    std::size_t want_room_ = 0;                         ///< Of those who wait.
    std::size_t students_ = 0;                          ///< Likewise.
    core::SiteState supply_ = core::SiteState::unknown; ///< As those who wait were told.
    /// What no free machine had room for, as a digest of world and mode with the wishes of whoever asked, and
    /// until when it is not tried again.
    std::map<std::pair<std::uint64_t, std::vector<std::string>>, TimePoint> too_large_;
    std::string last_polled_; ///< Machine, of those that are polled in turn.
    TimePoint began_;
    TimePoint told_{};   ///< When all were last told that the line had changed,
    TimePoint looked_{}; ///< or might have been told something else.
    bool has_changed_ = false;
    Id last_id_ = 0;
    std::size_t relayed_ = 0;
    std::uint64_t given_up_ = 0;
    std::uint64_t refused_ = 0;
    std::uint64_t questions_asked_ = 0;
    std::map<std::string_view, std::uint64_t> attempts_;
    bool is_stopping_ = false;
};

} // namespace webots_cloud
