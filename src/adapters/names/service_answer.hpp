// The records SRV of a name server's answer.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/name_answer.hpp>

#include <span>
#include <string>

namespace webots_cloud::adapters {

/// The services that an answer for `name` lists (RFC 1035, RFC 2782).
///
/// By the parser of the C library: that of c-ares 1.18 leaves the TTL out.
/// Errors: `protocol_error`.
result<NameAnswer> services_of(std::string const& name, std::span<unsigned char const> answer);

} // namespace webots_cloud::adapters
