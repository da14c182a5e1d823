// The life of one browser on /client: from its `start` to the last cleaned-up byte. Its parts: how the
// simulation is reached (`SimulationGateway`), what it uses (`SimulationUsage`), its programs
// (`SimulationPrograms`), and the rules that are asked first (start_rules.hpp).
#pragma once

#include "async/wakeup.hpp"
#include "core/access/admission.hpp"
#include "core/pages/simulation_board.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/simulation_life.hpp"
#include "core/simulation/start_figures.hpp"
#include "core/simulation/start_refusal.hpp"
#include "session_context.hpp"
#include "simulation_gateway.hpp"
#include "simulation_programs.hpp"
#include "simulation_usage.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/simulation_logs.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// The simulation of one browser. One connection at a time owns it: the one that started it, or the last one
/// that took it over. A staged simulation is one whose browser has not come yet: that takes it over, as one
/// that returns does.
///
/// Lifetime: the context must outlive it.
/// Thread-safety: one executor.
class SimulationSession
{
public:
    enum class Browser
    {
        here,
        awaited ///< The simulation is staged.
    };

    SimulationSession(SessionContext& context, boost::asio::any_io_executor const& executor, std::uint64_t id,
                      std::string quota_key, core::SimulationRequest request,
                      Browser browser = Browser::here);

    /// Fetches, launches and relays until the browser leaves or the simulation ends, then cleans up. Call it
    /// once.
    ///
    /// With a grace, it waits for a browser that lost its connection, and ends without cleaning up when
    /// another connection takes over.
    ///
    /// Cancellation: none; it ends when the browser leaves.
    boost::asio::awaitable<void> run(Channel& channel);

    /// In place of `run` where the browser is awaited: gets ready, and waits until a browser takes the
    /// simulation over. Ends then, or when the simulation has ended and nothing is left of it.
    boost::asio::awaitable<void> run_staged();

    /// A staged simulation is the browser's from now on, if it may start one.   False: the browser is not
    /// told why, since an ordinary start does.
    bool claim(std::string const& quota_key, core::SimulationRequest const& request);

    /// To be awaited once it was claimed, before `resume`. False: it has ended meanwhile.
    boost::asio::awaitable<bool> claimed();

    /// Ends the simulation if it is staged.
    void give_back();

    /// No browser has it yet.
    bool is_staged() const noexcept { return life_.is_staged(); }

    /// A browser could have it.
    bool is_staged_and_ready() const noexcept
    {
        return is_staged() && life_.state() == core::SimulationLife::State::waiting;
    }

    /// Takes the session from the connection that owns it, to `resume` it. False: there is nothing to return
    /// to.
    boost::asio::awaitable<bool> take_over();

    /// Goes on as `run` does, with the running simulation.
    boost::asio::awaitable<void> resume(Channel& channel);

    /// Shows a browser that asked for it that we live: to be called every second.
    void send_heartbeat();

    /// The server stops: waits for no browser any more, and tells a browser whose simulation has not started.
    void on_server_stop();

    /// Ends the simulation, and tells its browser who did.   False: it has ended, or is being ended.
    bool end_by_operator();

    /// No browser can return to it. Once `run` or `resume` has ended as well, nothing is left of it.
    bool is_over() const noexcept { return life_.is_over(); }

    /// How it is reached.
    SimulationGateway& gateway() noexcept { return gateway_; }
    SimulationGateway const& gateway() const noexcept { return gateway_; }

    /// What it uses of the machine.
    SimulationUsage& usage() noexcept { return usage_; }
    SimulationUsage const& usage() const noexcept { return usage_; }

    /// With which a browser that lost its connection returns; empty: it can't.
    std::string const& token() const noexcept { return token_; }

    /// Whether it runs a world of a forge, and streams pictures that somebody has asked it for
    /// (core/simulation/simulator_greeting says why not others).
    bool streams_pictures() const;

    /// The address of its world, as the browser gave it; empty: it is a project of a website.
    std::string_view address() const noexcept;

    std::uint64_t id() const noexcept { return id_; }

    core::SimulationLife::Stage stage() const noexcept { return life_.stage(); }
    bool is_starting() const noexcept;

    /// Its project is fetched for later starts: it never becomes a simulation.
    bool is_fetch_only() const { return core::is_fetch_only(request_); }

    /// Which world it shows, for session servers.
    WorldKey world_key() const;

    core::SimulationRow row() const;

private:
    boost::asio::awaitable<void> simulate(Channel& channel);
    boost::asio::awaitable<void> receive(Channel& channel);
    boost::asio::awaitable<result<>> fetch(Channel& channel);
    boost::asio::awaitable<result<Project>> fetch_requested(std::shared_ptr<FetchProgress> progress);
    boost::asio::awaitable<result<>> fetch_project(std::shared_ptr<FetchProgress> progress);
    void fetched_for_later(Channel& channel);
    void passed(core::StartStage stage, Duration took);
    boost::asio::awaitable<result<>> launch(Channel& channel);
    LaunchSpec launch_spec() const;
    boost::asio::awaitable<result<>> show_progress(std::shared_ptr<FetchProgress const> progress,
                                                   Channel& channel);
    boost::asio::awaitable<void> greet_simulator(Channel& channel);
    boost::asio::awaitable<void> relay(Channel& channel);
    boost::asio::awaitable<void> await_takeover();
    boost::asio::awaitable<void> finish(Channel& channel);
    void note_leaving(Failure const& failure, Channel const& channel);
    void tell_who_ended(Channel& channel);
    core::SimulationLife::Next end_connection();
    boost::asio::awaitable<void> await_return(TimePoint until);
    void log_loss(core::SimulationLife::Loss loss);
    boost::asio::awaitable<void> clean_up(bool exited);
    boost::asio::awaitable<void> reset_controller(std::string file, Channel& channel);
    void greet(Channel& channel);
    void introduce(Channel& channel);
    void on_ready(SimulationReady const& ready);
    std::string_view state_name() const;
    void tell_time(Channel& channel, Duration left);
    void extend(Duration by, Channel& channel);
    void announce(Channel& channel);
    bool check_needs(Channel& channel);
    void open_output(LaunchSpec& spec);
    void refuse(Channel& channel, Failure const& failure, core::StartRefusal refusal);
    void refuse_start(SimulationEnded const& ended, Channel& channel);
    void refuse(Channel& channel, Failure const& failure, std::string_view announcement);
    void send_error(Channel& channel, Failure const& error);
    bool wants_reasons() const { return core::wants_reasons(request_); }
    std::string log_prefix() const;

    SessionContext& context_;
    std::uint64_t id_;
    std::string quota_key_; ///< Of the client that started it, also when it returns from elsewhere.
    core::SimulationRequest request_;
    core::SimulationLife life_;
    core::StartStep step_ = core::StartStep::admission; ///< Until the simulation is ready.
    bool introduced_ = true; ///< The browser knows what those are told who have waited for the start.
    std::string pictures_;   ///< Message for the browser: they can be fetched; empty: it has to ask first.
    Channel* channel_ = nullptr; ///< To the browser, while `run` or `resume` uses it.
    TimePoint arrived_; ///< When its browser came; of a staged one without a browser, when it was made.
    core::Admission::Place place_;
    std::optional<Project> project_;
    std::vector<std::string> needed_labels_; ///< By the project.
    std::unique_ptr<SimulationLog> output_;  ///< Outlives the simulation, which writes to it.
    std::unique_ptr<Simulation> simulation_;
    SimulationGateway gateway_{context_};
    SimulationUsage usage_{context_, simulation_, life_};
    SimulationPrograms programs_;

    std::string token_;
    std::string loss_reason_;    ///< How the last connection ended.
    async::Wakeup life_changed_; ///< Another connection takes over, or the server stops.
    async::Wakeup released_;     ///< The connection that takes over can go on.
};

/// The sessions of a server, by their number. Shared with the connections that use them.
using SimulationSessions = std::map<std::uint64_t, std::shared_ptr<SimulationSession>>;

} // namespace webots_cloud
