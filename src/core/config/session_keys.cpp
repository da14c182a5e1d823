// The keys of the session server's configuration: a row for each, with the member of the struct that keeps
// its value.
#include "config_keys.hpp"
#include "shared_keys.hpp"

namespace webots_cloud::core {
namespace {

constexpr std::array<std::string_view, 4> policies{"least_committed", "least_reported", "random",
                                                   "power_of_two"};

constexpr std::array machine_keys{
    ConfigKey{.name = "address",
              .value = member<&ServerSpec::address>,
              .text = R"(`"host:port"`, `"host/port"` or `"host/path"`: where browsers are sent)",
              .required = true,
              .reloaded = true},
    ConfigKey{.name = "weight",
              .value = member<&ServerSpec::weight>,
              .text = "how many times the sessions of a machine with weight 1 it gets",
              .min = 0.001,
              .max = 1'000'000,
              .reloaded = true},
    ConfigKey{.name = "drain",
              .value = member<&ServerSpec::drain>,
              .text = "`true`: nobody is sent there",
              .reloaded = true},
    ConfigKey{.name = "labels",
              .value = member<&ServerSpec::labels>,
              .text = R"(what the machine can run, as in `"gpu"`)",
              .reloaded = true},
    ConfigKey{.name = "internal",
              .value = member<&ServerSpec::internal_address>,
              .text = R"(where this server itself reaches the machine: `"10.0.0.2:2000"`, or by TLS )"
                      R"(`"https://sim2.example.org:2000"`; for machines that are found `"http"` or )"
                      R"(`"https"`, see [docs/discovery.md](docs/discovery.md#through-the-gateway))",
              .reloaded = true},
    ConfigKey{.name = "ports",
              .value = KeyValue{KeyType::text},
              .text = R"(ports of its simulations, as in `"2001-2100"`, which the gateway passes on to)",
              .reloaded = true},
    ConfigKey{
        .name = "controllers",
        .value = member<&ServerSpec::controllers>,
        .text =
            R"(where the machine takes [controllers](docs/controllers.md#through-a-session-server), as in )"
            R"(`"10.0.0.2:2900"`: those that come to `controllerPort` are passed on there)",
        .reloaded = true},
    ConfigKey{.name = "trusted",
              .value = member<&ServerSpec::trusted>,
              .text = "`true`: the gateway passes on passwords for its monitor, and lets editors of its "
                      "simulations work, see [docs/gateway.md](docs/gateway.md#machines-are-peers)",
              .reloaded = true},
};

constexpr std::array world_keys{
    ConfigKey{.name = "url",
              .value = member<&ListedWorld::url>,
              .text = "address of the world, or of a folder in which machines find worlds",
              .required = true,
              .reloaded = true},
    ConfigKey{.name = "title",
              .value = member<&ListedWorld::title>,
              .text = "what the world is called",
              .absent = "what the world file says",
              .reloaded = true},
    ConfigKey{.name = "text",
              .value = member<&ListedWorld::text>,
              .text = "a line about it",
              .absent = "what the world file says",
              .reloaded = true},
    ConfigKey{.name = "group",
              .value = member<&ListedWorld::group>,
              .text = "heading below which it is shown",
              .reloaded = true},
};

constexpr auto session_address =
    joined(std::array{ConfigKey{.name = "port",
                                .value = member<&SessionConfig::address, &PublicAddress::port>,
                                .text = "port that the server listens on",
                                .min = 1,
                                .max = highest_port,
                                .required = true}},
           joined(address_keys<SessionConfig>(true, ""), std::array{schema_key}));

constexpr std::array session_machines{
    ConfigKey{
        .name = "simulationServers",
        .value = shaped<KeyType::objects, &SessionConfig::simulation_servers>,
        .text = R"(the simulation servers: `"host:port"`, `"host/port"` or `"host/path"`, or objects as in )"
                R"(`{"address": "host/2000", "weight": 2, "labels": ["gpu"]}`; for the gateway with )"
                R"(`"internal": "10.0.0.2:2000"`; for several machines `"dns:name:port"`, )"
                R"(`"srv:service name"` and `"announced"`, see [docs/discovery.md](docs/discovery.md))",
        .absent = "none; only where machines announce themselves (`announcements`)",
        .reloaded = true,
        .keys = machine_keys},
    ConfigKey{
        .name = "announcements",
        .value = member<&SessionConfig::announcements>,
        .text = "simulation servers that know `sessionSecret` may announce themselves, see "
                "[docs/discovery.md](docs/discovery.md#machines-that-announce-themselves)",
    },
    ConfigKey{.name = "nameServers",
              .value = member<&SessionConfig::name_servers>,
              .text = R"(name servers that are asked for `dns:` and `srv:` entries, as in `"10.0.0.53"` or )"
                      R"(`"127.0.0.1:8600"`)",
              .absent = "those of `/etc/resolv.conf`"},
    ConfigKey{.name = "discoverLoopback",
              .value = member<&SessionConfig::discover_loopback>,
              .text = "names and announcements may lead to this machine's loopback addresses",
              .reloaded = true},
    ConfigKey{.name = "gateway",
              .value = member<&SessionConfig::service, &SessionServiceConfig::gateway>,
              .text =
                  "requests for `/2000/...` are passed on to the simulation server `host/2000`, and those "
                  "for `/machine/...` to machines that were found, see "
                  "[docs/gateway.md](docs/gateway.md)",
              .absent = "whether an entry of `simulationServers` has `internal`",
              .reloaded = true},
    ConfigKey{
        .name = "controllerPort",
        .value = member<&SessionConfig::service, &SessionServiceConfig::controller_port>,
        .text = "port where [controllers on other machines](docs/controllers.md#through-a-session-server) "
                "are passed "
                "on to simulation servers with `controllers`; 0: none",
        .max = highest_port,
    },
    ConfigKey{.name = "caFile",
              .value = member<&SessionConfig::http_client, &HttpClientConfig::authorities>,
              .text = "PEM file of certificates, of authorities or of machines, that are trusted besides the "
                      "system's where machines are asked by https; read again when it changes"},
    ConfigKey{.name = "loadRefresh",
              .value = member<&SessionConfig::polls, &LoadMonitorParams::interval>,
              .text = "time between two polls of a machine",
              .unit = "seconds",
              .min = 0.1,
              .max = max_seconds,
              .reloaded = true},
    ConfigKey{.name = "loadTimeout",
              .value = member<&SessionConfig::polls, &LoadMonitorParams::timeout>,
              .text = "time that a machine has to answer a poll",
              .unit = "seconds",
              .min = 0.1,
              .max = max_seconds,
              .reloaded = true},
    ConfigKey{.name = "loadThreshold",
              .value = member<&SessionConfig::polls, &LoadMonitorParams::threshold>,
              .text = "load from which on a machine gets no more sessions",
              .unit = "percent",
              .min = 1,
              .max = 1000,
              .reloaded = true},
    ConfigKey{.name = "memoryThreshold",
              .value = member<&SessionConfig::placement, &SchedulerParams::memory_threshold>,
              .text = "memory in use, with what starting sessions will need, from which on a machine gets no "
                      "more sessions",
              .unit = "percent",
              .min = 1,
              .max = 100,
              .reloaded = true},
    ConfigKey{.name = "scheduling",
              .value = choice<&SessionConfig::placement, &SchedulerParams::policy>,
              .text = "how a machine is chosen, see [docs/scheduling.md](docs/scheduling.md)",
              .choices = policies,
              .reloaded = true},
    ConfigKey{.name = "placementTimeout",
              .value = member<&SessionConfig::placement, &SchedulerParams::placement_timeout>,
              .text = "time for which a session that was sent to a machine counts there before the machine "
                      "reports it, see [docs/scheduling.md](docs/scheduling.md)",
              .unit = "seconds",
              .max = max_seconds},
};

constexpr std::array session_visitors{
    ConfigKey{.name = "relay",
              .value = member<&SessionConfig::service, &SessionServiceConfig::relay>,
              .text =
                  "`true`: the session server finds a machine when a simulation is started, tries another "
                  "one if that refuses, and has browsers wait when all are busy, see "
                  "[docs/visitors.md](docs/visitors.md#when-every-seat-is-taken)",
              .reloaded = true},
    ConfigKey{.name = "waitingRoom",
              .value = member<&SessionConfig::service, &SessionServiceConfig::waiting_room>,
              .text = "with `relay`: how many browsers may wait; 0: none",
              .max = 100'000,
              .reloaded = true},
    ConfigKey{.name = "sessionBurst",
              .value = member<&SessionConfig::service, &SessionServiceConfig::session_burst>,
              .text = "how many requests for `/session` each address or "
                      "[IPv6 network](docs/access.md#networks-of-ipv6) may make at once; 0: unlimited",
              .max = 100'000,
              .reloaded = true},
    ConfigKey{.name = "sessionRate",
              .value = member<&SessionConfig::service, &SessionServiceConfig::session_rate>,
              .text = "how many such requests it may make in the long run; 0: unlimited",
              .unit = "requests per second",
              .max = 100'000,
              .least = 0.01,
              .reloaded = true},
    ConfigKey{.name = "decisionsForAll",
              .value = member<&SessionConfig::service, &SessionServiceConfig::decisions_for_all>,
              .text = "`true`: everybody may read `/api/decisions`",
              .reloaded = true},
};

constexpr std::array session_pages{
    ConfigKey{.name = "teacherPassword",
              .value = secret<&SessionConfig::service, &SessionServiceConfig::teacher_password>,
              .text = "password with which teachers open [classes](docs/visitors.md#classes)",
              .absent = "none: without one there are no classes",
              .reloaded = true},
    ConfigKey{.name = "teacherPasswordFile",
              .value = member<&SessionConfig::service, &SessionServiceConfig::teacher_password_file>,
              .text = "a file whose only line is that password, instead of `teacherPassword`",
              .reloaded = true},
    ConfigKey{.name = "viewerUrl",
              .value = member<&SessionConfig::service, &SessionServiceConfig::viewer_url>,
              .text = "address of the world that the viewer suggests",
              .reloaded = true},
    ConfigKey{.name = "worlds",
              .value = shaped<KeyType::objects, &SessionConfig::service, &SessionServiceConfig::worlds>,
              .text = R"(what the [gallery](docs/gallery.md) shows: addresses of worlds and of folders, or )"
                      R"(objects as in `{"url": "local:/school/week_1", "group": "Week 1"}`; `[]`: there is )"
                      "no gallery",
              .absent = "`viewerUrl`, and all worlds in plain folders of the machines",
              .reloaded = true,
              .keys = world_keys},
    ConfigKey{.name = "pauseHidden",
              .value = member<&SessionConfig::service, &SessionServiceConfig::pause_hidden>,
              .text =
                  "time after which the viewer, or the page of a class, pauses a simulation whose page is "
                  "hidden, see [docs/visitors.md](docs/visitors.md#hidden-pages); 0: it runs on",
              .unit = "seconds",
              .max = max_seconds,
              .reloaded = true},
};

constexpr std::array session_mail{
    ConfigKey{.name = "administrator",
              .value = free_text<&SessionConfig::mail, &MailConfig::administrator>,
              .text =
                  "address of the operator, who gets an e-mail when a server fails, recovers, is full, or "
                  "has room again",
              .reloaded = true},
    ConfigKey{.name = "mailServer",
              .value = free_text<&SessionConfig::mail, &MailConfig::server>,
              .text = "host that sends these mails",
              .reloaded = true},
    ConfigKey{.name = "mailServerPort",
              .value = member<&SessionConfig::mail, &MailConfig::server_port>,
              .text = "port of `mailServer`; 0: 25; at 465 TLS begins at once",
              .max = highest_port,
              .reloaded = true},
    ConfigKey{.name = "mailSender",
              .value = free_text<&SessionConfig::mail, &MailConfig::sender>,
              .text = "address that mails come from",
              .reloaded = true},
    ConfigKey{.name = "mailSenderUser",
              .value = member<&SessionConfig::mail, &MailConfig::user>,
              .text = "user name at `mailServer`",
              .absent = "that of `mailSender`",
              .reloaded = true},
    ConfigKey{.name = "mailSenderPassword",
              .value = secret<&SessionConfig::mail, &MailConfig::password>,
              .text =
                  "password at `mailServer`; with one, mails are sent after a login, and by STARTTLS unless "
                  "`mailServerPort` is 465",
              .reloaded = true},
};

constexpr std::array all_session_topics{
    ConfigTopic{address_title, session_address},
    ConfigTopic{"Machines and placement", session_machines},
    ConfigTopic{"Visitors", session_visitors},
    ConfigTopic{"Classes and the viewer", session_pages},
    ConfigTopic{secure_title, secure_keys<SessionConfig>},
    ConfigTopic{access_title, access_keys<SessionConfig>},
    ConfigTopic{connection_title, connection_keys<SessionConfig>},
    ConfigTopic{"E-mail to the operator", session_mail},
    ConfigTopic{log_title, log_keys<SessionConfig>},
};

} // namespace

std::span<ConfigTopic const> session_topics() noexcept
{
    return all_session_topics;
}

} // namespace webots_cloud::core
