// Configurations: what is accepted can be served with and holds nothing that steers a terminal or ends a
// line; what is refused is so in printable sentences of bounded length, a line each.
#include "fuzz.hpp"

#include "core/notices/mail_message.hpp"
#include "core/text.hpp"

#include <webots_cloud/config.hpp>

#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

constexpr std::string_view origin = "c\x1b[2J.json";

void check_sentence(std::string_view sentence)
{
    fuzz::require(core::is_printable(sentence) && sentence.size() <= 8192);
    fuzz::require(sentence.starts_with("c\\x1b[2J.json:"));
}

void check_plain(std::vector<std::string> const& texts)
{
    for (auto const& text : texts)
        fuzz::require(core::is_printable(text));
}

void check_network(NetworkConfig const& network)
{
    check_plain({network.ssl_certificate.string(), network.ssl_key.string()});
    fuzz::require(network.ssl_certificate.empty() == network.ssl_key.empty());
    fuzz::require(network.connections_per_address > 0);
}

void check(SessionConfig const& config)
{
    check_network(config.network);
    check_plain({config.address.host, config.mail.administrator, config.mail.server, config.mail.sender,
                 config.mail.user, config.mail.password, config.log_dir.string(), config.placement.policy,
                 config.service.viewer_url});
    fuzz::require(config.address.port > 0 && config.polls.interval > Duration::zero() &&
                  config.polls.timeout > Duration::zero());
    for (auto const& server : config.simulation_servers) {
        check_plain({server.address});
        fuzz::require(server.address.find(' ') == std::string::npos && server.weight > 0);
    }
    if (!config.mail.administrator.empty())
        fuzz::require(core::is_mail_address(config.mail.administrator) &&
                      core::is_mail_address(config.mail.sender) && core::is_mail_host(config.mail.server));
}

void check(SimulationConfig const& config)
{
    check_network(config.network);
    check_plain({config.address.host, config.containers.directory.string(), config.containers.images,
                 config.webots_home.string(), config.display, config.websites.projects.string(),
                 config.websites.keys.string(), config.launching.multimedia_server,
                 config.launching.multimedia_stream, config.log_dir.string()});
    check_plain(config.service.repositories.allowed);
    check_plain(config.service.repositories.blocked);
    check_plain(config.service.notify);
    for (auto const& forge : config.forges)
        check_plain({forge.url, forge.directory.string()});
    int const editors = config.docker ? 500 : 0;
    fuzz::require(config.address.port > 0 && config.launching.max_simulations > 0);
    fuzz::require(config.address.port + config.launching.max_simulations + editors <= 65535);
    fuzz::require(config.launching.timeout >= std::chrono::seconds(360) &&
                  config.launching.start_timeout >= std::chrono::seconds(1));
    fuzz::require(config.launching.multimedia_stream.find_first_of(" \";") == std::string::npos);
}

template<class Config>
void read(std::string_view text,
          result<Configured<Config>> (*parse)(std::string_view, std::filesystem::path const&))
{
    auto const configured = parse(text, origin);
    if (!configured) {
        fuzz::require(configured.error() == errc::invalid_config);
        auto const lines = configured.error().message();
        for (auto const line : core::split(lines, '\n'))
            check_sentence(line);
        return;
    }
    for (auto const& warning : configured->warnings)
        check_sentence(warning);
    check(configured->config);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto text = fuzz::text_of(data, size);
    if (fuzz::take_byte(text) % 2 == 0)
        read(text, parse_session_config);
    else
        read(text, parse_simulation_config);
    return 0;
}
