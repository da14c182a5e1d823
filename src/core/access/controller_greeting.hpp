// How Webots' controllers introduce themselves over TCP (protocol section 13.18), as libController does: in
// one message without an end mark, `CTR` and perhaps a name, then nothing before the simulator has answered.
// What an author writes behind the port in WEBOTS_CONTROLLER_URL arrives as that name: first the key of a
// simulation, then the robot's name. Releases differ: up to R2023a it comes as it was written, later ones
// encode it, and send a digest in place of what is longer than `max_encoded_name`.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The length of a key, in letters from `a` to `z`: 94 bits.
inline constexpr std::size_t controller_key_length = 20;

/// Longer first messages are none of libController's.
inline constexpr std::size_t max_controller_greeting = 1024;

/// The longest name, encoded, that libController sends as it is (R2023b and later).
inline constexpr std::size_t max_encoded_name = 70;

struct ControllerGreeting
{
    ControllerGreeting() = default;

    /// The port by which a session server knows the machine; 0: none.
    std::uint16_t machine = 0;
    std::string key;
    /// As Webots compares it: percent-encoded, but for letters, digits and `-._~`. Empty: the only robot that
    /// waits for a controller.
    std::string robot;

    bool operator==(ControllerGreeting const&) const = default;
};

/// What the first bytes of a controller say, as far as they have come. Nothing: more must come. A greeting
/// may go on, since no mark ends it. Errors: `protocol_error`, with a sentence for whoever made the
/// connection.
result<std::optional<ControllerGreeting>> read_controller_greeting(std::string_view bytes);

/// Why a controller that says no more is refused.
Failure unfinished_greeting(std::string_view bytes);

/// The same for a simulator, with a robot's name, or for a simulation server, with a path, or with neither.
std::string greeting_for(std::string_view name);

/// By which controllers name the machine at this address: the port at the end of `host:2000` or `host/2000`;
/// 0: there is none.
std::uint16_t port_of_machine(std::string_view address) noexcept;

/// `<key>/<robot>`, or `<key>`.
std::string controller_path(std::string_view key, std::string_view robot);

/// What a simulator answers.
enum class ControllerAnswer : std::uint8_t
{
    incomplete,
    connected, ///< From here on both sides talk.
    refused    ///< The connection is of no use any more.
};

ControllerAnswer read_controller_answer(std::string_view bytes) noexcept;

/// The answers on which libController gives up and on which it tries again for 50 s. Of the sentence it reads
/// nothing; it is for those who look at what was sent.
std::string controller_forbidden(std::string_view sentence);
std::string controller_failed(std::string_view sentence);

/// As Webots encodes the names of robots. What is encoded already stays: `my%20robot` is `my robot`.
std::string encoded_robot_name(std::string_view name);

} // namespace webots_cloud::core
