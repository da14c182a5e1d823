#include "unit_test.hpp"

#include "core/config/simulation_files.hpp"

#include <algorithm>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(simulation_files)

namespace {

bool has(std::vector<std::filesystem::path> const& paths, std::filesystem::path const& path)
{
    return std::find(paths.begin(), paths.end(), path) != paths.end();
}

SimulationFilesContext context()
{
    SimulationFilesContext context;
    context.config_file = "/opt/conf/simulation.json";
    context.socket = "/run/w/simulation-2000.sock";
    context.instances = "/var/lib/w/2000/instances";
    context.caches = "/var/cache/w";
    context.templates = "/opt/webots/projects";
    context.groups = {"/sys/fs/cgroup/memory"};
    return context;
}

SimulationConfig config()
{
    SimulationConfig config;
    config.log_dir = "/var/log/w";
    config.websites.keys = "/srv/key";
    ForgeConfig folder("local:");
    folder.directory = "/srv/worlds";
    config.forges.push_back(folder);
    return config;
}

} // namespace

BOOST_AUTO_TEST_CASE(projects_are_written_logs_and_the_cache_and_nothing_that_root_uses)
{
    auto const files = simulation_server_files(config(), context());
    for (auto const* folder : {"/var/log/w", "/run/w", "/var/lib/w/2000/instances", "/var/cache/w"})
        BOOST_TEST(has(files.write, folder), folder);
    BOOST_TEST(files.write.size() == 5U); // and /dev/null
    for (auto const* folder : {"/opt/conf", "/srv/key", "/srv/worlds", "/opt/webots/projects", "/etc"})
        BOOST_TEST(has(files.read, folder), folder);
    for (auto const* folder : {"/", "/home", "/root", "/var", "/var/lib/w", "/var/lib/w/2000", "/tmp", "/dev",
                               "/sys/fs/cgroup/memory", ""})
        BOOST_TEST((!has(files.read, folder) && !has(files.write, folder)), folder);
}

BOOST_AUTO_TEST_CASE(what_may_be_renewed_is_reached_by_its_folder)
{
    auto with_secrets = config();
    with_secrets.network.ssl_certificate = "/certs/live/cert.pem";
    with_secrets.network.ssl_key = "/keys/key.pem";
    with_secrets.network.challenge_folder = "/srv/challenges";
    with_secrets.access.operator_token_file = "/srv/t/token";
    with_secrets.access.session_secret = "/srv/s/secret";
    with_secrets.http_client.authorities = "/authorities/campus.pem";
    auto const files = simulation_server_files(with_secrets, context());
    for (auto const* folder : {"/certs/live", "/keys", "/authorities", "/srv/challenges", "/srv/t", "/srv/s"})
        BOOST_TEST(has(files.read, folder), folder);
}

BOOST_AUTO_TEST_CASE(control_groups_are_removed_but_not_changed)
{
    auto const files = simulation_server_files(config(), context());
    BOOST_TEST((files.tidy == std::vector<std::filesystem::path>{"/sys/fs/cgroup/memory"}));
}

BOOST_AUTO_TEST_CASE(with_containers_their_templates_are_read_and_nothing_of_websites)
{
    auto with_containers = config();
    with_containers.docker = true;
    with_containers.containers.directory = "/opt/docker";
    auto const files = simulation_server_files(with_containers, context());
    BOOST_TEST(has(files.read, "/opt/docker"));
    BOOST_TEST(!has(files.read, "/srv/key"));
    BOOST_TEST(!has(files.read, "/opt/webots/projects"));
}

BOOST_AUTO_TEST_SUITE_END()
