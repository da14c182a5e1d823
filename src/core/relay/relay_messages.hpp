// What a session server that relays reads and changes in the messages of WebSocket /client (protocol section
// 13.16).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Members of a start that are for the session server, not for the machine.
struct RelayOptions
{
    RelayOptions() = default;

    bool shows_waiting = false; ///< The page shows place and estimate itself, and keeps a ticket.
    std::string waiting_ticket; ///< Of its place in the line; empty: it has none.
    std::string student;        ///< The token of a student's, whose class may hold a seat; empty: of none.
    bool wants_heartbeat = false;
    bool can_return = false;
    bool wants_reasons = false;
};

/// Of a message that `parse_client_message` takes for a request for a simulation.
RelayOptions relay_options(std::string_view request);

/// The same request as a machine is to get it: without what is for the session server, and with what makes
/// the machine say why it refuses, and that it is alive.
std::string request_for_machine(std::string_view request);

/// `{"reconnect":"<token>"}`
std::string reconnect_message(std::string_view token);

/// A machine's token, and the entry of "simulationServers" of that machine. For browsers they are one text.
struct RelayedToken
{
    std::string_view token;
    std::string_view entry;
};

std::string relayed_token(std::string_view token, std::string_view entry);

/// Empty: it is none of ours. Whether there is such an entry is not known here.
std::optional<RelayedToken> parse_relayed_token(std::string_view text) noexcept;

} // namespace webots_cloud::core
