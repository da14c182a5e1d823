// The real transports: every adapter is reached through one of these functions, and the library behind it
// stays hidden.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/own_files.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/folder_meter.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/name_service.hpp>
#include <webots_cloud/transport/notifier.hpp>
#include <webots_cloud/transport/process_host.hpp>
#include <webots_cloud/transport/project_source.hpp>
#include <webots_cloud/transport/service_manager.hpp>
#include <webots_cloud/transport/simulation_logs.hpp>
#include <webots_cloud/transport/text_files.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// 32 hexadecimal digits from the random numbers of the operating system: nobody guesses them.
std::string make_token();

/// Bytes from the random numbers of the operating system.
std::string random_bytes(std::size_t size);

/// As `make_token`, but 28 lower-case letters: for addresses of simulations, which may have no other digits
/// than those of ports.
std::string make_address_token();

/// The clock of this computer.
std::unique_ptr<Clock> make_steady_clock(boost::asio::any_io_executor executor);

/// HTTP over Boost.Beast and OpenSSL: certificates are verified; one connection per server is kept, by TLS
/// for ten minutes at most, so that certificates are verified again and again.
///
/// `authorities`: a PEM file of certificates that are trusted besides the system's authorities, read again
/// when it changes (`log` says so); empty: none. If it is unusable, requests by https fail: see
/// `check_authorities`.
std::unique_ptr<HttpClient> make_http_client(boost::asio::any_io_executor executor,
                                             std::filesystem::path authorities = {}, Logger log = Logger());

/// WebSockets over Boost.Beast and OpenSSL, without compression. Another side that says nothing is pinged
/// after 30 s; the connection is lost when it has said nothing for 60 s, or when what it said has not been
/// received for so long. It has 5 s to take what is queued, and to answer, when a channel is closed.
///
/// `authorities`, `log`: as for `make_http_client`.
std::unique_ptr<WebSocketClient> make_websocket_client(boost::asio::any_io_executor executor,
                                                       std::filesystem::path authorities = {},
                                                       Logger log = Logger());

/// Where an HTTP server listens, and what it grants its clients.
struct HttpServerParams
{
    HttpServerParams() = default;

    std::string address = "::"; ///< Where to listen; `::` is every address, of IPv4 too.
    std::uint16_t port = 0;     ///< 0: any free one, see `HttpServer::port`.
    /// PEM files of the certificate, with its chain, and its key. Empty: plain HTTP. They are read again when
    /// they change; connections that exist keep the certificate that they were made with.
    std::filesystem::path tls_certificate;
    std::filesystem::path tls_key;
    /// PEM file of certificates that are trusted besides the system's authorities, where requests are passed
    /// on by TLS (`Upstream::tls`). It is read again when it changes.
    std::filesystem::path tls_authorities;
    std::size_t queue_bytes =
        256 * 1024; ///< Waiting for a browser that does not read; more, and it is dropped.
    std::size_t message_bytes =
        64 * 1024; ///< The longest message of a browser; a longer one closes with 1009.
    /// More are answered 503 (or just closed, with TLS). Three quarters of all connections that the limit of
    /// open files allows, if that is less.
    std::size_t connections_per_address = 1000;
    /// Of all bodies of requests together that are in memory, in bytes, and a quarter of it for each client;
    /// who sends more is answered 503.
    std::size_t body_bytes = std::size_t{64} << 20;
    /// Addresses and networks, as in `10.0.0.0/8`, of proxies. The limit is not theirs, and what they say of
    /// their clients in X-Forwarded-For (or Forwarded) is believed. Default: this computer.
    std::vector<std::string> trusted_proxies{"127.0.0.0/8", "::1"};
    std::size_t max_connections = SIZE_MAX; ///< Fewer where the limit of open files is lower.
    std::size_t spare_descriptors =
        64; ///< Of the limit of open files, kept for everything that is no connection.
    Duration header_timeout =
        std::chrono::seconds(10); ///< For a TLS handshake, a request's headers, an answer to our close.
    Duration body_timeout = std::chrono::seconds(30);  ///< For a whole body.
    Duration idle_timeout = std::chrono::seconds(75);  ///< Between two requests of one connection.
    Duration write_timeout = std::chrono::seconds(30); ///< To take an answer.
    Duration ping_after =
        std::chrono::seconds(30); ///< A WebSocket silent for that long is pinged, again and again.
    Duration pong_timeout = std::chrono::seconds(30); ///< From the first ping to being dropped. 0: never.
    Duration stop_timeout =
        std::chrono::seconds(1); ///< For browsers to answer our close when the server stops.
    // Of requests that are passed on (`Forward`)
    Duration connect_timeout = std::chrono::seconds(5); ///< To reach the other server.
    Duration answer_timeout = std::chrono::seconds(30); ///< For it to begin its answer.
    /// A tunnel on which nobody says anything for that long is closed. A peer that has vanished is found out
    /// within two minutes without it (TCP keepalive); and a side that does not take what it is sent, or
    /// waits for the other one to end, has `write_timeout`.
    Duration tunnel_idle_timeout = std::chrono::hours(1);
};

/// What a server has seen of the network. All but the first three are counts since it was made.
struct HttpServerStatistics
{
    HttpServerStatistics() = default;

    std::uint64_t connections = 0; ///< Open now, WebSockets and tunnels included.
    std::uint64_t websockets = 0;  ///< Open now.
    std::uint64_t tunnels = 0;     ///< Open now: browsers that are relayed to other servers.
    std::uint64_t accepted = 0;
    std::uint64_t requests = 0; ///< Whose headers were complete and good; WebSocket handshakes too.
    // Connections refused or ended by us
    std::uint64_t refused_address = 0; ///< Too many from one address.
    std::uint64_t refused_no_room = 0; ///< No descriptor was left, and no connection could make room.
    std::uint64_t made_room = 0;       ///< Silent ones closed so that others find a descriptor.
    std::uint64_t timed_out = 0;       ///< A deadline passed: silent, slow to ask or slow to take the answer.
    std::uint64_t tls_failures = 0;    ///< Handshakes that failed.
    std::uint64_t slow_readers = 0;    ///< WebSockets whose queue was full.
    std::uint64_t dead_peers = 0;      ///< WebSockets that did not answer a ping.
    // Requests and messages refused
    std::uint64_t bad_requests = 0;       ///< 400 and 505
    std::uint64_t refused_bodies = 0;     ///< 413
    std::uint64_t long_request_lines = 0; ///< 414
    std::uint64_t long_headers = 0;       ///< 431
    std::uint64_t bad_handshakes = 0;     ///< 400 and 426 to those who want a WebSocket.
    std::uint64_t bad_frames = 0;         ///< WebSockets closed with 1002, 1007 or 1009.
    // Passed on to other servers
    std::uint64_t forwarded = 0;             ///< Requests.
    std::uint64_t tunnel_bytes_received = 0; ///< From browsers, requests included.
    std::uint64_t tunnel_bytes_sent = 0;     ///< To browsers, answers included.
    std::uint64_t bad_gateways = 0;          ///< 502: the other server was not reached, or made no sense.
    std::uint64_t late_gateways = 0;         ///< 504: it was too slow.
    // TLS handshakes with other servers
    std::uint64_t upstream_tls_full = 0;     ///< Their certificate was verified.
    std::uint64_t upstream_tls_resumed = 0;  ///< It had been, for an earlier connection.
    std::uint64_t upstream_tls_failures = 0; ///< It is not to be trusted, or they speak no TLS.
    /// When our certificate expires; none without TLS.
    std::optional<WallTime> certificate_expires;
};

/// Serves an endpoint to the network.
class HttpServer
{
public:
    virtual ~HttpServer() = default;

    /// Listens and has `endpoint` answer until cancelled, then closes every WebSocket with 1001 and waits for
    /// the conversations to end. Once.
    ///
    /// Lifetime: `endpoint` must outlive the operation.
    /// Errors: `operation_aborted` when cancelled; `unavailable` when the port is in use.
    virtual boost::asio::awaitable<result<>> run(Endpoint& endpoint) = 0;

    /// Opens the port; `run` does so itself if need be.
    ///
    /// Errors: `unavailable`, naming the port; `invalid_config`, naming a file of the certificate, or an
    /// entry of `trusted_proxies`, that is unusable.
    virtual result<> listen() = 0;

    /// The port that is listened on.
    /// Precondition: `listen` succeeded.
    virtual std::uint16_t port() const = 0;

    virtual HttpServerStatistics statistics() const = 0;
};

/// HTTP/1.1 and WebSocket, plain or with TLS 1.2 and 1.3.
std::unique_ptr<HttpServer> make_http_server(boost::asio::any_io_executor executor, HttpServerParams params,
                                             Logger log);

/// A Unix socket on which the operator asks what nobody else may: every request there is
/// `IncomingRequest::is_operator`.
class OperatorSocket
{
public:
    virtual ~OperatorSocket() = default;

    /// Errors: `unavailable`, naming the socket. The server can do without: `run` then only waits for its
    /// cancellation.
    virtual result<> listen() = 0;

    /// Has `endpoint` answer until cancelled.
    ///
    /// Lifetime: `endpoint` must outlive the operation.
    /// Errors: `operation_aborted`.
    virtual boost::asio::awaitable<result<>> run(Endpoint& endpoint) = 0;
};

/// Only root and the user of this process are answered, and of their processes none that this one has
/// started, such as simulations. A socket that a dead server has left is replaced.
std::unique_ptr<OperatorSocket> make_operator_socket(boost::asio::any_io_executor executor,
                                                     std::filesystem::path path, Logger log);

/// The body of the answer to a request over the operator's socket of a running server. Waits for it, 5 s at
/// most.
///
/// Errors: `unreachable`: no server is there; `refused`, `timed_out`, `invalid_argument`.
result<std::string> ask_operator_socket(std::filesystem::path const& path, std::string_view method,
                                        std::string_view target);

/// What tells the operator's token from other words. `file` has one line: the token, or `sha256:` and the 64
/// hexadecimal digits of its SHA-256, so that who reads the file does not know the token.
///
/// Errors: `invalid_config`: the file can't be read, others may read it too, or a token is shorter than 16
/// characters.
result<std::function<bool(std::string_view token)>>
make_operator_token_check(std::filesystem::path const& file);

/// The teachers' password, the only line of `file`.
///
/// Errors: `invalid_config`: the file can't be read, others may read it too, or the password is shorter than
/// 8 characters.
result<std::string> read_password(std::filesystem::path const& file);

/// Names of `/etc/hosts` and DNS, by c-ares. `servers`: who is asked instead of those of `/etc/resolv.conf`:
/// numeric addresses, with a port or without.
std::unique_ptr<NameService> make_name_service(boost::asio::any_io_executor executor,
                                               std::vector<std::string> const& servers = {});

/// The code that authenticates tickets: HMAC-SHA256, 32 bytes, with the word in `file` as the secret.
///
/// Errors: `invalid_config`, as `make_operator_token_check`.
result<std::function<std::string(std::string_view message)>>
make_ticket_mac(std::filesystem::path const& file);

/// The same with a secret that nobody else has to know: a random word in `file`, which is made where there is
/// none. `log` is told where it can't be kept: then another one is made at the next start.
std::function<std::string(std::string_view message)> make_own_mac(std::filesystem::path const& file,
                                                                  Logger const& log);

/// All bytes of a regular file. Never waits for anybody, whatever stands there.
///
/// Errors: `unavailable`, its detail the reason alone, as "it is larger than <limit> bytes".
result<std::string> read_regular_file(std::filesystem::path const& path, std::size_t limit);

/// Whether a server could show a certificate (its chain after it) with its key, both PEM files.
///
/// Errors: `invalid_config`, naming the file that is unusable.
result<> check_certificate(std::filesystem::path const& certificate, std::filesystem::path const& key);

/// Whether a PEM file has certificates that could be trusted.
///
/// Errors: `invalid_config`, naming the file.
result<> check_authorities(std::filesystem::path const& authorities);

/// Folders of this computer, measured on a thread of its own.
std::unique_ptr<FolderMeter> make_folder_meter();

/// Where control groups are found.
struct ControlGroupsParams
{
    ControlGroupsParams() = default;

    bool enabled = true; ///< False: none are made.
    std::filesystem::path mounts = "/proc/self/mountinfo";
    std::filesystem::path own_group = "/proc/self/cgroup"; ///< The file that names ours.
    /// With version 2, groups may be made beside all others where our own group has other programs in it.
    bool may_use_root = false;
};

/// Groups of processes that the kernel keeps within limits: one for each program that has limits.
class ControlGroups;

/// Tries what works here. Those that a killed server has left are removed.
std::shared_ptr<ControlGroups> make_control_groups(ControlGroupsParams const& params = ControlGroupsParams());

LimitSupport limit_support(ControlGroups const& groups);

/// Folders that programs in such groups must not be able to change, lest they leave them.
std::vector<std::filesystem::path> control_group_mounts(ControlGroups const& groups);

/// Processes of this computer over Boost.Process, each under a guard (the program `webots-process-guard`)
/// that ends the whole tree when asked to, when the process ends, and when we die, however we die.
///
/// The processes can't change the existing folders `read_only`, where the kernel allows a mount namespace:
/// see `probe_guard`. `groups` keep them within their limits; null: that is up to who looks at
/// `Process::usage`. `graphics`: what that knows of graphics processors; null: nothing.
std::unique_ptr<ProcessHost> make_process_host(boost::asio::any_io_executor executor,
                                               std::filesystem::path guard,
                                               std::vector<std::filesystem::path> read_only = {},
                                               std::shared_ptr<ControlGroups> groups = nullptr,
                                               std::shared_ptr<GraphicsTimes const> graphics = nullptr);

/// What that guard can do here, as its option `--probe` prints it: one line, which is no stable format. Not
/// empty: the guard can be run.
///
/// Errors: `start_failed`, `timed_out` after 15 seconds.
/// Cancellation: terminal.
boost::asio::awaitable<result<std::string>>
probe_guard(std::filesystem::path guard, std::vector<std::filesystem::path> read_only, Clock& clock);

/// The IPv4 addresses of this computer, loopback included, each once.
std::vector<std::string> own_ipv4_addresses();

/// The same of IPv6.
std::vector<std::string> own_ipv6_addresses();

/// A user of this computer.
struct Account
{
    Account() = default;

    std::uint32_t user = 0;
    std::uint32_t group = 0;
    std::vector<std::uint32_t> groups; ///< All that the user is in, but `group`.
};

/// Looks a user up by name; nothing where there is none. May block, as for users from a directory service.
std::optional<Account> find_account(std::string const& name);

/// The name of a user; empty: there is none. May block, too.
std::string find_user_name(std::uint32_t user);

/// From now on the calling thread, and every thread and program that it starts, can open no other files than
/// these (Landlock), executes no programs, mounts nothing, gains no privileges, signals nobody outside unless
/// that is asked for, and can't look into processes outside. What is open already stays usable. Files that do
/// not exist yet can't be among them; those in a folder may come later. Other threads stay as they are.
///
/// Errors: `unavailable`: the kernel can't do that, and nothing has changed.
result<> confine_to_files(OwnFiles const& files);

/// A thread that mounts and unmounts for all others while it exists, for which it has to be made before they
/// are confined to files.
class MountThread;
std::shared_ptr<MountThread> make_mount_thread();

/// Files of this computer, on a thread of its own.
std::unique_ptr<TextFiles> make_text_files();

/// Projects in plain folders of this computer: `<folder>/<owner>/<repository>/[<folder>/]worlds/<file>.wbt`,
/// copied.
///
/// The part of the world's URL that names a branch is ignored: a plain folder is what it is.
std::unique_ptr<ProjectSource> make_directory_source(std::filesystem::path folder);

/// What all fetches of projects together may take: memory and disk. Who does not fit waits, or is refused.
class FetchBudget;

/// In bytes. What is fetched already is not counted but for the memory that its index needs while it is used.
std::shared_ptr<FetchBudget> make_fetch_budget(std::uint64_t memory = std::uint64_t{1} << 30,
                                               std::uint64_t disk = std::uint64_t{8} << 30);

/// Where fetched repositories are kept, and how patient we are with their servers.
struct GitSourceParams
{
    GitSourceParams() = default;

    std::filesystem::path cache; ///< Folder for what was fetched; made if need be.
    std::uint64_t cache_bytes = std::uint64_t{10}
                                << 30; ///< Default 10 GiB; the least recently used go first.
    /// The existing folder in which the directories of orders will be: the fastest way to hand out a project
    /// there (overlay mounts, reflinks, copies) is found by trying when the source is made, and logged.
    /// Default: empty, projects are copied.
    std::filesystem::path instances;
    std::uint64_t low_speed = 1'000; ///< Bytes per second. A server that stays below is given up; 0: never.
    Duration low_speed_time = std::chrono::seconds(60); ///< For how long it may.
    /// How long a server may take to say which commit a branch is at now, if the cache knows which it was at
    /// last: after that time, that one is used, and `FetchedProject::notice` says so. Where the cache knows
    /// nothing, `FetchLimits::timeout` alone counts.
    Duration patience = std::chrono::seconds(10);
    /// PEM file of certificates that are trusted besides the system's authorities; empty: none. Read when the
    /// source is made; what can't be read is not trusted.
    std::filesystem::path authorities;
};

/// Projects in git repositories over HTTP(S). `budget`: shared with other sources; null: one of its own.
std::unique_ptr<ProjectSource> make_git_source(boost::asio::any_io_executor executor, GitSourceParams params,
                                               Logger log, std::shared_ptr<FetchBudget> budget = nullptr);

/// Where the templates of websites and our keys for these are, and how patient we are with them.
struct WebsiteSourceParams
{
    WebsiteSourceParams() = default;

    std::filesystem::path projects; ///< Folder of the templates.
    /// Folder with a file for each website, named as its host, whose first line is our key. Read anew for
    /// each fetch. Other websites are sent nothing.
    std::filesystem::path keys;
    std::uint64_t low_speed = 1'000; ///< Bytes per second. A website that stays below is given up; 0: never.
    Duration low_speed_time = std::chrono::seconds(60); ///< For how long it may.
    std::filesystem::path authorities;                  ///< As in `GitSourceParams`.
};

/// The projects that `init` asks for (`FetchOrder::website`): a copy of the template and, for a user of the
/// website, the zip file that it answers with laid over it. Certificates are verified. `budget`: as above.
///
/// Errors besides those of `ProjectSource`: `refused`.
std::unique_ptr<ProjectSource> make_website_source(WebsiteSourceParams params, Logger log,
                                                   std::shared_ptr<FetchBudget> budget = nullptr);

/// A mailbox of the operator, and the mail server that takes mails for it.
struct SmtpParams
{
    SmtpParams() = default;

    std::string host;       ///< A name or an address.
    std::uint16_t port = 0; ///< 0: 25.
    std::string sender;     ///< An address.
    std::string recipient;  ///< An address.
    std::string user;       ///< For the login.
    /// Not empty: STARTTLS and a login, or no mail. Empty: neither.
    std::string password;
    std::string own_name = "localhost";                 ///< What we call ourselves in EHLO.
    Duration connect_timeout = std::chrono::seconds(5); ///< For the name and the connection.
    Duration timeout =
        std::chrono::seconds(20); ///< For the whole mail; some mail servers greet slowly on purpose.
};

/// E-mail over SMTP with libcurl, loaded by this. Certificates are verified against those of this computer,
/// or of the file that `SSL_CERT_FILE` names.
/// Errors: `invalid_argument`: host, sender or recipient is unusable; `unavailable`: no libcurl.
result<std::unique_ptr<Notifier>> make_smtp_notifier(SmtpParams params);

/// The service manager that the environment names (`NOTIFY_SOCKET`, `WATCHDOG_USEC`), as systemd does;
/// without one it hears nothing.
std::unique_ptr<ServiceManager> make_service_manager();

/// Where the state of this computer is found.
struct HostMetricsParams
{
    HostMetricsParams() = default;

    std::filesystem::path control_groups = "/sys/fs/cgroup";       ///< Where they are mounted.
    std::filesystem::path own_control_group = "/proc/self/cgroup"; ///< The file that names ours.
    std::string nvidia_library = "libnvidia-ml.so.1";              ///< Loaded if there is one.
};

/// This computer, as `/proc`, control groups and the NVIDIA library describe it. With that library it may
/// take three seconds to make.
std::unique_ptr<HostMetrics> make_host_metrics(HostMetricsParams params = HostMetricsParams());

/// Where a log is written, and how.
struct LogParams
{
    LogParams() = default;

    std::filesystem::path file; ///< Rotated at 500 000 bytes with 10 old files; empty: standard output.
    bool debug = false;         ///< Debug lines too.
    bool json = false;          ///< An object a line, with `time` (ISO 8601, UTC), `level` and `message`.
};

/// A log in the format that operators know, `YYYY-MM-DD HH:MM:SS,mmm [LEVEL  ]  message`, or in JSON.
/// Errors: `invalid_argument`.
result<Logger> make_logger(LogParams params);

/// A file that grows line by line, written by a thread of its own: the function it returns never blocks.
/// Copies share the file.
///
/// An existing file is emptied; folders are made. A file that can't be opened or written costs one line of
/// the log, which calls it `name`, and then lines are dropped; the function is empty when it could not even
/// be opened.
std::function<void(std::string line)> make_line_file(boost::asio::any_io_executor executor, std::string name,
                                                     std::filesystem::path file, std::string first_line,
                                                     Logger log);

/// Where the output of simulators is kept, and for how long.
struct SimulationLogsParams
{
    SimulationLogsParams() = default;

    std::filesystem::path folder; ///< Made when the first log is opened.
    Duration keep =
        std::chrono::hours(24 * 7); ///< Since the last line. Default a week: people complain on Mondays.
    std::size_t max_logs = 1000;    ///< Logs that are kept at most; the oldest go first.
};

/// Files `<date>_<time>_<simulation>.log` of at most 576 KiB: the first 512 KiB of an output and the last 64
/// KiB. Written by a thread of its own; a file that can't be written costs one line of `log`.
///
/// Lifetime: `clock` must outlive it.
std::unique_ptr<SimulationLogs> make_simulation_logs(boost::asio::any_io_executor executor,
                                                     SimulationLogsParams params, Clock& clock, Logger log);

} // namespace webots_cloud
