// Reads the configuration of the website host, whose keys and their types are known.
#include "configuration.hpp"

#include "user_files.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <stdexcept>

namespace website_host {

namespace json = boost::json;
using webots_cloud::errc;
using webots_cloud::Failure;
using webots_cloud::result;

namespace {

constexpr std::size_t max_configuration = std::size_t{1} << 20;

/// Thrown and caught in this file only.
struct Invalid : std::runtime_error
{
    using std::runtime_error::runtime_error;
};

/// Reads the keys of one object, and says which ones nobody knows.
class ObjectReader
{
public:
    ObjectReader(json::value const& value, std::string where) : where_(std::move(where))
    {
        if (!value.is_object())
            throw Invalid(where_ + " is no object");
        object_ = value.get_object();
    }

    std::string text(char const* key, std::string otherwise)
    {
        auto const* const value = take(key);
        if (!value)
            return otherwise;
        if (!value->is_string())
            throw Invalid(named(key) + " is no string");
        return std::string(value->get_string());
    }

    std::string required_text(char const* key)
    {
        auto text_of = text(key, {});
        if (text_of.empty())
            throw Invalid(named(key) + " is missing");
        return text_of;
    }

    std::int64_t number(char const* key, std::int64_t otherwise, std::int64_t min, std::int64_t max)
    {
        auto const* const value = take(key);
        if (!value)
            return otherwise;
        if (!value->is_int64() || value->get_int64() < min || value->get_int64() > max)
            throw Invalid(named(key) + " is no whole number from " + std::to_string(min) + " to " +
                          std::to_string(max));
        return value->get_int64();
    }

    json::array list(char const* key)
    {
        auto const* const value = take(key);
        if (!value)
            return {};
        if (!value->is_array())
            throw Invalid(named(key) + " is no list");
        return value->get_array();
    }

    bool has(char const* key) const { return object_.contains(key); }

    void finish() const
    {
        for (auto const& pair : object_)
            if (std::find(known_.begin(), known_.end(), pair.key()) == known_.end())
                throw Invalid("nobody knows the key \"" + std::string(pair.key()) + "\" of " + where_);
    }

private:
    json::value const* take(char const* key)
    {
        known_.emplace_back(key);
        return object_.if_contains(key);
    }
    std::string named(char const* key) const { return "\"" + std::string(key) + "\" of " + where_; }

    json::object object_;
    std::string where_;
    std::vector<std::string> known_;
};

User read_user(json::value const& value, std::size_t index)
{
    ObjectReader reader(value, "user " + std::to_string(index + 1));
    User user;
    user.id = static_cast<std::uint32_t>(reader.number("id", 0, 0, std::numeric_limits<std::int32_t>::max()));
    if (user.id == 0)
        throw Invalid("\"id\" of user " + std::to_string(index + 1) + " is no number greater than 0");
    user.name = reader.required_text("name");
    user.email = reader.required_text("email");
    user.password = reader.required_text("password");
    reader.finish();
    return user;
}

Project read_project(json::value const& value, std::size_t index)
{
    auto const where = "project " + std::to_string(index + 1);
    ObjectReader reader(value, where);
    Project project;
    project.name = reader.required_text("name");
    project.world = reader.required_text("world");
    project.controller = reader.required_text("controller");
    project.title = reader.text("title", project.name);
    reader.finish();
    for (auto const& name : {project.name, project.world, project.controller})
        if (!is_plain_name(name))
            throw Invalid("\"" + name + "\" of " + where +
                          " is no name: letters, digits, '_', '-', '.' and blanks were expected");
    if (!project.world.ends_with(".wbt"))
        throw Invalid("\"world\" of " + where + " does not end with .wbt");
    return project;
}

template<class Item, class Same>
void require_different(std::vector<Item> const& items, Same const& same, std::string const& complaint)
{
    for (auto one = items.begin(); one != items.end(); ++one)
        if (std::any_of(one + 1, items.end(), [&](Item const& other) { return same(*one, other); }))
            throw Invalid(complaint);
}

Configuration read(json::value const& value)
{
    ObjectReader reader(value, "the configuration");
    Configuration configuration;
    configuration.address = reader.text("address", configuration.address);
    configuration.port = static_cast<std::uint16_t>(reader.number("port", configuration.port, 0, 65535));
    bool const has_hosts = reader.has("hosts");
    auto const hosts = reader.list("hosts");
    if (has_hosts)
        configuration.hosts.clear();
    for (auto const& host : hosts) {
        if (!host.is_string() || host.get_string().empty())
            throw Invalid("\"hosts\" is no list of names");
        configuration.hosts.emplace_back(host.get_string());
    }
    configuration.session_server = reader.text("sessionServer", configuration.session_server);
    if (!configuration.session_server.starts_with("ws://") &&
        !configuration.session_server.starts_with("wss://"))
        throw Invalid("\"sessionServer\" does not begin with ws:// or wss://");
    if (configuration.session_server.find_first_of(" '\";,<>") != std::string::npos)
        throw Invalid("\"sessionServer\" is no address");
    configuration.key_file = reader.required_text("keyFile");
    configuration.users_folder = reader.required_text("usersDir");
    configuration.page_folder = reader.text("pageDir", "examples/website_host/page");
    configuration.hint = reader.text("hint", {});
    auto const users = reader.list("users");
    for (std::size_t i = 0; i < users.size(); ++i)
        configuration.users.push_back(read_user(users[i], i));
    auto const projects = reader.list("projects");
    for (std::size_t i = 0; i < projects.size(); ++i)
        configuration.projects.push_back(read_project(projects[i], i));
    if (projects.empty())
        throw Invalid("\"projects\" is missing");
    reader.finish();
    auto const same_user = [](User const& one, User const& other) {
        return one.id == other.id || one.email == other.email;
    };
    require_different(configuration.users, same_user, "two users have the same \"id\" or \"email\"");
    auto const same_project = [](Project const& one, Project const& other) { return one.name == other.name; };
    require_different(configuration.projects, same_project, "two projects have the same \"name\"");
    return configuration;
}

int moved(int port, int distance)
{
    constexpr int last = std::numeric_limits<std::uint16_t>::max();
    int const to = port + std::clamp(distance, -last, last);
    return port > 0 && to > 0 && to <= last ? to : 0;
}

/// As in `ws://localhost:1999`.
bool is_on_this_machine(std::string_view address)
{
    auto const host = address.substr(address.find("//") + 2);
    return host.starts_with("localhost:") || host.starts_with("127.") || host.starts_with("[::1]:");
}

} // namespace

result<> move_ports(Configuration& configuration, int distance)
{
    auto& session = configuration.session_server;
    auto const refused =
        Failure(errc::invalid_argument,
                "A port can't be moved by " + std::to_string(distance) + ": ports end at 65535.");
    int const own = moved(configuration.port, distance);
    if (own == 0 && distance != 0)
        return refused;
    if (distance != 0)
        configuration.port = static_cast<std::uint16_t>(own);
    auto const colon = session.rfind(':');
    if (distance == 0 || !is_on_this_machine(session) || session.find('/', colon) != std::string::npos)
        return {};
    int const theirs = moved(std::atoi(session.c_str() + colon + 1), distance);
    if (theirs == 0)
        return refused;
    session.replace(colon + 1, std::string::npos, std::to_string(theirs));
    return {};
}

result<Configuration> read_configuration(std::filesystem::path const& file)
{
    auto const refuse = [&](std::string const& why) {
        return Failure(errc::invalid_config, file.string() + ": " + why + ".");
    };
    auto const text = webots_cloud::read_regular_file(file, max_configuration);
    if (!text)
        return refuse(text.error().message());
    boost::system::error_code malformed;
    auto const value = json::parse(*text, malformed);
    if (malformed)
        return refuse("this is no JSON (" + malformed.message() + ")");
    try {
        return read(value);
    } catch (Invalid const& why) {
        return refuse(why.what());
    }
}

} // namespace website_host
