// The configuration files of the two servers: the keys that operators have used for years, and ours.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/listed_world.hpp>
#include <webots_cloud/network_config.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/server_load.hpp>
#include <webots_cloud/server_spec.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What clients may ask of a server: keys that both configurations have.
struct AccessConfig
{
    AccessConfig() = default;

    std::vector<std::string> host_names; ///< `hostNames`: what this machine is called besides `server`.
    /// `allowedOrigins`: sites whose pages may open WebSockets: `https://example.org`, `http://pc7:8080`,
    /// with all sites below `https://*.example.org`, pages without a site (from disk) `null`, all pages `*`.
    /// Absent: on a public site all pages; otherwise our own, those of this machine and of
    /// https://webots.cloud.
    std::optional<std::vector<std::string>> allowed_origins;
    /// `frameAncestors`: sites whose pages may show ours in a frame. Absent: those of `allowedOrigins`.
    std::optional<std::vector<std::string>> frame_ancestors;
    /// `monitorAddresses`: addresses and networks that need no password for `/monitor` and `/metrics`; others
    /// are answered 403 if no password is set. Empty: all may see these.
    std::vector<std::string> monitor_addresses;
    /// `monitorPassword`: of the user `operator`, for `/monitor` and `/metrics`. Empty: none is asked for.
    std::string monitor_password;
    std::filesystem::path
        operator_token_file; ///< `operatorTokenFile`. Empty: no operator requests over the network.
    /// `sessionSecret`: the file of a word that session and simulation servers share. Empty: no tickets.
    std::filesystem::path session_secret;
    std::filesystem::path operator_socket; ///< `operatorSocket`. Empty: see docs/access.md.

    bool operator==(AccessConfig const&) const = default;
};

/// The keys that SessionService obeys.
struct SessionServiceConfig
{
    SessionServiceConfig() = default;

    /// `gateway`: requests for `/2000/...` are passed on to the simulation server `host/2000`, those for
    /// `/machine/...` to machines that were found. Default: where an entry of `simulationServers` has
    /// `internal`.
    bool gateway = false;
    /// `controllerPort`: where controllers connect that are passed on to machines
    /// (`ServerSpec::controllers`); 0: nowhere.
    std::uint16_t controller_port = 0;
    /// `relay`: the session server takes `/client` itself, finds a machine when a browser asks for a
    /// simulation, and relays. Otherwise `/session` answers the address of a machine.
    bool relay = false;
    /// `waitingRoom`: with `relay`, how many browsers may wait for a machine; 0: none.
    int waiting_room = 1000;
    /// `sessionBurst` and `sessionRate`: requests for `/session` of each client
    /// (`IncomingRequest::quota_key`), at once and a second in the long run. Either 0: no limit.
    int session_burst = 200;
    double session_rate = 10;
    /// `decisionsForAll`: `/api/decisions` answers everybody, not the operator alone.
    bool decisions_for_all = false;
    std::string teacher_password; ///< `teacherPassword`: opens classes. Empty: nobody can.
    /// `teacherPasswordFile`, instead: its only line is the password. The program reads it, not the service.
    std::filesystem::path teacher_password_file;
    std::string viewer_url; ///< `viewerUrl`: the world that the viewer page proposes.
    /// `worlds`: what the gallery shows: worlds, and folders of worlds that machines find. Absent: all that
    /// they find. Empty: there is no gallery.
    std::optional<std::vector<ListedWorld>> worlds;
    Duration pause_hidden{}; ///< `pauseHidden`, in seconds; 0: simulations of hidden pages run on.
};

/// Mails to the operator, and how patient we are with the mail server.
struct MailConfig
{
    MailConfig() = default;

    /// `administrator`: the address that gets them. Empty: nobody; also when `mailServer` or `mailSender`
    /// is missing.
    std::string administrator;
    std::string server;            ///< `mailServer`: a name or an address.
    std::uint16_t server_port = 0; ///< `mailServerPort`; 0: 25.
    std::string sender;            ///< `mailSender`: an address.
    std::string user;              ///< `mailSenderUser`: for the login; the sender unless given.
    /// `mailSenderPassword`. Not empty: STARTTLS and a login, or no mail. Empty: neither.
    std::string password;
    Duration connect_timeout = std::chrono::seconds(5); ///< For the name and the connection.
    Duration timeout =
        std::chrono::seconds(20); ///< For the whole mail; some mail servers greet slowly on purpose.
};

/// `config/session/*.json` (protocol section 8.1).
struct SessionConfig
{
    SessionConfig() { address.port = 1999; }

    PublicAddress address; ///< `server`, `port` (required in files), `ssl` and `portRewrite`.
    /// `simulationServers`: required, except with `announcements`; `"host:port"`, `"host/port"` or
    /// `"host/path"`, or objects with `address`, `weight`, `drain`, `labels`, `internal` and `ports`.
    /// Addresses may be `dns:<name>:<port>`, `srv:<service>` and `announced`, see MachineDiscovery.
    std::vector<ServerSpec> simulation_servers;
    /// `announcements`: simulation servers that know `sessionSecret` may announce themselves.
    bool announcements = false;
    /// `nameServers`: who is asked for the names of `simulationServers`: addresses, with a port or
    /// without. Empty: those of the system.
    std::vector<std::string> name_servers;
    /// `discoverLoopback`: names and announcements may lead to this machine's loopback addresses.
    bool discover_loopback = false;
    NetworkConfig network;
    SessionServiceConfig service;
    MailConfig mail;
    HttpClientConfig http_client; ///< How simulation servers are asked.
    AccessConfig access;
    std::filesystem::path log_dir = "log"; ///< `logDir`
    bool debug = false;                    ///< `debug`: log to standard output instead of the file.
    bool json_log = false;                 ///< `logFormat`: `text`, or `json` for programs that collect logs.
    LoadMonitorParams polls;               ///< Its `tls` follows from `address`.
    /// `threshold` and `report_lifetime` follow from `polls`, and `seed` is random.
    SchedulerParams placement;
};

/// A forge of the configuration: where world URLs may point.
struct ForgeConfig
{
    ForgeConfig() = default;
    explicit ForgeConfig(std::string_view url) : url(url) {}

    /// Whether its projects are on another computer, at `url`. Otherwise they are in `directory`.
    bool is_server() const noexcept { return directory.empty(); }

    std::string url;                     ///< Base URL, without a slash at the end.
    std::filesystem::path directory;     ///< Of this computer; empty: see `is_server`.
    ForgeKind kind = ForgeKind::unknown; ///< `kind`; of forges that everybody knows `ForgeAddress` finds it.

    bool operator==(ForgeConfig const&) const = default;
};

/// The keys that the source of git repositories obeys, and how patient it is with their servers.
struct GitSourceConfig
{
    GitSourceConfig() = default;

    /// `cacheSize`, in gigabytes: fetched projects that are kept; the least recently used go first.
    std::uint64_t cache_bytes = std::uint64_t{10} << 30;
    LowSpeed low_speed;
    /// How long a server may take to say which commit a branch is at now, if the cache knows which it was at
    /// last: after that time, that one is used (`FetchedProject::notice`). Otherwise, and with servers
    /// without version 2 of git's protocol, `low_speed` and `FetchLimits::timeout` count.
    Duration patience = std::chrono::seconds(10);
};

/// The keys that the source of websites' projects obeys, and how patient it is with websites.
struct WebsiteSourceConfig
{
    WebsiteSourceConfig() = default;

    /// `projectsDir`: folder of the templates that websites start with `init`. Empty in a file: those that
    /// came with Webots.
    std::filesystem::path projects;
    /// `keyDir`: folder with a file for each website, named as its host, whose first line is our key. Read
    /// anew for each fetch. Other websites are sent nothing. Default of a file, and of `SimulationConfig`:
    /// key.
    std::filesystem::path keys;
    LowSpeed low_speed;
};

/// The keys that SimulationLauncher obeys, and how patient it is with simulators.
struct SimulationLauncherConfig
{
    SimulationLauncherConfig() = default;

    /// `maxConnections`: how many simulations may run at once, each with a port of its own; in a file
    /// at most as many as there are ports after `port`.
    int max_simulations = 100;
    /// `timeout`, in seconds: how long a simulation may run; the browser is told. In files less than 360
    /// counts as 7200.
    Duration timeout = std::chrono::hours(2);
    Duration extendable{}; ///< In seconds: by how much browsers may extend `timeout`, in all.
    /// `startTimeout`, in seconds: from the start of the program until it is ready; some worlds take minutes
    /// to load. With containers, from the last line that compose printed, since it may have to pull an image
    /// and to build.
    Duration start_timeout = std::chrono::minutes(5);
    /// `gateway`: browsers reach simulations through the server's own port, which then answers `Forward`;
    /// `false`: at their own ports. Those of Webots R2021b and older that speak TLS are always reached at
    /// their own. Default of a file, and of `SimulationConfig`: true; here it is false, since the adapter has
    /// to know `Forward`.
    bool gateway = false;
    /// `simulatorEnvironment`: `NAME` and `PREFIX_*` of the server's environment, and `NAME=value`, for
    /// simulators.
    std::vector<std::string> simulator_environment;
    std::string multimedia_server; ///< `multimediaServer`: of Janus, for Webots R2021b and older.
    std::string multimedia_stream; ///< `multimediaStream`: where Janus takes the stream, `<host>:<port>`.
    Duration grace = std::chrono::milliseconds(1500); ///< From SIGTERM to SIGKILL.
};

/// The keys that DockerMode obeys: how simulations run in containers.
struct DockerConfig
{
    DockerConfig() = default;

    /// `dockerDir`: the folder with the operator's `docker-compose-*.yml`, `Dockerfile.default` and
    /// `seccomp.json`. Default: the folder `docker` beside the configuration.
    std::filesystem::path directory = "docker";
    std::string images = "cyberbotics/webots.cloud"; ///< `dockerImages`: of Webots, without a tag.
    /// `projectDockerfiles`: a project's own `Dockerfile` is built in place of ours. Its compose file is
    /// never used.
    bool project_dockerfiles = false;
    /// `buildNetwork`: where simulators have a network of their own, what a `Dockerfile` of a project runs
    /// while it is built still reaches what Docker's network reaches, private networks among it.
    bool build_network = false;
    /// `buildCache`, in bytes (gigabytes in the file): images that are kept of builds, since they make the
    /// next ones fast, may take as much; 0: no limit.
    std::uint64_t build_cache = std::uint64_t{20} << 30;
    /// `persistantDockerImages`: present, unused images older than two days are removed, but these
    /// (`repository:tag`).
    std::optional<std::vector<std::string>> persistent_images;

    bool operator==(DockerConfig const&) const = default;
};

/// What one simulation may use; 0: as much as it likes.
struct LimitsConfig
{
    LimitsConfig() = default;

    /// `simulationMemory`, in bytes (megabytes in the file). Absent: a quarter of the machine's memory, but
    /// at least 2 GiB and at most 16 GiB.
    std::optional<std::uint64_t> memory;
    double processors = 0; ///< `simulationCpus`.
    /// `simulationProcesses`; threads count as well. Absent: 1024, and 64 more for each processor.
    std::optional<std::uint64_t> processes;
    std::uint64_t files = 4096; ///< `simulationFiles`: that each of its processes may have open.
    /// `simulationDisk`, in bytes (megabytes in the file): its folder.
    std::uint64_t disk = std::uint64_t{4} << 30;

    bool operator==(LimitsConfig const&) const = default;
};

/// What a job of Slurm asks for. An empty text: what Slurm gives those who don't ask.
struct SlurmJobConfig
{
    SlurmJobConfig() = default;

    std::string partition;
    std::string account;
    std::string qos;
    std::string gres;         ///< As in `gpu:1`.
    std::uint64_t memory = 0; ///< `memory`, in megabytes, of the job; 0: what Slurm gives.
    int processors = 1;
    Duration time_limit{}; ///< `timeLimit`, in seconds; 0: as long as `timeout` and `extendable` need.

    bool operator==(SlurmJobConfig const&) const = default;
};

/// `overrides`: what other jobs ask for.
struct SlurmOverrideConfig
{
    SlurmOverrideConfig() = default;

    std::string mode;   ///< Of simulations in this mode; empty: in any.
    std::string label;  ///< Of projects that need this label; empty: of all.
    SlurmJobConfig job; ///< What the entry doesn't say is as in `SlurmConfig::job`.

    bool operator==(SlurmOverrideConfig const&) const = default;
};

/// `launcher.slurm`: simulations are jobs of a Slurm cluster; and how often that is asked.
struct SlurmConfig
{
    SlurmConfig() = default;

    SlurmJobConfig job;
    std::vector<SlurmOverrideConfig> overrides; ///< The first that fits counts.
    /// `copyTo`: a folder of each node, absolute, that projects are copied into. Empty: the nodes see
    /// those of the server.
    std::filesystem::path copy_to;
    /// How often Slurm is asked for all jobs together, while there are any, and for the nodes.
    Duration interval = std::chrono::seconds(5);

    bool operator==(SlurmConfig const&) const = default;
};

/// Whose worlds run here (protocol section 4.1.2, step 3).
struct RepositoryRules
{
    RepositoryRules() = default;

    std::vector<std::string> allowed; ///< `allowedRepositories`: URL prefixes that are always accepted.
    std::vector<std::string> blocked; ///< `blockedRepositories`: prefixes refused where idle time is shared.
    /// `shareIdleTime`, percent: the highest load at which others than `allowed` are accepted; 0: never.
    double share_idle_time = 50;

    bool operator==(RepositoryRules const&) const = default;
};

/// A world of which simulations are kept ready before anybody asks for them.
struct StagedWorldConfig
{
    StagedWorldConfig() = default;

    std::string url;            ///< As browsers name it in `start`.
    std::string mode = "mjpeg"; ///< As in `start`.
    int count = 1;              ///< How many are to be ready.

    bool operator==(StagedWorldConfig const&) const = default;
};

/// The keys that SimulationService obeys, and how patient it is with browsers.
struct SimulationServiceConfig
{
    SimulationServiceConfig() = default;

    /// How long a simulation waits for a browser that lost its connection; `returns`: which has said in
    /// `start` that it returns, also when its page was reloaded.
    Duration grace(bool returns) const
    {
        return reconnect_grace.value_or(returns ? std::chrono::seconds(30) : Duration::zero());
    }

    /// How many of a server's `max_simulations` one client may have; 0: no limit. By default three quarters:
    /// a class behind one address has room, and leaves some to others.
    int limit_of_an_address(int max_simulations) const
    {
        return simulations_per_address.value_or((3 * max_simulations + 3) / 4);
    }

    RepositoryRules repositories;
    /// `simulationsPerAddress`: how many simulations a client (`IncomingRequest::quota_key`) may have at
    /// once; 0: any number. Absent: see `limit_of_an_address`.
    std::optional<int> simulations_per_address;
    int simulations_per_world = 0; ///< `maxSimulationsPerWorld`: of one world at once; 0: any number.
    /// `reconnectGrace`, in seconds: how long a lost browser may return. Absent: 30 seconds for pages
    /// that say that they return, and no time for others.
    std::optional<Duration> reconnect_grace;
    /// `trafficLimit`: bytes per second, of all that browsers and one simulation say to each other
    /// through the server; 0: any number.
    std::uint64_t traffic_limit = 0;
    /// `allowEdit`: whether pages may change the programs of their simulations, in its own copy of the
    /// project.
    bool allow_edit = false;
    /// `controllerPort`: where controllers on other machines connect; 0: nowhere. Simulators are asked which
    /// of their robots wait for one.
    std::uint16_t controller_port = 0;
    /// `controllerAddress`: `<host>:<port>` by which they reach it. Empty: the server's name and
    /// `controller_port`.
    std::string controller_address;
    /// `controllerRepositories`: URL prefixes of the worlds whose robots may be controlled so.
    std::vector<std::string> controller_repositories;
    std::vector<StagedWorldConfig> staged; ///< `staged`: the first ones matter most.
    /// `stagedMaxAge`, in seconds: after that a staged simulation is replaced.
    Duration staged_max_age = std::chrono::minutes(10);
    /// `stagedForClasses`: how many simulations session servers may have staged here for their classes.
    int staged_for_classes = 30;
    /// `notify`: registries that are told of this server; a string or a list, `[]` for none. A file
    /// without the key means that of webots.cloud; a program that makes its configuration itself
    /// registers nowhere.
    std::vector<std::string> notify;
    std::string title;           ///< `title` of the monitor page; empty: a standard one.
    std::string description;     ///< `description` on the monitor page.
    bool reference_load = false; ///< `loadFormula`: `reference`, the one of the Python servers, not `strict`.
    /// From the opening of a socket to its `start`.
    Duration handshake_timeout = std::chrono::seconds(30);
    /// Sockets that have not started anything yet: of one client, and of all; not by `apply`. With one more,
    /// the oldest is closed. Browsers send `start` within a round trip, so this is far more than they need.
    std::size_t silent_per_address = 64;
    std::size_t max_silent = 256;
};

/// `config/simulation/*.json` (protocol section 8.2).
struct SimulationConfig
{
    SimulationConfig()
    {
        address.port = 2000;
        launching.gateway = true;
        websites.keys = "key";
        forges.emplace_back("https://github.com");
    }

    /// `server` (or its older name `fullyQualifiedDomainName`), `port`, `ssl` and `portRewrite`.
    PublicAddress address;
    NetworkConfig network;
    AccessConfig access;
    SimulationServiceConfig service;
    SimulationLauncherConfig launching;
    bool docker = false; ///< `docker`: simulations run in containers.
    DockerConfig containers;
    std::optional<SlurmConfig> slurm; ///< `launcher`: where simulations run. Default: on this machine.
    std::vector<ForgeConfig> forges;  ///< `forges`: strings, or objects with `url`, `directory`, `kind`.
    HttpClientConfig http_client;     ///< How forges, websites and registries are asked.
    /// `sessionServers`: URLs of session servers to which this server announces itself, with
    /// `sessionSecret`.
    std::vector<std::string> session_servers;
    GitSourceConfig git;
    WebsiteSourceConfig websites;
    /// `stateDir`: what the server works with, projects of running simulations above all. Empty: the
    /// folder that systemd names (`STATE_DIRECTORY`), else `webots_cloud` in `XDG_STATE_HOME` or
    /// `~/.local/state`, else one in the folder for temporary files (docs/machine.md, "Files and
    /// folders").
    std::filesystem::path state_dir;
    /// `fetchMemory`, in megabytes, and `fetchDisk`, in gigabytes: what all fetches of projects together
    /// may take.
    std::uint64_t fetch_memory = std::uint64_t{1} << 30;
    std::uint64_t fetch_disk = std::uint64_t{8} << 30;
    std::filesystem::path webots_home; ///< `webotsHome`
    std::vector<std::string> labels;   ///< `labels`: what this machine can run, as in `gpu`.
    /// `display`: what Webots draws on, or `private`: each simulation has a virtual display, or `none`.
    /// Empty: what `DISPLAY` says; else `:0`, or `private` where that is not there.
    std::string display;
    /// `sandbox`: `auto`, `none`, `bubblewrap`, `firejail`, or `docker`, which is the same as `docker`.
    std::string sandbox = "auto";
    /// `simulationUser`: who runs simulations: `auto`, `none` (the server's user), `subordinate`, or the
    /// name of a user.
    std::string simulation_user = "auto";
    /// `confineServer`: what handles requests and projects can open only the server's own files, where
    /// the kernel has Landlock.
    bool confine_server = true;
    std::string network_reach = "internet"; ///< `network`: what simulations in a sandbox reach:
                                            ///< `internet` (public addresses), `none`, `host`.
    LimitsConfig limits;                    ///< `simulationMemory` and the like.
    std::filesystem::path log_dir = "log";  ///< `logDir`
    bool debug = false;                     ///< `debug`: log to standard output instead of the file.
    bool json_log = false; ///< `logFormat`: `text`, or `json` for programs that collect logs.
    Duration simulation_log_keep =
        std::chrono::hours(24 * 7); ///< `simulationLogDays`, in days; 0: none is written.
    bool monitor_log = true; ///< `monitorLogEnabled`: `<logDir>/simulation/monitor.csv`, a line a second.
};

/// A configuration and what an operator should know about it.
template<class Config>
struct Configured
{
    Configured() = default;

    Config config;
    std::vector<std::string> warnings; ///< A sentence each: unknown keys, values that were replaced.
    std::vector<std::string> notes;    ///< A sentence each: what people may miss although nothing is wrong.
};

/// Reads a configuration. `origin` is the file's name, for messages; relative `directory`s of forges
/// start at its folder.
///
/// `~` and `$NAME` are expanded in paths.
/// Errors: `invalid_config`, a line for each fault with file, line, column, key, wanted and found.
result<Configured<SessionConfig>> parse_session_config(std::string_view text,
                                                       std::filesystem::path const& origin);
result<Configured<SimulationConfig>> parse_simulation_config(std::string_view text,
                                                             std::filesystem::path const& origin);

} // namespace webots_cloud
