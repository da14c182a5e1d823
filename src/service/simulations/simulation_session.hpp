// The life of one browser on /client: from its `start` to the last cleaned-up byte.
#pragma once

#include "async/wakeup.hpp"
#include "core/access/admission.hpp"
#include "core/access/controller_address.hpp"
#include "core/pages/simulation_board.hpp"
#include "core/projects/project_needs.hpp"
#include "core/projects/repository_policy.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/editable_files.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/simulation/service_state.hpp"
#include "core/simulation/simulation_life.hpp"
#include "core/simulation/start_figures.hpp"
#include "core/simulation/start_refusal.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/simulation_service.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/controllers.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/folder_meter.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/simulation_logs.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

class Stager;

/// What the sessions of a server share.
struct SessionContext
{
    SessionContext(SimulationServiceParams const& service_params, SimulationServiceHooks const& service_hooks,
                   ProjectFetcher& projects, SimulationLauncher& simulators, Clock& time, Logger logger,
                   core::AdmissionLimits limits)
        : params(service_params), hooks(service_hooks), fetcher(projects), launcher(simulators), clock(time),
          log(std::move(logger)), admission(limits)
    {}

    SimulationServiceParams const& params;
    SimulationServiceHooks const& hooks;

    ProjectFetcher& fetcher;
    SimulationLauncher& launcher;
    Clock& clock;
    Logger log;
    core::RepositoryPolicy policy;
    core::ServiceState state;
    Stager* stager = nullptr; ///< Set before there are sessions.
    double load = 0;          ///< Of this machine when it was last measured, in percent.
    double memory = 0;        ///< In use then, in percent, by staged simulations too.
    double cores = 0;         ///< Of this machine; 0: nobody knows.
    core::Admission admission;
    core::StartFigures starts;
    core::FetchFigures fetches; ///< For later starts.
    /// How often a simulation got ready, began to wait for its browser, or ended: pages that were made before
    /// that are old.
    std::uint64_t changes = 0;
    std::uint64_t staged_taken = 0;          ///< Staged simulations that browsers got.
    std::map<Limit, std::uint64_t> overruns; ///< Simulations that were ended at a limit.
    /// Bytes of simulations that have ended, from and to browsers.
    std::uint64_t received = 0;
    std::uint64_t sent = 0;
};

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

    /// Where its browser has asked for this server, and where it reaches us through a session server
    /// (`public_address_header`), if it does.
    void set_asked(AskedAddress asked, std::string public_base)
    {
        asked_ = std::move(asked);
        public_base_ = std::move(public_base);
    }

    /// With which a browser that lost its connection returns; empty: it can't.
    std::string const& token() const noexcept { return token_; }

    /// Whether this is the token in the address of the running simulation.
    bool is_at(std::string_view address_token) const noexcept
    {
        return !address_token_.empty() && address_token_ == address_token;
    }

    /// Whether that is a port of the simulation, which is ready, or of its editor.
    bool has_port(std::uint16_t port) const;

    /// Whether one of them, `port`, is that of its editor.
    bool is_editors(std::uint16_t port) const noexcept { return port != ready_.port; }

    /// What such a request is passed on to.
    /// Precondition: the simulation has the port.
    Forward forward(core::GatewayPath const& path, IncomingRequest const& request) const;

    /// Whether this is the key for controllers of its robots.
    bool has_controller_key(std::string_view key) const noexcept
    {
        return !controller_key_.empty() && controller_key_ == key;
    }

    /// Where a controller of `robot`, as it calls it, is passed on to.
    /// Precondition: it has a controller key.
    ControllerWay way_of_controller(std::string_view robot) const;

    /// The simulator itself, which is ready.
    Upstream simulator() const;

    /// Whether it runs a world of a forge, and streams pictures of it.
    bool streams_pictures() const;

    /// Of its world, as the browser gave it; empty: it is a project of a website.
    std::string_view address() const noexcept;

    /// Takes over the limit of the context.
    void limit_traffic();

    /// Null: it is not reached through us.
    TunnelGroup const* tunnels() const noexcept { return tunnels_.get(); }

    std::uint64_t id() const noexcept { return id_; }

    core::SimulationLife::Stage stage() const noexcept { return life_.stage(); }
    bool is_starting() const noexcept;

    /// Its project is fetched for later starts: it never becomes a simulation.
    bool is_fetch_only() const { return core::is_fetch_only(request_); }

    /// Measures what the simulator consumes.
    boost::asio::awaitable<void> look_at_processes();

    /// Ends the simulation if it has overrun the limit of memory or processes when it was last looked at.
    void keep_process_limits();

    /// Measures its folder, if that is due, and ends it if it has overrun the limit of disk.
    boost::asio::awaitable<void> look_at_folder(FolderMeter& meter);

    /// What it consumed when it was last looked at; nothing before that.
    ProcessUsage const& usage() const noexcept { return used_; }
    double processors() const noexcept { return cpu_.value_or(0) / 100; }
    double graphics_processors() const noexcept { return graphics_; }
    bool is_measured() const noexcept { return cpu_.has_value(); }

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
    boost::asio::awaitable<void> relay(Channel& channel);
    boost::asio::awaitable<void> await_takeover();
    boost::asio::awaitable<void> finish(Channel& channel);
    void note_leaving(Failure const& failure, Channel const& channel);
    void tell_who_ended(Channel& channel);
    core::SimulationLife::Next end_connection();
    boost::asio::awaitable<void> await_return(TimePoint until);
    void log_loss(core::SimulationLife::Loss loss);
    boost::asio::awaitable<void> await_goodbyes();
    boost::asio::awaitable<void> clean_up(bool exited);
    void close_tunnels();
    boost::asio::awaitable<void> reset_controller(std::string file, Channel& channel);
    boost::asio::awaitable<void> read_programs();
    void show_program(core::ReadFileMessage const& wish, Channel& channel);
    boost::asio::awaitable<void> save_program(core::WriteFileMessage program, Channel& channel);
    void list_programs(Channel& channel);
    void greet(Channel& channel);
    void introduce(Channel& channel);
    void on_ready(SimulationReady const& ready);
    std::string_view state_name() const;
    void tell_time(Channel& channel, Duration left);
    void extend(Duration by, Channel& channel);
    void announce(Channel& channel);
    std::string reached_at() const;
    void note_extern_robot(std::string robot, Channel& channel);
    void tell_controller(std::size_t robot, Channel& channel) const;
    void open_tunnels();
    bool takes_controllers() const;
    result<> check_policy() const;
    bool check_needs(Channel& channel);
    result<> may_start() const;
    result<> take_place();
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
    AskedAddress asked_;
    std::string public_base_;
    core::SimulationRequest request_;
    core::SimulationLife life_;
    core::StartStep step_ = core::StartStep::admission; ///< Until the simulation is ready.
    bool introduced_ = true;     ///< The browser knows what those are told who have waited for the start.
    Channel* channel_ = nullptr; ///< To the browser, while `run` or `resume` uses it.
    TimePoint started_;
    core::Admission::Place place_;
    std::optional<Project> project_;
    std::vector<std::string> needed_labels_;      ///< By the project.
    std::optional<core::EditableFiles> programs_; ///< Once fetched; absent: its page can't change them.
    std::unique_ptr<SimulationLog> output_;       ///< Outlives the simulation, which writes to it.
    std::unique_ptr<Simulation> simulation_;
    SimulationReady ready_;     ///< Where the simulator listens, once it does.
    std::string address_token_; ///< In its address; empty: nobody reaches it through us.
    std::shared_ptr<TunnelGroup> tunnels_;
    /// With which controllers on other machines are let in; empty: none is. Not the token of the address,
    /// which opens the whole simulation: this one crosses networks as plain text.
    std::string controller_key_;
    core::ExternRobots extern_robots_;

    std::string token_;
    std::string loss_reason_;    ///< How the last connection ended.
    async::Wakeup life_changed_; ///< Another connection takes over, or the server stops.
    async::Wakeup released_;     ///< The connection that takes over can go on.

    ProcessUsage used_;         ///< When it was last measured.
    TimePoint measured_;        ///< When that was; at first when the simulator was started.
    TimePoint folder_due_{};    ///< When its folder is to be measured again.
    std::optional<double> cpu_; ///< Percent of one processor, between the last two measurements.
    double graphics_ = 0;       ///< Graphics processors, then.
};

/// The sessions of a server, by their number. Shared with the connections that use them.
using SimulationSessions = std::map<std::uint64_t, std::shared_ptr<SimulationSession>>;

} // namespace webots_cloud
