// Reads the configuration of each kind of server as that does, and takes from it what whoever starts it
// has to know: ports, addresses, where people find it.
#include "settings.hpp"

#include "app/daemon.hpp"
#include "core/access/asked_name.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"

#include <boost/asio/ip/address.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include <algorithm>

namespace webots_cloud::site {
namespace {

namespace json = boost::json;
using core::concat;

template<class Config>
void take_common(Settings& settings, Config const& config)
{
    settings.address = config.address;
    settings.listen_address = config.network.listen_address;
    settings.redirect_port = config.network.redirect_port;
    settings.certificate = config.network.ssl_certificate;
    settings.key = config.network.ssl_key;
    settings.log_dir = config.log_dir;
    settings.operator_token_file = config.access.operator_token_file;
}

template<class Config>
result<Config> parse_moved(result<Configured<Config>> configured, int moved)
{
    if (!configured)
        return configured.error();
    if (auto const done = app::move_ports(configured->config, moved); !done)
        return done.error();
    return std::move(configured->config);
}

result<Settings> parse_session(Settings settings, std::string_view text, int moved)
{
    auto const config = parse_moved(parse_session_config(text, settings.file), moved);
    if (!config)
        return config.error();
    take_common(settings, *config);
    settings.teacher_password_file = config->service.teacher_password_file;
    settings.has_classes =
        !settings.teacher_password_file.empty() || !config->service.teacher_password.empty();
    settings.hears_machines = settings.certificate.empty() ||
                              std::ranges::any_of(config->simulation_servers, [](ServerSpec const& each) {
                                  return !each.internal_address.empty();
                              });
    return settings;
}

result<Settings> parse_simulation(Settings settings, std::string_view text, int moved)
{
    auto const config = parse_moved(parse_simulation_config(text, settings.file), moved);
    if (!config)
        return config.error();
    take_common(settings, *config);
    if (!config->docker && !config->slurm)
        settings.simulation_ports = config->launching.max_simulations;
    return settings;
}

/// The website host says itself, with --check-config, what is wrong with its configuration.
result<Settings> parse_website(Settings settings, std::string_view text, int moved)
{
    constexpr int usual_port = 1998;
    json::error_code failed;
    auto const value = json::parse(text, failed);
    auto const* const object = failed ? nullptr : value.if_object();
    if (!object)
        return Failure(errc::invalid_config, concat(settings.file, ": expected an object of JSON"));
    auto const* const port = object->if_contains("port");
    auto const* const address = object->if_contains("address");
    json::error_code no_integer;
    auto number = port ? port->is_number() ? port->to_number<std::int64_t>(no_integer) : 0 : usual_port;
    number = no_integer ? 0 : number + moved;
    if (number < 1 || number > 65'535)
        return Failure(errc::invalid_config,
                       concat(settings.file, ": expected a port, found ", std::to_string(number)));
    settings.address.port = static_cast<std::uint16_t>(number);
    settings.address.ssl = false;
    settings.address.port_rewrite = false;
    settings.listen_address =
        address && address->is_string() ? std::string(address->get_string()) : "127.0.0.1";
    return settings;
}

} // namespace

result<Settings> parse_settings(Kind kind, std::string const& file, std::string_view text, int moved)
{
    Settings settings;
    settings.kind = kind;
    settings.file = file;
    return kind == Kind::session      ? parse_session(std::move(settings), text, moved)
           : kind == Kind::simulation ? parse_simulation(std::move(settings), text, moved)
                                      : parse_website(std::move(settings), text, moved);
}

result<Settings> read_settings(Kind kind, std::string const& file, int moved)
{
    auto const text = app::read_config_file(file);
    return text ? parse_settings(kind, file, *text, moved) : result<Settings>(text.error());
}

std::vector<std::uint16_t> ports_of(Settings const& settings)
{
    std::vector<std::uint16_t> ports{settings.address.port};
    if (settings.redirect_port != 0)
        ports.push_back(settings.redirect_port);
    return ports;
}

std::string own_address(std::string_view listen_address)
{
    bool const is_everywhere =
        listen_address == "::" || listen_address == "0.0.0.0" || listen_address.empty();
    return is_everywhere ? "127.0.0.1" : std::string(listen_address);
}

bool is_for_this_machine(Settings const& settings)
{
    boost::system::error_code failed;
    auto const address = boost::asio::ip::make_address(settings.listen_address, failed);
    return !failed && address.is_loopback();
}

std::string machine_address(Settings const& settings, Settings const* session)
{
    auto const own = concat(settings.address.host, "/", std::to_string(settings.address.port));
    if (session && settings.address.port_rewrite)
        if (auto const path = core::path_at_own_port(session->address, own); !path.empty())
            return concat(site_address(*session), path.substr(1), "/");
    return site_address(settings);
}

std::string site_address(Settings const& settings, std::string_view host)
{
    auto address = settings.address;
    if (address.host == core::asked_name) {
        address.host = host;
        address.port_rewrite = false;
    }
    auto url = core::public_http_url(address);
    constexpr std::string_view usual_port = ":443";
    if (address.ssl && url.ends_with(usual_port))
        url.resize(url.size() - usual_port.size());
    return url + "/";
}

} // namespace webots_cloud::site
