// Random tokens, and message authentication codes.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// 32 hexadecimal digits from the random numbers of the operating system: nobody guesses them.
std::string make_token();

/// Bytes from the random numbers of the operating system.
std::string random_bytes(std::size_t size);

/// As `make_token`, but 28 lower-case letters: for addresses of simulations, which may have no other digits
/// than those of ports.
std::string make_address_token();

/// The code that authenticates tickets: HMAC-SHA256, 32 bytes, with the word in `file` as the secret.
///
/// Errors: `invalid_config`, as `make_operator_token_check`.
result<std::function<std::string(std::string_view message)>>
make_ticket_mac(std::filesystem::path const& file);

/// The same with a secret that nobody else has to know: a random word in `file`, which is made where there is
/// none. `log` is told where it can't be kept: then another one is made at the next start.
std::function<std::string(std::string_view message)> make_own_mac(std::filesystem::path const& file,
                                                                  Logger const& log);

} // namespace webots_cloud
