// A notice as the text of an e-mail (RFC 5322), and which addresses a mail may have.
#pragma once

#include <webots_cloud/notice.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The whole message, lines ending with CRLF: the headers `Date`, `From`, `To`, `Subject`, `Message-ID` and
/// those of MIME, an empty line, and the text. No value can add a header or end the headers.
std::string mail_message(Notice const& notice, std::string_view sender, std::string_view recipient);

/// True for a plain address, `name@host` or a local `name`: printable ASCII without spaces, quotes, brackets
/// and lists.
bool is_mail_address(std::string_view text) noexcept;

/// True for a name or a number of a mail server's host: letters, digits, dots, hyphens, underscores; colons
/// in an IPv6 one.
bool is_mail_host(std::string_view text) noexcept;

} // namespace webots_cloud::core
