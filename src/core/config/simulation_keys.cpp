// The keys of the simulation server's configuration: a row for each, with the member of the struct that keeps
// its value.
#include "config_keys.hpp"
#include "shared_keys.hpp"

#include <webots_cloud/forge_kind.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr double max_gigabytes = 100'000;
constexpr double max_limit = 1'000'000'000; // of memory, processes, ...

constexpr std::array<std::string_view, 5> sandboxes{"auto", "none", "bubblewrap", "firejail", "docker"};
constexpr std::array<std::string_view, 3> reaches{"internet", "none", "host"};
constexpr std::array<std::string_view, 2> load_formulas{"strict", "reference"};

constexpr auto names_of_forge_kinds = [] {
    std::array<std::string_view, forge_kinds.size()> names;
    std::ranges::transform(forge_kinds, names.begin(), &ForgeKindRow::name);
    return names;
}();

constexpr auto simulation_address = joined(
    std::array{ConfigKey{.name = "port",
                         .value = member<&SimulationConfig::address, &PublicAddress::port>,
                         .text = "port that the server listens on; simulators get the ports after it",
                         .min = 1,
                         .max = highest_port - 1}},
    joined(address_keys<SimulationConfig>(false, "fullyQualifiedDomainName"),
           std::array{
               ConfigKey{
                   .name = "gateway",
                   .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::gateway>,
                   .text = "browsers reach simulations through this server's own port, at an "
                           "address that nobody can guess; `false`: at their ports, see "
                           "[docs/gateway.md](docs/gateway.md#in-front-of-simulations)",
               },
               ConfigKey{.name = "trafficLimit",
                         .value = member<&SimulationConfig::service, &SimulationServiceConfig::traffic_limit>,
                         .text = "how much a simulation and its browsers may exchange through the "
                                 "gateway; 0: unlimited",
                         .unit = "bytes per second",
                         .max = 1e12,
                         .reloaded = true},
               ConfigKey{
                   .name = "controllerPort",
                   .value = member<&SimulationConfig::service, &SimulationServiceConfig::controller_port>,
                   .text = "port where [controllers on other machines](docs/controllers.md) reach the robots "
                           "of simulations; 0: none",
                   .max = highest_port,
               },
               ConfigKey{
                   .name = "controllerAddress",
                   .value = member<&SimulationConfig::service, &SimulationServiceConfig::controller_address>,
                   .text = "where they reach `controllerPort`, as in `sim.example.org:2900`, if that is not "
                           "at the server's name and this port",
                   .absent = "the server's name and `controllerPort`",
                   .reloaded = true,
               },
               ConfigKey{
                   .name = "controllerRepositories",
                   .value =
                       member<&SimulationConfig::service, &SimulationServiceConfig::controller_repositories>,
                   .text = "owners and repositories of the worlds whose robots may be controlled from other "
                           "machines; entries as in `allowedRepositories`",
                   .reloaded = true,
               },
               ConfigKey{.name = "publicPort",
                         .value = unused,
                         .text = "accepted since old files have it, and not used",
                         .reloaded = true},
               schema_key}));

constexpr std::array forge_keys{
    ConfigKey{.name = "url",
              .value = member<&ForgeConfig::url>,
              .text = R"(the beginning of the addresses of its worlds, as in `"local:"`)",
              .required = true},
    ConfigKey{.name = "directory",
              .value = member<&ForgeConfig::directory>,
              .text =
                  "folder of this machine with the folders `<owner>/<repository>`; relative paths begin at "
                  "the configuration",
              .absent = "a server"},
    ConfigKey{
        .name = "kind",
        .value = shaped<KeyType::choice, &ForgeConfig::kind>,
        .text =
            "which forge it is, and so [how it is asked](docs/projects.md#how-a-server-is-asked) and what "
            "[links to its worlds](docs/access.md#links-to-worlds) look like",
        .absent = "found out of each link",
        .choices = names_of_forge_kinds},
};

constexpr std::array simulation_worlds{
    ConfigKey{.name = "forges",
              .value = shaped<KeyType::objects, &SimulationConfig::forges>,
              .text =
                  R"(where worlds may come from: servers such as GitHub, or `{"url": "local:", "directory": )"
                  R"("/my/projects"}` for folders `<owner>/<repository>` of this machine; [links that are )"
                  R"(understood](docs/access.md#links-to-worlds))",
              .standard = R"(["https://github.com"])",
              .keys = forge_keys},
    ConfigKey{.name = "caFile",
              .value = member<&SimulationConfig::http_client, &HttpClientConfig::authorities>,
              .text = "PEM file of certificates, of authorities or of servers, that are trusted besides the "
                      "system's where forges, websites and registries are asked by https"},
    ConfigKey{.name = "allowedRepositories",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::repositories,
                              &RepositoryRules::allowed>,
              .text = "the only owners and repositories whose [worlds run "
                      "here](docs/access.md#whose-worlds-run-here)",
              .reloaded = true},
    ConfigKey{.name = "blockedRepositories",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::repositories,
                              &RepositoryRules::blocked>,
              .text = "owners and repositories whose worlds do not run here",
              .reloaded = true},
    ConfigKey{.name = "shareIdleTime",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::repositories,
                              &RepositoryRules::share_idle_time>,
              .text = "load below which worlds of others than `allowedRepositories` run here; 0: never",
              .unit = "percent",
              .max = 100,
              .reloaded = true},
    ConfigKey{.name = "allowEdit",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::allow_edit>,
              .text = "whether visitors may [change the programs](docs/access.md#who-may-change-programs) of "
                      "their own simulation while it runs",
              .reloaded = true},
    ConfigKey{.name = "projectsDir",
              .value = member<&SimulationConfig::websites, &WebsiteSourceConfig::projects>,
              .text = "folder of the templates for the projects of websites, see "
                      "[docs/projects.md](docs/projects.md#projects-of-websites)",
              .absent = "that of Webots"},
    ConfigKey{
        .name = "keyDir",
        .value = member<&SimulationConfig::websites, &WebsiteSourceConfig::keys>,
        .text = "folder of the keys for the projects of websites",
    },
    ConfigKey{.name = "cacheSize",
              .value = member<&SimulationConfig::git, &GitSourceConfig::cache_bytes>,
              .text =
                  "maximum size of the cache of fetched projects, see [docs/projects.md](docs/projects.md)",
              .unit = "gigabytes",
              .min = 0.1,
              .max = max_gigabytes},
    ConfigKey{.name = "fetchMemory",
              .value = member<&SimulationConfig::fetch_memory>,
              .text = "memory that all project fetches together may use; further fetches wait, see "
                      "[docs/machine.md](docs/machine.md#how-much-memory-a-server-takes)",
              .unit = "megabytes",
              .min = 192, // less, and not even a small project could be fetched
              .max = 1'000'000},
    ConfigKey{.name = "fetchDisk",
              .value = member<&SimulationConfig::fetch_disk>,
              .text = "disk space that all project fetches together may use; further fetches wait",
              .unit = "gigabytes",
              .min = 0.1,
              .max = max_gigabytes},
};

/// What a job asks for, kept in the `job` of `Owner`.
template<class Owner>
constexpr std::array slurm_job_keys{
    ConfigKey{.name = "partition",
              .value = member<&Owner::job, &SlurmJobConfig::partition>,
              .text = "partition of the jobs",
              .absent = "Slurm's default"},
    ConfigKey{.name = "account",
              .value = member<&Owner::job, &SlurmJobConfig::account>,
              .text = "account that they are charged to",
              .absent = "Slurm's default"},
    ConfigKey{.name = "qos",
              .value = member<&Owner::job, &SlurmJobConfig::qos>,
              .text = "quality of service",
              .absent = "Slurm's default"},
    ConfigKey{.name = "memory",
              .value = member<&Owner::job, &SlurmJobConfig::memory>,
              .text = "memory of each job",
              .absent = "Slurm's default",
              .unit = "megabytes",
              .max = max_limit,
              .least = 1},
    ConfigKey{.name = "processors",
              .value = member<&Owner::job, &SlurmJobConfig::processors>,
              .text = "processors of each job",
              .min = 1,
              .max = 10'000},
    ConfigKey{.name = "gres",
              .value = member<&Owner::job, &SlurmJobConfig::gres>,
              .text = "generic resources of each job, as in `gpu:1`"},
    ConfigKey{.name = "timeLimit",
              .value = member<&Owner::job, &SlurmJobConfig::time_limit>,
              .text = "time after which Slurm ends a job",
              .absent = "somewhat more than `timeout`, `extendable` and `startTimeout` together",
              .unit = "seconds",
              .max = max_seconds,
              .least = 60},
};

constexpr std::array slurm_choice_keys{
    ConfigKey{.name = "mode",
              .value = member<&SlurmOverrideConfig::mode>,
              .text = "for simulations in this mode: `x3d`, `w3d` or `mjpeg`",
              .absent = "in any mode"},
    ConfigKey{.name = "label",
              .value = member<&SlurmOverrideConfig::label>,
              .text = "for projects that need [this label](docs/scheduling.md#labels)",
              .absent = "for all projects"},
};
constexpr auto slurm_override_keys = joined(slurm_choice_keys, slurm_job_keys<SlurmOverrideConfig>);

constexpr auto slurm_keys = joined(
    slurm_job_keys<SlurmConfig>,
    std::array{ConfigKey{.name = "copyTo",
                         .value = KeyValue{KeyType::text},
                         .text = "a folder of each node into which projects are copied, as in `/tmp`; see "
                                 "[docs/clusters.md](docs/clusters.md#without-a-shared-folder)",
                         .absent = "projects are not copied: the nodes see `stateDir`"},
               ConfigKey{.name = "overrides",
                         .value = KeyValue{KeyType::object_list},
                         .text = "what jobs of some simulations ask for instead; the first that fits counts",
                         .standard = "[]",
                         .keys = slurm_override_keys}});

constexpr std::array launcher_keys{
    ConfigKey{.name = "slurm",
              .value = KeyValue{KeyType::object},
              .text = "each simulation is a job of a Slurm cluster; `{}` takes Slurm's defaults",
              .absent = "no jobs",
              .keys = slurm_keys},
};

constexpr std::array simulation_programs{
    ConfigKey{.name = "launcher",
              .value = shaped<KeyType::object, &SimulationConfig::slurm>,
              .text = "where simulations run, see [docs/clusters.md](docs/clusters.md)",
              .absent = "on this machine",
              .keys = launcher_keys},
    ConfigKey{.name = "webotsHome",
              .value = member<&SimulationConfig::webots_home>,
              .text = "the folder that contains the program `webots`, which must exist",
              .absent = "`WEBOTS_HOME`, else the usual places"},
    ConfigKey{.name = "display",
              .value = member<&SimulationConfig::display>,
              .text =
                  "what Webots draws on: an X display that all simulations share, `private`: a virtual one "
                  "(Xvfb) for each simulation, or `none`, see "
                  "[docs/sandboxes.md](docs/sandboxes.md#displays)",
              .absent = "`DISPLAY`; else `:0`, or `private` where that is not there"},
    ConfigKey{.name = "simulatorEnvironment",
              .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::simulator_environment>,
              .text = "environment variables that simulators get in addition to those that Webots, drivers, "
                      R"(languages, ROS and networks need: `"NAME"`, `"PREFIX_*"`, and `"NAME=value"`, see )"
                      "[docs/machine.md](docs/machine.md#the-environment-of-simulators)"},
    ConfigKey{.name = "multimediaServer",
              .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::multimedia_server>,
              .text = "passed to Webots R2021b and older: where the operator's Janus server is"},
    ConfigKey{.name = "multimediaStream",
              .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::multimedia_stream>,
              .text = "passed to Webots R2021b and older: where Janus takes the stream"},
    ConfigKey{.name = "labels",
              .value = member<&SimulationConfig::labels>,
              .text = "what this machine can run, in words such as `gpu`, for session servers, see "
                      "[docs/scheduling.md](docs/scheduling.md#labels)"},
    ConfigKey{
        .name = "docker",
        .value = member<&SimulationConfig::docker>,
        .text = "simulations run in containers, see [docs/docker.md](docs/docker.md)",
    },
    ConfigKey{.name = "dockerDir",
              .value = member<&SimulationConfig::containers, &DockerConfig::directory>,
              .text = "folder of the compose files and the Dockerfile",
              .absent = "`docker` beside the configuration"},
    ConfigKey{
        .name = "dockerImages",
        .value = member<&SimulationConfig::containers, &DockerConfig::images>,
        .text = "images of Webots, without a tag",
    },
    ConfigKey{
        .name = "projectDockerfiles",
        .value = member<&SimulationConfig::containers, &DockerConfig::project_dockerfiles>,
        .text = "a project's own `Dockerfile` is built in place of ours",
    },
    ConfigKey{.name = "buildNetwork",
              .value = member<&SimulationConfig::containers, &DockerConfig::build_network>,
              .text = "`true`: builds of projects' Dockerfiles, those of competitions among them, reach what "
                      "Docker's network reaches, see "
                      "[docs/docker.md](docs/docker.md#what-a-build-reaches)"},
    ConfigKey{.name = "buildCache",
              .value = member<&SimulationConfig::containers, &DockerConfig::build_cache>,
              .text =
                  "what may be kept of builds of images, so that the next ones are fast; 0: all of it, see "
                  "[docs/docker.md](docs/docker.md#what-is-removed)",
              .unit = "gigabytes",
              .max = max_gigabytes,
              .least = 0.001},
    ConfigKey{.name = "persistantDockerImages",
              .value = member<&SimulationConfig::containers, &DockerConfig::persistent_images>,
              .text = "old images are removed, except for these (`repository:tag`)",
              .absent = "no image is removed"},
};

constexpr std::array simulation_walls{
    ConfigKey{.name = "sandbox",
              .value = choice<&SimulationConfig::sandbox>,
              .text = "how simulations are confined, see [docs/sandboxes.md](docs/sandboxes.md)",
              .choices = sandboxes},
    ConfigKey{.name = "network",
              .value = choice<&SimulationConfig::network_reach>,
              .text = "what simulations reach in a sandbox: `internet` is public addresses only",
              .choices = reaches},
    ConfigKey{
        .name = "simulationUser",
        .value = member<&SimulationConfig::simulation_user>,
        .text = "who runs simulations: `auto` (where the server is root, `webots-simulation` if there is "
                "such a user, else a number of its own for each; elsewhere a number that the unit of "
                "its service has made, or of `/etc/subuid`, for each, if there are some), `subordinate` "
                "(the latter, or the server does not "
                "start), the name of a user, or `none` (the server's own user), see "
                "[docs/sandboxes.md](docs/sandboxes.md#another-user)",
    },
    ConfigKey{
        .name = "confineServer",
        .value = member<&SimulationConfig::confine_server>,
        .text = "what handles requests and projects can open only the server's own files, where the "
                "kernel has Landlock, see [docs/machine.md](docs/machine.md#isolation)",
    },
    ConfigKey{.name = "simulationMemory",
              .value = member<&SimulationConfig::limits, &LimitsConfig::memory>,
              .text = "memory that one simulation may use; 0: no limit",
              .absent = "see [docs/sandboxes.md](docs/sandboxes.md#limits)",
              .unit = "megabytes",
              .max = max_limit,
              .least = 64},
    ConfigKey{.name = "simulationCpus",
              .value = member<&SimulationConfig::limits, &LimitsConfig::processors>,
              .text = "processors that one simulation may use; 0: no limit",
              .max = max_limit,
              .least = 0.01},
    ConfigKey{.name = "simulationProcesses",
              .value = member<&SimulationConfig::limits, &LimitsConfig::processes>,
              .text = "processes, with their threads, that one simulation may have; 0: no limit",
              .absent = "see [docs/sandboxes.md](docs/sandboxes.md#limits)",
              .max = max_limit,
              .least = 10},
    ConfigKey{.name = "simulationFiles",
              .value = member<&SimulationConfig::limits, &LimitsConfig::files>,
              .text = "files that each process of a simulation may have open; 0: no limit",
              .max = max_limit,
              .least = 64},
    ConfigKey{
        .name = "simulationDisk",
        .value = member<&SimulationConfig::limits, &LimitsConfig::disk>,
        .text =
            "disk space that the folder of one simulation may take, and in containers its build; 0: no limit",
        .unit = "megabytes",
        .max = max_limit,
        .least = 0.1},
};

constexpr std::array<std::string_view, 3> staged_modes{"x3d", "w3d", "mjpeg"};

constexpr std::array staged_keys{
    ConfigKey{.name = "url",
              .value = member<&StagedWorldConfig::url>,
              .text = "the world, by a link that browsers may start as well",
              .required = true},
    ConfigKey{.name = "mode",
              .value = choice<&StagedWorldConfig::mode>,
              .text = "for browsers that want pictures (`mjpeg`, as our viewer does), or draw the scene "
                      "themselves (`x3d` and `w3d`, which are the same)",
              .choices = staged_modes},
    ConfigKey{.name = "count",
              .value = member<&StagedWorldConfig::count>,
              .text = "how many are to be ready",
              .min = 1,
              .max = 10'000},
};

constexpr std::array simulation_visitors{
    ConfigKey{.name = "maxConnections",
              .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::max_simulations>,
              .text = "maximum number of simulations, at most as many as there are ports",
              .min = 1,
              .max = 10'000},
    ConfigKey{.name = "simulationsPerAddress",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::simulations_per_address>,
              .text = "maximum number of simulations of one address or "
                      "[IPv6 network](docs/access.md#networks-of-ipv6), see "
                      "[docs/access.md](docs/access.md#a-class-behind-one-address); 0: no limit",
              .absent = "3/4 of `maxConnections`",
              .max = 10'000,
              .reloaded = true},
    ConfigKey{.name = "maxSimulationsPerWorld",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::simulations_per_world>,
              .text = "maximum number of simulations of one world, by its address; further visitors wait or "
                      "are sent to "
                      "another machine; 0: no limit",
              .max = 10'000,
              .reloaded = true},
    ConfigKey{.name = "staged",
              .value =
                  shaped<KeyType::object_list, &SimulationConfig::service, &SimulationServiceConfig::staged>,
              .text = "worlds of which simulations are kept ready before anybody asks, the most important "
                      "first, see [docs/operations.md](docs/operations.md#staged-simulations)",
              .standard = "[]",
              .reloaded = true,
              .keys = staged_keys},
    ConfigKey{.name = "stagedMaxAge",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::staged_max_age>,
              .text = "age at which a staged simulation is replaced, so that it has the newest version of "
                      "its project",
              .unit = "seconds",
              .min = 10,
              .max = max_seconds,
              .reloaded = true},
    ConfigKey{.name = "stagedForClasses",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::staged_for_classes>,
              .text = "simulations that session servers may have staged here for the seats of their classes, "
                      "in all, see [docs/operations.md](docs/operations.md#staged-for-classes); 0: none",
              .absent = "30; 0 with `docker` or `launcher`",
              .max = 10'000,
              .reloaded = true},
    ConfigKey{.name = "timeout",
              .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::timeout>,
              .text = "maximum duration of a simulation; less than 360 counts as 7200",
              .unit = "seconds",
              .max = max_seconds},
    ConfigKey{.name = "extendable",
              .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::extendable>,
              .text =
                  "time by which people may extend `timeout` for their simulation, in all, with a button of "
                  "the viewer; 0: not at all, see "
                  "[docs/visitors.md](docs/visitors.md#the-time-limit)",
              .unit = "seconds",
              .max = max_seconds},
    ConfigKey{.name = "startTimeout",
              .value = member<&SimulationConfig::launching, &SimulationLauncherConfig::start_timeout>,
              .text = "maximum time that a simulation takes to get ready",
              .unit = "seconds",
              .min = 1,
              .max = max_seconds},
    ConfigKey{.name = "reconnectGrace",
              .value = member<&SimulationConfig::service, &SimulationServiceConfig::reconnect_grace>,
              .text =
                  "time for which a simulation waits for a browser that lost its connection or reloads its "
                  "page, see [docs/visitors.md](docs/visitors.md#lost-connections)",
              .absent = "30 for pages that reconnect, 0 for others",
              .unit = "seconds",
              .max = max_seconds,
              .reloaded = true},
};

constexpr std::array simulation_site{
    ConfigKey{.name = "notify",
              .value =
                  shaped<KeyType::text_or_list, &SimulationConfig::service, &SimulationServiceConfig::notify>,
              .text = "registries that this server announces itself to; `[]`: none",
              .standard = R"(["https://webots.cloud/ajax/server/setup.php"])"},
    ConfigKey{.name = "sessionServers",
              .value = member<&SimulationConfig::session_servers>,
              .text = R"(session servers that this server announces itself to, with `sessionSecret`, as in )"
                      R"(`"https://session.example.org"`, see )"
                      "[docs/discovery.md](docs/discovery.md#machines-that-announce-themselves)",
              .absent = "none"},
    ConfigKey{.name = "title",
              .value = free_text<&SimulationConfig::service, &SimulationServiceConfig::title>,
              .text = "title of the monitor page",
              .reloaded = true},
    ConfigKey{.name = "description",
              .value = free_text<&SimulationConfig::service, &SimulationServiceConfig::description>,
              .text = "description on the monitor page",
              .reloaded = true},
    ConfigKey{.name = "loadFormula",
              .value = choice<&SimulationConfig::service, &SimulationServiceConfig::reference_load>,
              .text = "`reference`: computed like the Python server, where full memory is masked by an idle "
                      "processor",
              .choices = load_formulas,
              .reloaded = true},
    ConfigKey{.name = "stateDir",
              .value = member<&SimulationConfig::state_dir>,
              .text =
                  "folder for the server's working files, mainly the projects of running simulations, see "
                  "[docs/machine.md](docs/machine.md#files-and-folders)",
              .absent = "systemd's, else `~/.local/state/webots_cloud`"},
};

constexpr auto simulation_logs =
    joined(log_keys<SimulationConfig>,
           std::array{ConfigKey{.name = "simulationLogDays",
                                .value = member<&SimulationConfig::simulation_log_keep>,
                                .text = "time for which `<logDir>/simulation/simulations/` keeps the output "
                                        "of each simulator; 0: not kept at all",
                                .unit = "days",
                                .max = 3650},
                      ConfigKey{
                          .name = "monitorLogEnabled",
                          .value = member<&SimulationConfig::monitor_log>,
                          .text = "write one line per second to `<logDir>/simulation/monitor.csv`",
                      }});

constexpr std::array all_simulation_topics{
    ConfigTopic{address_title, simulation_address},
    ConfigTopic{"Worlds", simulation_worlds},
    ConfigTopic{"Webots and containers", simulation_programs},
    ConfigTopic{"Confinement and limits", simulation_walls},
    ConfigTopic{"Number and duration of simulations", simulation_visitors},
    ConfigTopic{"The site", simulation_site},
    ConfigTopic{secure_title, secure_keys<SimulationConfig>},
    ConfigTopic{access_title, access_keys<SimulationConfig>},
    ConfigTopic{connection_title, connection_keys<SimulationConfig>},
    ConfigTopic{log_title, simulation_logs},
};

} // namespace

std::span<ConfigTopic const> simulation_topics() noexcept
{
    return all_simulation_topics;
}

} // namespace webots_cloud::core
