// The WebSocket /client of a session server: finds a machine for each browser, has it wait where none is
// free, and relays what both say (protocol section 13.16).
#pragma once

#include "async/task_group.hpp"
#include "class_endpoint.hpp"
#include "core/access/quota_counts.hpp"
#include "core/access/silent_clients.hpp"
#include "core/pages/metrics_text.hpp"
#include "core/pages/session_board.hpp"
#include "core/refusals.hpp"
#include "core/relay/machine_conversation.hpp"
#include "core/relay/machine_faults.hpp"
#include "core/relay/machine_questions.hpp"
#include "core/site_state.hpp"
#include "core/waiting/wait_estimate.hpp"
#include "core/waiting/waiting_messages.hpp"
#include "core/waiting/waiting_room.hpp"
#include "core/waiting/waiting_ticket.hpp"
#include "session_endpoint.hpp"
#include "site_availability.hpp"
#include "site_context.hpp"

#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace webots_cloud {

/// Serves browsers, and gives seats to those who wait.
///
/// Lifetime: everything passed by reference must outlive it, and the browsers must have left.
/// Thread-safety: one executor.
class ClientRelay final : public FleetObserver
{
public:
    ClientRelay(SiteContext const& site, ClassEndpoint& classes, SessionEndpoint& sessions,
                SiteAvailability& availability);
    ~ClientRelay() override;

    /// The site's parameters are others.
    void apply();
    void put(FleetMachine const& machine, FleetMachine const* was,
             std::optional<std::string_view> before) override;
    void remove(FleetMachine const& machine) override;

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

    core::WaitingFigures figures() const;
    void write_metrics(core::MetricsText& text) const;

    /// As in MachineFaults.
    std::string_view last_refusal(std::string_view entry) const { return faults_.last_refusal(entry); }

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

    SiteContext const& site_;
    ClassEndpoint& classes_;
    SessionEndpoint& sessions_;
    SiteAvailability& availability_;
    std::map<std::string, Machine, std::less<>> machines_; ///< By entry.
    core::MachineFaults faults_;
    core::MachineQuestions questions_;
    core::SilentClients silent_;
    core::WaitingRoom room_;
    core::WaitEstimate estimate_;
    core::WaitingTickets tickets_;
    core::Histogram waits_; ///< Seconds, of those who got a seat.
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
    std::size_t relayed_ = 0; ///< Browsers with a machine, or on their way to one.
    std::uint64_t given_up_ = 0;
    std::uint64_t refused_ = 0;
    std::uint64_t questions_asked_ = 0;                  ///< To machines, before somebody was placed.
    std::map<std::string_view, std::uint64_t> attempts_; ///< At machines, by how they ended.
    bool is_stopping_ = false;
};

} // namespace webots_cloud
