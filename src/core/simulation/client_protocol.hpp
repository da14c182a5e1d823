// The texts of the WebSocket /client (protocol section 4.1): what browsers send, and what they get.
#pragma once

#include "staging_messages.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/website_project.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

namespace webots_cloud::core {

/// `{"start":{"url":"...","mode":"..."}}`
struct StartMessage
{
    StartMessage() = default;

    std::string url;
    std::string mode; ///< Empty when the browser named none.
    /// Whether the browser returns after it has lost its connection, or was reloaded.
    bool can_return = false;
    bool wants_heartbeat = false;
    bool can_extend = false; ///< Its page has a button for `extend`.
    bool fetch_only = false; ///< No simulator is to be started: the project is to be in the cache for others.
    bool relayed = false;    ///< It comes from a session server, which can ask another machine.
    bool wants_reasons = false; ///< Its page has a text for each code of a refusal.
    bool has_editor = false;    ///< Its page can show and change the programs of the simulation.
    bool runs = false;          ///< Its page would have the simulation run as soon as it is connected to it.
    /// `<width>x<height>` of the pictures that its page shows first; empty: it has not said.
    std::string picture_size;

    bool operator==(StartMessage const&) const = default;
};

/// An object without a known request; silently ignored, as by the Python server.
struct UnknownMessage
{
    bool operator==(UnknownMessage const&) const = default;
};

/// Not a valid message; `reason` is for the browser.
struct MalformedMessage
{
    std::string reason;

    bool operator==(MalformedMessage const&) const = default;
};

/// `{"reset controller":"<controller>/<file>"}`: puts a file of `controllers/` back as it was fetched.
struct ResetControllerMessage
{
    std::string file; ///< Names separated by `/`, two at least, none of which leads out of the folder.

    bool operator==(ResetControllerMessage const&) const = default;
};

/// `{"reconnect":"<token>"}`: a browser that lost its connection returns to its simulation.
struct ReconnectMessage
{
    std::string token;

    bool operator==(ReconnectMessage const&) const = default;
};

/// `{"extend":<seconds>}`: the time limit of the simulation is to be put off.
struct ExtendMessage
{
    Duration by{};

    bool operator==(ExtendMessage const&) const = default;
};

/// `{"read":"<controller>/<file>"}`, or `{"original":...}`: a page shows a program of its simulation.
struct ReadFileMessage
{
    std::string file; ///< As in ResetControllerMessage.
    bool original = false;

    bool operator==(ReadFileMessage const&) const = default;
};

/// `{"write":{"path":"<controller>/<file>","text":"..."}}`: it has changed the program.
struct WriteFileMessage
{
    std::string file; ///< As in ResetControllerMessage.
    std::string text;

    bool operator==(WriteFileMessage const&) const = default;
};

/// `{"compile":"<controller>"}`: a page wants the sources of this folder below `controllers/` compiled.
struct CompileMessage
{
    std::string controller;

    bool operator==(CompileMessage const&) const = default;
};

/// All messages that request a simulation: `start`, or
/// `{"init":["<host>","<project>","<file>.wbt",...]}`, which browsers sent until 2021 and the pages of
/// websites still do.
using SimulationRequest = std::variant<StartMessage, WebsiteProject>;

using ClientMessage =
    std::variant<SimulationRequest, ReconnectMessage, ExtendMessage, ResetControllerMessage, ReadFileMessage,
                 WriteFileMessage, CompileMessage, StageMessage, UnknownMessage, MalformedMessage>;

/// Reads any bytes.
ClientMessage parse_client_message(std::string_view text);

/// Whether the browser has said that it returns after it has lost its connection, or was reloaded.
bool can_return(SimulationRequest const& request);

/// Whether the browser wants to hear from us all the time, to know that it still could.
bool wants_heartbeat(SimulationRequest const& request);

/// Whether the browser has said that it can extend simulations.
bool can_extend(SimulationRequest const& request);

/// Whether it comes from a session server, which is told where another machine may take what is refused.
bool is_relayed(SimulationRequest const& request);

/// Whether it wants the code of a refusal beside the sentence.
bool wants_reasons(SimulationRequest const& request);

/// Whether it can show and change programs.
bool has_editor(SimulationRequest const& request);

/// Whether the project is to be fetched for later starts, and nothing else.
bool is_fetch_only(SimulationRequest const& request);

/// Whether a browser that closes its connection with this code, and can return, has gone for good: not when
/// its page was only left or reloaded.
bool is_final(std::uint16_t close_code) noexcept;

/// The code with which a connection is closed since another one has taken the simulation over.
inline constexpr std::uint16_t taken_over_code = 4001;

/// The requested world, as the browser wrote it.
std::string world_of(SimulationRequest const& request);

/// What begins the message that refuses a start, or ends it.
inline constexpr std::string_view error_prefix = "loading: Error: ";

/// `loading: Error: <text>`
std::string error_message(std::string_view text);

inline constexpr std::string_view reason_prefix = "reason: ";

/// `reason: {"code":"no-world","values":{"file":"a.wbt"}}`: what the error that follows says, for pages in
/// other languages. Empty: the failure has no code.
std::string reason_message(Failure const& failure);

/// The same with a code alone.
std::string reason_message(std::string_view code);

/// `loading: <text>`
std::string loading_message(std::string_view text);

/// For the console of the project's author: this file or folder, a printable path, is left out.
std::string forbidden_file_message(std::string_view path);

/// For the console of the project's author: where the controller of this robot, whose name is
/// percent-encoded, is to connect (`controller_url`).
std::string controller_message(std::string_view robot, std::string_view url);

/// The same where the site takes no controllers for this project.
std::string no_controller_message(std::string_view robot);

/// `shutdownTimeout: <seconds>`
std::string shutdown_timeout_message(std::int64_t seconds);

/// `extendable: <seconds>`: by how much the time limit can still be put off.
std::string extendable_message(std::int64_t seconds);

/// `reset controller: <file>`
std::string reset_controller_message(std::string_view file);

/// The project that was to be fetched for later starts is here.
inline constexpr std::string_view fetched_message = "fetched:";

/// A sign of life, like those that simulators print.
inline constexpr std::string_view heartbeat_message = ".";

/// From now on there is a sign of life at least so often, in seconds.
inline constexpr std::string_view heartbeat_promise = "heartbeat: 1";

/// There is an editor: for containers.
inline constexpr std::string_view editor_message = "ide: enable";

/// `reconnectToken: <token>`
std::string reconnect_token_message(std::string_view token);

/// `said: <message>`: what the simulator has said to the server, for its page.
std::string said_message(std::string_view message);

/// `pictures: <width>x<height>`: the simulator has been asked for them, so they can be fetched.
std::string pictures_message(std::string_view size);

/// `webots:ws(s)://<host><:|/><port>`: a simulator of the server at `address` listens on `port`.
std::string webots_message(PublicAddress const& address, std::uint16_t port);

/// `http(s)://<host><:|/><port>`
std::string public_http_url(PublicAddress const& address);

} // namespace webots_cloud::core
