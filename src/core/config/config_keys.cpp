#include "config_keys.hpp"

#include <array>

namespace webots_cloud::core {
namespace {

constexpr double max_seconds = 10'000'000;
constexpr double max_gigabytes = 100'000;
constexpr double highest_port = 65'535;
constexpr double max_limit = 1'000'000'000; // of memory, processes, ...

constexpr std::array<std::string_view, 2> log_formats{"text", "json"};
constexpr std::array<std::string_view, 4> policies{"least_committed", "least_reported", "random",
                                                   "power_of_two"};
constexpr std::array<std::string_view, 5> sandboxes{"auto", "none", "bubblewrap", "firejail", "docker"};
constexpr std::array<std::string_view, 3> reaches{"internet", "none", "host"};
constexpr std::array<std::string_view, 2> load_formulas{"strict", "reference"};

constexpr ConfigKey schema_key{
    .name = "$schema",
    .text = "where editors find the description of the keys, by which they complete and check them; "
            "`config/session.schema.json` and `config/simulation.schema.json` are installed with the servers",
    .reloaded = true};

constexpr std::array secure_keys{
    ConfigKey{
        .name = "sslCertificate",
        .type = KeyType::path,
        .text = "PEM file of the certificate: with it and `sslKey` the server itself speaks TLS 1.3 and 1.2 "
                "(with forward secrecy), and reloads renewed files while it runs"},
    ConfigKey{.name = "sslKey", .type = KeyType::path, .text = "PEM file of the key of `sslCertificate`"},
    ConfigKey{.name = "redirectPort",
              .type = KeyType::integer,
              .text =
                  "with TLS: a port, usually 80, where every request is sent to the same address by https",
              .standard = "0",
              .max = highest_port},
    ConfigKey{.name = "challengeFolder",
              .type = KeyType::path,
              .text =
                  "with `redirectPort`: the folder in which `certbot --webroot` puts what it wants to find "
                  "at that port"},
};

constexpr std::array connection_keys{
    ConfigKey{.name = "listenAddress",
              .text = "numeric address of this machine at which the server's ports are opened; `::` is all, "
                      "and with `127.0.0.1` only this machine reaches them",
              .standard = R"("::")"},
    ConfigKey{.name = "connectionsPerAddress",
              .type = KeyType::integer,
              .text =
                  "maximum number of connections from one address or IPv6 /64 network, never more than "
                  "three quarters of what the limit of open files allows; trusted proxies are not limited",
              .standard = "1000",
              .min = 1,
              .max = 1'000'000},
    ConfigKey{.name = "pingTimeout",
              .type = KeyType::number,
              .text = "time after which a browser that answers no ping is considered disconnected; 0: never, "
                      "see [docs/visitors.md](docs/visitors.md#lost-connections)",
              .standard = "60",
              .unit = "seconds",
              .max = max_seconds,
              .least = 2}, // connections are looked at once a second
    ConfigKey{.name = "trustedProxies",
              .type = KeyType::texts,
              .text = "addresses and networks of proxies whose `X-Forwarded-For` is trusted, see "
                      "[docs/access.md](docs/access.md#clients-behind-proxies)",
              .standard = R"(["127.0.0.0/8", "::1"])"},
};

constexpr std::array access_keys{
    ConfigKey{.name = "hostNames",
              .type = KeyType::texts,
              .text = "names by which browsers may call this machine besides `server`, see "
                      "[docs/access.md](docs/access.md#which-pages-may-use-a-server)",
              .absent = "this machine's name",
              .reloaded = true},
    ConfigKey{.name = "allowedOrigins",
              .type = KeyType::texts,
              .text =
                  R"(sites whose pages may use the server, as in `"https://*.example.org"`; `"*"` is all)",
              .absent = "see [docs/access.md](docs/access.md#which-pages-may-use-a-server)",
              .reloaded = true},
    ConfigKey{.name = "frameAncestors",
              .type = KeyType::texts,
              .text = "sites that may show the server's pages in a frame",
              .absent = "those of `allowedOrigins`",
              .reloaded = true},
    ConfigKey{.name = "monitorAddresses",
              .type = KeyType::texts,
              .text = "addresses and networks of clients that may see `/monitor` and `/metrics`",
              .absent = "all, unless there is `monitorPassword`",
              .reloaded = true},
    ConfigKey{.name = "monitorPassword",
              .type = KeyType::secret,
              .text = "password with which clients log in as `operator` to see `/monitor` and `/metrics`",
              .reloaded = true},
    ConfigKey{.name = "operatorTokenFile",
              .type = KeyType::path,
              .text = "file of the token by which [the operator](docs/access.md#who-is-the-operator) is "
                      "recognized over the network",
              .reloaded = true},
    ConfigKey{.name = "operatorSocket",
              .type = KeyType::path,
              .text = "socket at which the server's own user gives it commands",
              .absent = "see [docs/access.md](docs/access.md#who-is-the-operator)"},
    ConfigKey{.name = "sessionSecret",
              .type = KeyType::path,
              .text =
                  "file of a word that session and simulation servers share: `/session` hands out tickets, "
                  "without which no simulation starts, see [docs/gateway.md](docs/gateway.md#tickets)"},
};

constexpr std::array log_keys{
    ConfigKey{
        .name = "logDir", .type = KeyType::path, .text = "folder of the log files", .standard = R"("log")"},
    ConfigKey{.name = "debug",
              .type = KeyType::boolean,
              .text = "`true`: log to standard output instead of the file",
              .standard = "false"},
    ConfigKey{.name = "logFormat",
              .type = KeyType::choice,
              .text = "`json` is for log collectors",
              .standard = R"("text")",
              .choices = log_formats},
};

/// How browsers reach a server, beside its `port`.
constexpr std::array<ConfigKey, 3> address_keys(bool reloaded, std::string_view alias)
{
    return {ConfigKey{.name = "server",
                      .text = "public host name, or `*`: [whatever the browser called "
                              "it](docs/site.md#a-class-in-one-network)",
                      .standard = R"("localhost")",
                      .reloaded = reloaded,
                      .alias = alias},
            ConfigKey{.name = "ssl",
                      .type = KeyType::boolean,
                      .text = "whether the addresses that browsers get are `wss` and `https`",
                      .standard = "true",
                      .reloaded = reloaded},
            ConfigKey{.name = "portRewrite",
                      .type = KeyType::boolean,
                      .text = "whether the port is part of the path in these addresses, as in "
                              "`wss://example.org/2000`: a proxy in front looks there",
                      .standard = "true",
                      .reloaded = reloaded}};
}

template<std::size_t left_size, std::size_t right_size>
constexpr auto joined(std::array<ConfigKey, left_size> const& left,
                      std::array<ConfigKey, right_size> const& right)
{
    std::array<ConfigKey, left_size + right_size> keys{};
    for (std::size_t i = 0; i < left_size; ++i)
        keys[i] = left[i];
    for (std::size_t i = 0; i < right_size; ++i)
        keys[left_size + i] = right[i];
    return keys;
}

// ---- the session server

constexpr std::array machine_keys{
    ConfigKey{.name = "address",
              .text = R"(`"host:port"` or `"host/port"`: where browsers are sent)",
              .required = true,
              .reloaded = true},
    ConfigKey{.name = "weight",
              .type = KeyType::number,
              .text = "how many times the sessions of a machine with weight 1 it gets",
              .standard = "1",
              .min = 0.001,
              .max = 1'000'000,
              .reloaded = true},
    ConfigKey{.name = "drain",
              .type = KeyType::boolean,
              .text = "`true`: nobody is sent there",
              .standard = "false",
              .reloaded = true},
    ConfigKey{.name = "labels",
              .type = KeyType::texts,
              .text = R"(what the machine can run, as in `"gpu"`)",
              .reloaded = true},
    ConfigKey{.name = "internal",
              .text = R"(where this server itself reaches the machine: `"10.0.0.2:2000"`, or by TLS )"
                      R"(`"https://sim2.example.org:2000"`; for machines that are found `"http"` or )"
                      R"(`"https"`, see [docs/discovery.md](docs/discovery.md#through-the-gateway))",
              .reloaded = true},
    ConfigKey{.name = "ports",
              .text = R"(ports of its simulations, as in `"2001-2100"`, which the gateway passes on to)",
              .reloaded = true},
};

constexpr auto session_address = joined(std::array{ConfigKey{.name = "port",
                                                             .type = KeyType::integer,
                                                             .text = "port that the server listens on",
                                                             .min = 1,
                                                             .max = highest_port,
                                                             .required = true}},
                                        joined(address_keys(true, ""), std::array{schema_key}));

constexpr std::array session_machines{
    ConfigKey{.name = "simulationServers",
              .type = KeyType::objects,
              .text = R"(the simulation servers: `"host:port"` or `"host/port"`, or objects as in )"
                      R"(`{"address": "host/2000", "weight": 2, "labels": ["gpu"]}`; for the gateway with )"
                      R"(`"internal": "10.0.0.2:2000"`; for several machines `"dns:name:port"`, )"
                      R"(`"srv:service name"` and `"announced"`, see [docs/discovery.md](docs/discovery.md))",
              .absent = "none; only where machines announce themselves (`announcements`)",
              .reloaded = true,
              .keys = machine_keys},
    ConfigKey{.name = "announcements",
              .type = KeyType::boolean,
              .text = "simulation servers that know `sessionSecret` may announce themselves, see "
                      "[docs/discovery.md](docs/discovery.md#machines-that-announce-themselves)",
              .standard = "false"},
    ConfigKey{.name = "nameServers",
              .type = KeyType::texts,
              .text = R"(name servers that are asked for `dns:` and `srv:` entries, as in `"10.0.0.53"` or )"
                      R"(`"127.0.0.1:8600"`)",
              .absent = "those of `/etc/resolv.conf`"},
    ConfigKey{.name = "discoverLoopback",
              .type = KeyType::boolean,
              .text = "names and announcements may lead to this machine's loopback addresses",
              .standard = "false",
              .reloaded = true},
    ConfigKey{.name = "gateway",
              .type = KeyType::boolean,
              .text =
                  "requests for `/2000/...` are passed on to the simulation server `host/2000`, and those "
                  "for `/machine/...` to machines that were found, see "
                  "[docs/gateway.md](docs/gateway.md)",
              .absent = "whether an entry of `simulationServers` has `internal`",
              .reloaded = true},
    ConfigKey{.name = "caFile",
              .type = KeyType::path,
              .text = "PEM file of certificates, of authorities or of machines, that are trusted besides the "
                      "system's where machines are asked by https; read again when it changes"},
    ConfigKey{.name = "loadRefresh",
              .type = KeyType::number,
              .text = "time between two polls of a machine",
              .standard = "5",
              .unit = "seconds",
              .min = 0.1,
              .max = max_seconds,
              .reloaded = true},
    ConfigKey{.name = "loadTimeout",
              .type = KeyType::number,
              .text = "time that a machine has to answer a poll",
              .standard = "5",
              .unit = "seconds",
              .min = 0.1,
              .max = max_seconds,
              .reloaded = true},
    ConfigKey{.name = "loadThreshold",
              .type = KeyType::number,
              .text = "load from which on a machine gets no more sessions",
              .standard = "95",
              .unit = "percent",
              .min = 1,
              .max = 1000,
              .reloaded = true},
    ConfigKey{.name = "scheduling",
              .type = KeyType::choice,
              .text = "how a machine is chosen, see [docs/scheduling.md](docs/scheduling.md)",
              .standard = R"("least_committed")",
              .choices = policies,
              .reloaded = true},
    ConfigKey{.name = "placementTimeout",
              .type = KeyType::number,
              .text = "time for which a session that was sent to a machine counts there before the machine "
                      "reports it, see [docs/scheduling.md](docs/scheduling.md)",
              .standard = "60",
              .unit = "seconds",
              .max = max_seconds},
};

constexpr std::array session_visitors{
    ConfigKey{.name = "relay",
              .type = KeyType::boolean,
              .text =
                  "`true`: the session server finds a machine when a simulation is started, tries another "
                  "one if that refuses, and has browsers wait when all are busy, see "
                  "[docs/visitors.md](docs/visitors.md#when-every-seat-is-taken)",
              .standard = "false",
              .reloaded = true},
    ConfigKey{.name = "waitingRoom",
              .type = KeyType::integer,
              .text = "with `relay`: how many browsers may wait; 0: none",
              .standard = "1000",
              .max = 100'000,
              .reloaded = true},
    ConfigKey{.name = "sessionBurst",
              .type = KeyType::integer,
              .text = "how many requests for `/session` each address or IPv6 /64 network may make at once; "
                      "0: unlimited",
              .standard = "200",
              .max = 100'000,
              .reloaded = true},
    ConfigKey{.name = "sessionRate",
              .type = KeyType::number,
              .text = "how many such requests it may make in the long run; 0: unlimited",
              .standard = "10",
              .unit = "requests per second",
              .max = 100'000,
              .least = 0.01,
              .reloaded = true},
    ConfigKey{.name = "decisionsForAll",
              .type = KeyType::boolean,
              .text = "`true`: everybody may read `/api/decisions`",
              .standard = "false",
              .reloaded = true},
};

constexpr std::array session_pages{
    ConfigKey{.name = "teacherPassword",
              .type = KeyType::secret,
              .text = "password with which teachers open [classes](docs/visitors.md#classes)",
              .absent = "none: without one there are no classes",
              .reloaded = true},
    ConfigKey{.name = "teacherPasswordFile",
              .type = KeyType::path,
              .text = "a file whose only line is that password, instead of `teacherPassword`",
              .reloaded = true},
    ConfigKey{.name = "viewerUrl", .text = "address of the world that the viewer suggests", .reloaded = true},
    ConfigKey{.name = "pauseHidden",
              .type = KeyType::number,
              .text =
                  "time after which the viewer, or the page of a class, pauses a simulation whose page is "
                  "hidden, see [docs/visitors.md](docs/visitors.md#hidden-pages); 0: it runs on",
              .standard = "0",
              .unit = "seconds",
              .max = max_seconds,
              .reloaded = true},
};

constexpr std::array session_mail{
    ConfigKey{.name = "administrator",
              .text =
                  "address of the operator, who gets an e-mail when a server fails, recovers, is full, or "
                  "has room again",
              .reloaded = true},
    ConfigKey{.name = "mailServer", .text = "host that sends these mails", .reloaded = true},
    ConfigKey{.name = "mailServerPort",
              .type = KeyType::integer,
              .text = "port of `mailServer`; 0: 25",
              .standard = "0",
              .max = highest_port,
              .reloaded = true},
    ConfigKey{.name = "mailSender", .text = "address that mails come from", .reloaded = true},
    ConfigKey{.name = "mailSenderUser",
              .text = "user name at `mailServer`",
              .absent = "that of `mailSender`",
              .reloaded = true},
    ConfigKey{.name = "mailSenderPassword",
              .type = KeyType::secret,
              .text = "password at `mailServer`; with one, mails are sent by STARTTLS after a login",
              .reloaded = true},
};

// ---- the simulation server

constexpr auto simulation_address = joined(
    std::array{ConfigKey{.name = "port",
                         .type = KeyType::integer,
                         .text = "port that the server listens on; simulators get the ports after it",
                         .standard = "2000",
                         .min = 1,
                         .max = highest_port - 1}},
    joined(address_keys(false, "fullyQualifiedDomainName"),
           std::array{ConfigKey{.name = "gateway",
                                .type = KeyType::boolean,
                                .text = "browsers reach simulations through this server's own port, at an "
                                        "address that nobody can guess; `false`: at their ports, see "
                                        "[docs/gateway.md](docs/gateway.md#in-front-of-simulations)",
                                .standard = "true"},
                      ConfigKey{.name = "trafficLimit",
                                .type = KeyType::number,
                                .text = "how much a simulation and its browsers may exchange through the "
                                        "gateway; 0: unlimited",
                                .standard = "0",
                                .unit = "bytes per second",
                                .max = 1e12,
                                .reloaded = true},
                      ConfigKey{.name = "publicPort",
                                .type = KeyType::unused,
                                .text = "accepted since old files have it, and not used",
                                .reloaded = true},
                      schema_key}));

constexpr std::array forge_keys{
    ConfigKey{.name = "url",
              .text = R"(the beginning of the addresses of its worlds, as in `"local:"`)",
              .required = true},
    ConfigKey{.name = "directory",
              .type = KeyType::path,
              .text =
                  "folder of this machine with the folders `<owner>/<repository>`; relative paths begin at "
                  "the configuration",
              .required = true},
};

constexpr std::array simulation_worlds{
    ConfigKey{.name = "forges",
              .type = KeyType::objects,
              .text = R"(where worlds may come from: git servers, or `{"url": "local:", "directory": )"
                      R"("/my/projects"}` for folders `<owner>/<repository>` of this machine)",
              .standard = R"(["https://github.com"])",
              .keys = forge_keys},
    ConfigKey{.name = "caFile",
              .type = KeyType::path,
              .text = "PEM file of certificates, of authorities or of servers, that are trusted besides the "
                      "system's where forges, websites and registries are asked by https"},
    ConfigKey{.name = "allowedRepositories",
              .type = KeyType::texts,
              .text = "the only owners and repositories whose [worlds run "
                      "here](docs/access.md#whose-worlds-run-here)",
              .reloaded = true},
    ConfigKey{.name = "blockedRepositories",
              .type = KeyType::texts,
              .text = "owners and repositories whose worlds do not run here",
              .reloaded = true},
    ConfigKey{.name = "shareIdleTime",
              .type = KeyType::number,
              .text = "load below which worlds of others than `allowedRepositories` run here; 0: never",
              .standard = "50",
              .unit = "percent",
              .max = 100,
              .reloaded = true},
    ConfigKey{.name = "projectsDir",
              .type = KeyType::path,
              .text = "folder of the templates for the projects of websites, see "
                      "[docs/projects.md](docs/projects.md#projects-of-websites)",
              .absent = "that of Webots"},
    ConfigKey{.name = "keyDir",
              .type = KeyType::path,
              .text = "folder of the keys for the projects of websites",
              .standard = R"("key")"},
    ConfigKey{.name = "cacheSize",
              .type = KeyType::number,
              .text =
                  "maximum size of the cache of fetched projects, see [docs/projects.md](docs/projects.md)",
              .standard = "10",
              .unit = "gigabytes",
              .min = 0.1,
              .max = max_gigabytes},
    ConfigKey{.name = "fetchMemory",
              .type = KeyType::number,
              .text = "memory that all project fetches together may use; further fetches wait, see "
                      "[docs/machine.md](docs/machine.md#how-much-memory-a-server-takes)",
              .standard = "1024",
              .unit = "megabytes",
              .min = 192, // less, and not even a small project could be fetched
              .max = 1'000'000},
    ConfigKey{.name = "fetchDisk",
              .type = KeyType::number,
              .text = "disk space that all project fetches together may use; further fetches wait",
              .standard = "8",
              .unit = "gigabytes",
              .min = 0.1,
              .max = max_gigabytes},
};

constexpr std::array slurm_job_keys{
    ConfigKey{.name = "partition", .text = "partition of the jobs", .absent = "Slurm's default"},
    ConfigKey{.name = "account", .text = "account that they are charged to", .absent = "Slurm's default"},
    ConfigKey{.name = "qos", .text = "quality of service", .absent = "Slurm's default"},
    ConfigKey{.name = "memory",
              .type = KeyType::number,
              .text = "memory of each job",
              .absent = "Slurm's default",
              .unit = "megabytes",
              .max = max_limit,
              .least = 1},
    ConfigKey{.name = "processors",
              .type = KeyType::integer,
              .text = "processors of each job",
              .standard = "1",
              .min = 1,
              .max = 10'000},
    ConfigKey{.name = "gres", .text = "generic resources of each job, as in `gpu:1`"},
    ConfigKey{.name = "timeLimit",
              .type = KeyType::number,
              .text = "time after which Slurm ends a job",
              .absent = "somewhat more than `timeout`, `extendable` and `startTimeout` together",
              .unit = "seconds",
              .max = max_seconds,
              .least = 60},
};

constexpr std::array slurm_choice_keys{
    ConfigKey{.name = "mode",
              .text = "for simulations in this mode: `x3d`, `w3d` or `mjpeg`",
              .absent = "in any mode"},
    ConfigKey{.name = "label",
              .text = "for projects that need [this label](docs/scheduling.md#labels)",
              .absent = "for all projects"},
};
constexpr auto slurm_override_keys = joined(slurm_choice_keys, slurm_job_keys);

constexpr auto slurm_keys = joined(
    slurm_job_keys,
    std::array{ConfigKey{.name = "copyTo",
                         .text = "a folder of each node into which projects are copied, as in `/tmp`; see "
                                 "[docs/clusters.md](docs/clusters.md#without-a-shared-folder)",
                         .absent = "projects are not copied: the nodes see `stateDir`"},
               ConfigKey{.name = "overrides",
                         .type = KeyType::object_list,
                         .text = "what jobs of some simulations ask for instead; the first that fits counts",
                         .standard = "[]",
                         .keys = slurm_override_keys}});

constexpr std::array launcher_keys{
    ConfigKey{.name = "slurm",
              .type = KeyType::object,
              .text = "each simulation is a job of a Slurm cluster; `{}` takes Slurm's defaults",
              .absent = "no jobs",
              .keys = slurm_keys},
};

constexpr std::array simulation_programs{
    ConfigKey{.name = "launcher",
              .type = KeyType::object,
              .text = "where simulations run, see [docs/clusters.md](docs/clusters.md)",
              .absent = "on this machine",
              .keys = launcher_keys},
    ConfigKey{.name = "webotsHome",
              .type = KeyType::path,
              .text = "the folder that contains the program `webots`, which must exist",
              .absent = "`WEBOTS_HOME`, else the usual places"},
    ConfigKey{.name = "display",
              .text =
                  "what Webots draws on: an X display that all simulations share, `private`: a virtual one "
                  "(Xvfb) for each simulation, or `none`, see "
                  "[docs/sandboxes.md](docs/sandboxes.md#displays)",
              .absent = "`DISPLAY`; else `:0`, or `private` where that is not there"},
    ConfigKey{.name = "simulatorEnvironment",
              .type = KeyType::texts,
              .text = "environment variables that simulators get in addition to those that Webots, drivers, "
                      R"(languages, ROS and networks need: `"NAME"`, `"PREFIX_*"`, and `"NAME=value"`, see )"
                      "[docs/machine.md](docs/machine.md#the-environment-of-simulators)"},
    ConfigKey{.name = "multimediaServer",
              .text = "passed to Webots R2021b and older: where the operator's Janus server is"},
    ConfigKey{.name = "multimediaStream",
              .text = "passed to Webots R2021b and older: where Janus takes the stream"},
    ConfigKey{.name = "labels",
              .type = KeyType::texts,
              .text = "what this machine can run, in words such as `gpu`, for session servers, see "
                      "[docs/scheduling.md](docs/scheduling.md#labels)"},
    ConfigKey{.name = "docker",
              .type = KeyType::boolean,
              .text = "simulations run in containers, see [docs/docker.md](docs/docker.md)",
              .standard = "false"},
    ConfigKey{.name = "dockerDir",
              .type = KeyType::path,
              .text = "folder of the compose files and the Dockerfile",
              .absent = "`docker` beside the configuration"},
    ConfigKey{.name = "dockerImages",
              .text = "images of Webots, without a tag",
              .standard = R"("cyberbotics/webots.cloud")"},
    ConfigKey{.name = "projectDockerfiles",
              .type = KeyType::boolean,
              .text = "a project's own `Dockerfile` is built in place of ours",
              .standard = "false"},
    ConfigKey{.name = "persistantDockerImages",
              .type = KeyType::texts,
              .text = "old images are removed, except for these (`repository:tag`)",
              .absent = "no image is removed"},
};

constexpr std::array simulation_walls{
    ConfigKey{.name = "sandbox",
              .type = KeyType::choice,
              .text = "how simulations are confined, see [docs/sandboxes.md](docs/sandboxes.md)",
              .standard = R"("auto")",
              .choices = sandboxes},
    ConfigKey{.name = "network",
              .type = KeyType::choice,
              .text = "what simulations reach in a sandbox: `internet` is public addresses only",
              .standard = R"("internet")",
              .choices = reaches},
    ConfigKey{.name = "simulationUser",
              .text =
                  "who runs simulations: `auto` (where the server is root, `webots-simulation` if there is "
                  "such a user, else a number of its own for each; elsewhere a number that the unit of "
                  "its service has made, or of `/etc/subuid`, for each, if there are some), `subordinate` "
                  "(the latter, or the server does not "
                  "start), the name of a user, or `none` (the server's own user), see "
                  "[docs/sandboxes.md](docs/sandboxes.md#another-user)",
              .standard = R"("auto")"},
    ConfigKey{.name = "confineServer",
              .type = KeyType::boolean,
              .text = "what handles requests and projects can open only the server's own files, where the "
                      "kernel has Landlock, see [docs/machine.md](docs/machine.md#isolation)",
              .standard = "true"},
    ConfigKey{.name = "simulationMemory",
              .type = KeyType::number,
              .text = "memory that one simulation may use; 0: no limit",
              .absent = "see [docs/sandboxes.md](docs/sandboxes.md#limits)",
              .unit = "megabytes",
              .max = max_limit,
              .least = 64},
    ConfigKey{.name = "simulationCpus",
              .type = KeyType::number,
              .text = "processors that one simulation may use; 0: no limit",
              .standard = "0",
              .max = max_limit,
              .least = 0.01},
    ConfigKey{.name = "simulationProcesses",
              .type = KeyType::number,
              .text = "processes, with their threads, that one simulation may have; 0: no limit",
              .absent = "see [docs/sandboxes.md](docs/sandboxes.md#limits)",
              .max = max_limit,
              .least = 10},
    ConfigKey{.name = "simulationFiles",
              .type = KeyType::number,
              .text = "files that each process of a simulation may have open; 0: no limit",
              .standard = "4096",
              .max = max_limit,
              .least = 64},
    ConfigKey{.name = "simulationDisk",
              .type = KeyType::number,
              .text = "disk space that the folder of one simulation may take; 0: no limit",
              .standard = "4096",
              .unit = "megabytes",
              .max = max_limit,
              .least = 0.1},
};

constexpr std::array simulation_visitors{
    ConfigKey{.name = "maxConnections",
              .type = KeyType::integer,
              .text = "maximum number of simulations, at most as many as there are ports",
              .standard = "100",
              .min = 1,
              .max = 10'000},
    ConfigKey{.name = "simulationsPerAddress",
              .type = KeyType::integer,
              .text = "maximum number of simulations of one address or IPv6 /64 network, see "
                      "[docs/access.md](docs/access.md#a-class-behind-one-address); 0: no limit",
              .absent = "3/4 of `maxConnections`",
              .max = 10'000,
              .reloaded = true},
    ConfigKey{.name = "timeout",
              .type = KeyType::number,
              .text = "maximum duration of a simulation; less than 360 counts as 7200",
              .standard = "7200",
              .unit = "seconds",
              .max = max_seconds},
    ConfigKey{.name = "extendable",
              .type = KeyType::number,
              .text =
                  "time by which people may extend `timeout` for their simulation, in all, with a button of "
                  "the viewer; 0: not at all, see "
                  "[docs/visitors.md](docs/visitors.md#the-time-limit)",
              .standard = "0",
              .unit = "seconds",
              .max = max_seconds},
    ConfigKey{.name = "startTimeout",
              .type = KeyType::number,
              .text = "maximum time that a simulation takes to get ready",
              .standard = "300",
              .unit = "seconds",
              .min = 1,
              .max = max_seconds},
    ConfigKey{.name = "reconnectGrace",
              .type = KeyType::number,
              .text =
                  "time for which a simulation waits for a browser that lost its connection or reloads its "
                  "page, see [docs/visitors.md](docs/visitors.md#lost-connections)",
              .absent = "30 for pages that reconnect, 0 for others",
              .unit = "seconds",
              .max = max_seconds},
};

constexpr std::array simulation_site{
    ConfigKey{.name = "notify",
              .type = KeyType::text_or_list,
              .text = "registries that this server announces itself to; `[]`: none",
              .standard = R"(["https://webots.cloud/ajax/server/setup.php"])"},
    ConfigKey{.name = "sessionServers",
              .type = KeyType::texts,
              .text = R"(session servers that this server announces itself to, with `sessionSecret`, as in )"
                      R"(`"https://session.example.org"`, see )"
                      "[docs/discovery.md](docs/discovery.md#machines-that-announce-themselves)",
              .absent = "none"},
    ConfigKey{.name = "title", .text = "title of the monitor page", .reloaded = true},
    ConfigKey{.name = "description", .text = "description on the monitor page", .reloaded = true},
    ConfigKey{.name = "loadFormula",
              .type = KeyType::choice,
              .text = "`reference`: computed like the Python server, where full memory is masked by an idle "
                      "processor",
              .standard = R"("strict")",
              .choices = load_formulas},
    ConfigKey{.name = "stateDir",
              .type = KeyType::path,
              .text =
                  "folder for the server's working files, mainly the projects of running simulations, see "
                  "[docs/machine.md](docs/machine.md#files-and-folders)",
              .absent = "systemd's, else `~/.local/state/webots_cloud`"},
};

constexpr auto simulation_logs =
    joined(log_keys,
           std::array{ConfigKey{.name = "simulationLogDays",
                                .type = KeyType::number,
                                .text = "time for which `<logDir>/simulation/simulations/` keeps the output "
                                        "of each simulator; 0: not kept at all",
                                .standard = "7",
                                .unit = "days",
                                .max = 3650},
                      ConfigKey{.name = "monitorLogEnabled",
                                .type = KeyType::boolean,
                                .text = "write one line per second to `<logDir>/simulation/monitor.csv`",
                                .standard = "true"}});

constexpr std::string_view address_title = "Address";
constexpr std::string_view secure_title = "TLS";
constexpr std::string_view connection_title = "Connections";
constexpr std::string_view access_title = "Who may do what";
constexpr std::string_view log_title = "Logs";

constexpr std::array all_session_topics{
    ConfigTopic{address_title, session_address},
    ConfigTopic{"Machines and placement", session_machines},
    ConfigTopic{"Visitors", session_visitors},
    ConfigTopic{"Classes and the viewer", session_pages},
    ConfigTopic{secure_title, secure_keys},
    ConfigTopic{access_title, access_keys},
    ConfigTopic{connection_title, connection_keys},
    ConfigTopic{"E-mail to the operator", session_mail},
    ConfigTopic{log_title, log_keys},
};

constexpr std::array all_simulation_topics{
    ConfigTopic{address_title, simulation_address},
    ConfigTopic{"Worlds", simulation_worlds},
    ConfigTopic{"Webots and containers", simulation_programs},
    ConfigTopic{"Confinement and limits", simulation_walls},
    ConfigTopic{"Number and duration of simulations", simulation_visitors},
    ConfigTopic{"The site", simulation_site},
    ConfigTopic{secure_title, secure_keys},
    ConfigTopic{access_title, access_keys},
    ConfigTopic{connection_title, connection_keys},
    ConfigTopic{log_title, simulation_logs},
};

} // namespace

std::span<ConfigTopic const> session_topics() noexcept
{
    return all_session_topics;
}

std::span<ConfigTopic const> simulation_topics() noexcept
{
    return all_simulation_topics;
}

ConfigKey const* find_key(std::span<ConfigTopic const> topics, std::string_view name) noexcept
{
    for (auto const& topic : topics)
        for (auto const& key : topic.keys)
            if (key.name == name || (!key.alias.empty() && key.alias == name))
                return &key;
    return nullptr;
}

std::vector<std::string_view> key_names(std::span<ConfigTopic const> topics)
{
    std::vector<std::string_view> names;
    for (auto const& topic : topics)
        for (auto const& key : topic.keys) {
            names.push_back(key.name);
            if (!key.alias.empty())
                names.push_back(key.alias);
        }
    return names;
}

} // namespace webots_cloud::core
