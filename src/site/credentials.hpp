// What a site needs before its first start and nobody else has made: a certificate, the teachers' password,
// the operator's token.
#pragma once

#include "settings.hpp"

#include <webots_cloud/error.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::site {

/// For whom a certificate of ours is made: the name in an address such as `localhost:8443`; nothing: it is no
/// name.
std::optional<std::string> certificate_name(std::string_view server);

/// Whether we make this certificate and its key: both are named, in the folder of the site. Those of others,
/// in /etc/letsencrypt, say, are made by others.
bool are_ours(std::filesystem::path const& certificate, std::filesystem::path const& key);

/// Makes certificate and key where that is so and neither is there; says so on standard output.
/// Errors: `start_failed`, `unavailable`, `invalid_argument`.
result<> make_certificate(Settings const& settings);

/// `abcd-efgh-jkmn`, of letters none of which looks like another; nothing: too few of the bytes serve.
std::optional<std::string> password_from(std::string_view random_bytes);

/// Makes the files of the teachers' password and of the operator's token, if they are in `log` and not there
/// or empty. Errors: `unavailable`.
result<> make_teacher_password(Settings const& settings);
result<> make_operator_token(Settings const& settings);

} // namespace webots_cloud::site
