// What the configuration file says: README.md has the table.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace website_host {

/// Somebody who may save controllers.
struct User
{
    std::uint32_t id = 0; ///< Greater than 0.
    std::string name;
    std::string email;
    std::string password;
};

/// A world that the page offers, and the controller that can be changed in it.
struct Project
{
    std::string name;  ///< A folder of the simulation server's `projectsDir`.
    std::string world; ///< As `arena.wbt`.
    std::string controller;
    std::string title;
};

struct Configuration
{
    std::string address = "127.0.0.1";
    std::uint16_t port = 1998;
    std::vector<std::string> hosts{"localhost", "127.0.0.1", "[::1]"}; ///< As browsers call this server.
    std::string session_server = "ws://localhost:1999";
    std::filesystem::path
        key_file; ///< The key that simulation servers have to know; made if it is not there.
    std::filesystem::path users_folder;
    std::filesystem::path page_folder;
    std::string hint; ///< Shown beside the form with which users sign in.
    std::vector<User> users;
    std::vector<Project> projects;
};

/// Errors: `invalid_config`, naming the file and what is wrong.
webots_cloud::result<Configuration> read_configuration(std::filesystem::path const& file);

/// Adds `distance` to our port, and to that of a session server on this machine.
/// Errors: `invalid_argument`: one of them would be no port.
webots_cloud::result<> move_ports(Configuration& configuration, int distance);

} // namespace website_host
