// How often somebody may be wrong about the passwords and tokens of a server.
#pragma once

#include <webots_cloud/guess_limit.hpp>

namespace webots_cloud::core {

/// Of a password or token that few people have, of one client and of all together.
inline constexpr Guesses passwords_of_client{10, 0.1};
inline constexpr Guesses passwords_of_all{50, 0.5};

} // namespace webots_cloud::core
