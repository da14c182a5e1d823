#include "port_holder.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::site {
namespace {

using core::concat;

constexpr std::string_view listening = "0A"; // TCP_LISTEN

std::vector<std::string_view> words_of(std::string_view line)
{
    auto words = core::split(line, ' ');
    std::erase_if(words, [](std::string_view word) { return word.empty(); });
    return words;
}

template<class Number>
Number number(std::string_view text, int base = 10)
{
    Number value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value, base);
    return value;
}

/// As a word of a shell.
std::string for_shell(std::string_view path)
{
    constexpr std::string_view plain =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/_.,:+-@";
    if (path.find_first_not_of(plain) == std::string_view::npos)
        return std::string(path);
    std::string text = "'";
    for (char const c : path)
        text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

bool has_any(std::vector<std::uint64_t> const& sockets, std::vector<Listener> const& listeners)
{
    return std::ranges::any_of(listeners, [&](Listener const& each) {
        return std::ranges::find(sockets, each.inode) != sockets.end();
    });
}

} // namespace

std::vector<Listener> parse_listeners(std::string_view table, std::uint16_t port)
{
    enum : std::size_t
    {
        local = 1,
        state = 3,
        user = 7,
        inode = 9
    };
    std::vector<Listener> found;
    for (auto const line : core::split(table, '\n')) {
        auto const words = words_of(line);
        if (words.size() <= inode || words[state] != listening)
            continue;
        auto const colon = words[local].rfind(':');
        if (colon != std::string_view::npos && number<unsigned>(words[local].substr(colon + 1), 16) == port)
            found.emplace_back(number<std::uint64_t>(words[inode]), number<uid_t>(words[user]));
    }
    return found;
}

Suspect const* holder_of(std::uint16_t port, std::vector<Listener> const& listeners,
                         std::vector<Suspect> const& suspects)
{
    for (auto const& each : suspects)
        if (has_any(each.sockets, listeners))
            return &each;
    for (auto const& each : suspects) {
        auto const is_theirs = [&](Listener const& listener) { return listener.user == each.process.user; };
        if (std::ranges::find(each.ports, port) != each.ports.end() &&
            std::ranges::any_of(listeners, is_theirs))
            return &each;
    }
    return nullptr;
}

std::string other_ports(PortUse const& use)
{
    constexpr std::uint16_t step = 1000;
    constexpr std::uint16_t last = 65'535 - 2 * step; // with those of simulations
    auto const port = use.site_port > last ? use.site_port - step : use.site_port + step;
    auto const name = use.name == "local" ? std::string() : " " + use.name;
    auto text = concat("move the whole site with ./server.sh start", name, " --port ", std::to_string(port),
                       ", or change \"", use.is_redirect ? "redirectPort" : "port", "\" in ",
                       config_file(use.kind, use.name));
    if (use.kind == Kind::simulation && use.has_session)
        text += concat(" and \"simulationServers\" in ", config_file(Kind::session, use.name));
    if (use.kind == Kind::session && use.has_website && !use.is_redirect)
        text += concat(" and \"sessionServer\" in ", config_file(Kind::website_host, use.name));
    return text;
}

Holder describe_holder(Process const& process, std::string const& owner, bool has_script)
{
    Holder holder;
    auto const id = std::to_string(process.id);
    auto const server = parse_server(process.arguments);
    if (!server) {
        auto const& path = process.arguments.front();
        auto const slash = path.rfind('/');
        holder.who = concat("another program, ",
                            core::printable(slash == std::string::npos ? path : path.substr(slash + 1)), " (",
                            id, ")");
        return holder;
    }
    auto const as_owner = owner.empty() ? std::string() : concat(", as ", owner, " or root");
    std::string const checkout(checkout_of(*server));
    if (!checkout.empty() && has_script) {
        holder.who = concat("a ", called(server->kind), " of ", core::printable(checkout), " (", id, ")");
        holder.remedy = concat("Stop it with ", for_shell(concat(checkout, "/server.sh")), " stop", as_owner);
    } else if (!checkout.empty()) {
        holder.who = concat("a ", called(server->kind), " of ", core::printable(checkout), " (", id, ")");
        holder.remedy = concat("Stop it with kill ", id, as_owner);
    } else if (server->configuration.starts_with("/etc/webots")) {
        holder.who = concat("the ", called(server->kind), " that is installed on this machine (", id, ")");
        holder.remedy = concat("Stop it with sudo systemctl stop ", program_of(server->kind));
    } else {
        holder.who = concat("a ", called(server->kind), " (", id, ")");
        holder.remedy = concat("Stop it with kill ", id, as_owner);
    }
    return holder;
}

} // namespace webots_cloud::site
