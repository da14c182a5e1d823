#include "mail_message.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view letters_and_digits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";

bool is_ascii(std::string_view text) noexcept
{
    return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

/// One header line. Whatever is no printable ASCII becomes a space: it could end the line.
std::string header(std::string_view name, std::string_view value)
{
    auto line = concat(name, ": ", value);
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c < 0x20 || c == 0x7F; }, ' ');
    return line += "\r\n";
}

std::string with_crlf(std::string_view text)
{
    std::string lines;
    lines.reserve(text.size() + 32);
    for (char const c : text) {
        if (c == '\n')
            lines += "\r\n";
        else if (c != '\r')
            lines += c;
    }
    return lines;
}

/// What stands behind the `@` of a message's id: the sender's own, since nobody else may make ids there.
std::string_view domain_of(std::string_view sender)
{
    auto const at = sender.rfind('@');
    auto const domain = at == std::string_view::npos ? std::string_view() : sender.substr(at + 1);
    return domain.empty() ? std::string_view("localhost") : domain;
}

} // namespace

std::string mail_message(Notice const& notice, std::string_view sender, std::string_view recipient)
{
    auto message = header("Date", mail_date(notice.written));
    message += header("From", concat("Simulation Server <", sender, ">"));
    message += header("To", concat("Administrator <", recipient, ">"));
    message += header("Subject", notice.subject);
    if (!notice.id.empty())
        message += header("Message-ID", concat("<", notice.id, "@", domain_of(sender), ">"));
    message += header("MIME-Version", "1.0");
    message += header("Content-Type", "text/plain; charset=utf-8");
    message += header("Content-Transfer-Encoding", is_ascii(notice.text) ? "7bit" : "8bit");
    message += header("Auto-Submitted", "auto-generated"); // RFC 3834: no automatic replies
    return message += concat("\r\n", with_crlf(notice.text));
}

bool is_mail_address(std::string_view text) noexcept
{
    return !text.empty() && text.size() <= 254 && text.front() != '@' && text.back() != '@' &&
           std::all_of(text.begin(), text.end(), [](char c) {
               return c > 0x20 && c < 0x7F &&
                      std::string_view("<>()[]\\,;:\"").find(c) == std::string_view::npos;
           });
}

bool is_mail_host(std::string_view text) noexcept
{
    return !text.empty() && text.size() <= 253 && text.front() != '-' &&
           (text.find_first_not_of(concat(letters_and_digits, "._-")) == std::string_view::npos ||
            text.find_first_not_of("0123456789ABCDEFabcdef.:") == std::string_view::npos);
}

} // namespace webots_cloud::core
