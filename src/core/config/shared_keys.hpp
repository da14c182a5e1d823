// The keys that the configurations of both servers have, with the members that keep them. A template for each
// topic: `Config` is the configuration that has them.
#pragma once

#include "key_value.hpp"

#include <webots_cloud/config.hpp>

#include <array>
#include <string_view>

namespace webots_cloud::core {

inline constexpr double max_seconds = 10'000'000;
inline constexpr double highest_port = 65'535;

inline constexpr std::array<std::string_view, 2> log_formats{"text", "json"};

inline constexpr ConfigKey schema_key{
    .name = "$schema",
    .value = ignored_text,
    .text = "where editors find the description of the keys, by which they complete and check them; "
            "`config/session.schema.json` and `config/simulation.schema.json` are installed with the servers",
    .reloaded = true};

template<class Config>
inline constexpr std::array secure_keys{
    ConfigKey{
        .name = "sslCertificate",
        .value = member<&Config::network, &NetworkConfig::ssl_certificate>,
        .text = "PEM file of the certificate: with it and `sslKey` the server itself speaks TLS 1.3 and 1.2 "
                "(with forward secrecy), and reloads renewed files while it runs"},
    ConfigKey{.name = "sslKey",
              .value = member<&Config::network, &NetworkConfig::ssl_key>,
              .text = "PEM file of the key of `sslCertificate`"},
    ConfigKey{.name = "redirectPort",
              .value = member<&Config::network, &NetworkConfig::redirect_port>,
              .text =
                  "with TLS: a port, usually 80, where every request is sent to the same address by https",
              .max = highest_port},
    ConfigKey{.name = "challengeFolder",
              .value = member<&Config::network, &NetworkConfig::challenge_folder>,
              .text =
                  "with `redirectPort`: the folder in which `certbot --webroot` puts what it wants to find "
                  "at that port"},
};

template<class Config>
inline constexpr std::array connection_keys{
    ConfigKey{
        .name = "listenAddress",
        .value = member<&Config::network, &NetworkConfig::listen_address>,
        .text = "numeric address of this machine at which the server's ports are opened; `::` is all, "
                "and with `127.0.0.1` only this machine reaches them",
    },
    ConfigKey{.name = "connectionsPerAddress",
              .value = member<&Config::network, &NetworkConfig::connections_per_address>,
              .text = "maximum number of connections from one address or [IPv6 "
                      "network](docs/access.md#networks-of-ipv6), never more than three quarters of what the "
                      "limit of open files allows; trusted proxies are "
                      "not limited",
              .min = 1,
              .max = 1'000'000},
    ConfigKey{.name = "pingTimeout",
              .value = member<&Config::network, &NetworkConfig::ping_timeout>,
              .text = "time after which a browser that answers no ping is considered disconnected; 0: never, "
                      "see [docs/visitors.md](docs/visitors.md#lost-connections)",
              .unit = "seconds",
              .max = max_seconds,
              .least = 2}, // connections are looked at once a second
    ConfigKey{
        .name = "pingInterval",
        .value = member<&Config::network, &NetworkConfig::ping_interval>,
        .text = "time of silence after which a browser is pinged, or half of `pingTimeout` if that is less: "
                "shorter than the time-out of every proxy in between",
        .unit = "seconds",
        .min = 1,
        .max = max_seconds},
    ConfigKey{
        .name = "trustedProxies",
        .value = member<&Config::network, &NetworkConfig::trusted_proxies>,
        .text = "addresses and networks of proxies whose `X-Forwarded-For`, `X-Forwarded-Prefix`, "
                "`X-Forwarded-Proto` and `X-Forwarded-Port` are trusted, see "
                "[docs/access.md](docs/access.md#clients-behind-proxies)",
    },
};

template<class Config>
inline constexpr std::array access_keys{
    ConfigKey{.name = "hostNames",
              .value = member<&Config::access, &AccessConfig::host_names>,
              .text = "names by which browsers may call this machine besides `server`, see "
                      "[docs/access.md](docs/access.md#which-pages-may-use-a-server)",
              .absent = "this machine's name",
              .reloaded = true},
    ConfigKey{.name = "allowedOrigins",
              .value = member<&Config::access, &AccessConfig::allowed_origins>,
              .text =
                  R"(sites whose pages may use the server, as in `"https://*.example.org"`; `"*"` is all)",
              .absent = "see [docs/access.md](docs/access.md#which-pages-may-use-a-server)",
              .reloaded = true},
    ConfigKey{.name = "frameAncestors",
              .value = member<&Config::access, &AccessConfig::frame_ancestors>,
              .text = "sites that may show the server's pages in a frame",
              .absent = "those of `allowedOrigins`",
              .reloaded = true},
    ConfigKey{.name = "monitorAddresses",
              .value = member<&Config::access, &AccessConfig::monitor_addresses>,
              .text = "addresses and networks of clients that may see `/monitor` and `/metrics`",
              .absent = "all, unless there is `monitorPassword`",
              .reloaded = true},
    ConfigKey{.name = "monitorPassword",
              .value = secret<&Config::access, &AccessConfig::monitor_password>,
              .text = "password with which clients log in as `operator` to see `/monitor` and `/metrics`",
              .reloaded = true},
    ConfigKey{.name = "operatorTokenFile",
              .value = member<&Config::access, &AccessConfig::operator_token_file>,
              .text = "file of the token by which [the operator](docs/access.md#who-is-the-operator) is "
                      "recognized over the network",
              .reloaded = true},
    ConfigKey{.name = "operatorSocket",
              .value = member<&Config::access, &AccessConfig::operator_socket>,
              .text = "socket at which the server's own user gives it commands",
              .absent = "see [docs/access.md](docs/access.md#who-is-the-operator)"},
    ConfigKey{.name = "sessionSecret",
              .value = member<&Config::access, &AccessConfig::session_secret>,
              .text =
                  "file of a word that session and simulation servers share: `/session` hands out tickets, "
                  "without which no simulation starts, see [docs/gateway.md](docs/gateway.md#tickets)"},
};

template<class Config>
inline constexpr std::array log_keys{
    ConfigKey{
        .name = "logDir",
        .value = member<&Config::log_dir>,
        .text = "folder of the log files",
    },
    ConfigKey{
        .name = "debug",
        .value = member<&Config::debug>,
        .text = "`true`: log to standard output instead of the file",
    },
    ConfigKey{.name = "logFormat",
              .value = choice<&Config::json_log>,
              .text = "`json` is for log collectors",
              .choices = log_formats},
};

/// `server`: the host, out of which `read_server_name` takes the path.
template<class Config>
inline constexpr KeyValue server_name = [] {
    auto value = member<&Config::address, &PublicAddress::host>;
    value.equal = [](void const* left, void const* right) {
        auto const& one = static_cast<Config const*>(left)->address;
        auto const& other = static_cast<Config const*>(right)->address;
        return one.host == other.host && one.path == other.path;
    };
    value.copy = [](void const* from, void* to) {
        auto const& source = static_cast<Config const*>(from)->address;
        auto& target = static_cast<Config*>(to)->address;
        target.host = source.host;
        target.path = source.path;
    };
    return value;
}();

/// How browsers reach a server, beside its `port`.
template<class Config>
constexpr std::array<ConfigKey, 3> address_keys(bool reloaded, std::string_view alias)
{
    return {ConfigKey{.name = "server",
                      .value = server_name<Config>,
                      .text = "public host name, or `*`: [whatever the browser called "
                              "it](docs/site.md#a-class-in-one-network); behind a proxy that has the server "
                              "below a path with that, `host/path`",
                      .reloaded = reloaded,
                      .alias = alias},
            ConfigKey{.name = "ssl",
                      .value = member<&Config::address, &PublicAddress::ssl>,
                      .text = "whether the addresses that browsers get are `wss` and `https`",
                      .reloaded = reloaded},
            ConfigKey{.name = "portRewrite",
                      .value = member<&Config::address, &PublicAddress::port_rewrite>,
                      .text = "whether the port is part of the path in these addresses, as in "
                              "`wss://example.org/2000`: a proxy in front looks there",
                      .reloaded = reloaded}};
}

/// Two tables as one.
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

inline constexpr std::string_view address_title = "Address";
inline constexpr std::string_view secure_title = "TLS";
inline constexpr std::string_view connection_title = "Connections";
inline constexpr std::string_view access_title = "Who may do what";
inline constexpr std::string_view log_title = "Logs";

} // namespace webots_cloud::core
