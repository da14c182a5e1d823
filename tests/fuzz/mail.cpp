// Mails: whatever a notice holds, the headers are ours, each once, and the text is the notice's.
#include "fuzz.hpp"

#include "core/notices/mail_message.hpp"
#include "core/text.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

std::vector<std::string_view> lines_of(std::string_view text)
{
    std::vector<std::string_view> lines;
    for (auto end = text.find("\r\n"); end != std::string_view::npos; end = text.find("\r\n")) {
        lines.push_back(text.substr(0, end));
        text.remove_prefix(end + 2);
    }
    lines.push_back(text);
    return lines;
}

void check_headers(std::string_view head, bool with_id)
{
    std::vector<std::string_view> expected{
        "Date",          "From",         "To",           "Subject",
        "Message-ID",    "MIME-Version", "Content-Type", "Content-Transfer-Encoding",
        "Auto-Submitted"};
    if (!with_id)
        std::erase(expected, "Message-ID");
    auto const lines = lines_of(head);
    fuzz::require(lines.size() == expected.size());
    for (std::size_t i = 0; i < lines.size(); ++i) {
        fuzz::require(lines[i].starts_with(std::string(expected[i]) + ": "));
        for (char const c : lines[i])
            fuzz::require(c >= 0x20 && c < 0x7F);
    }
}

/// Lines end with CRLF, and neither byte stands alone: a mail server must not find an end of its own in it.
void check_text(std::string_view text, std::string_view notice)
{
    std::string expected;
    for (char const c : notice)
        if (c == '\n')
            expected += "\r\n";
        else if (c != '\r')
            expected += c;
    fuzz::require(text == expected);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto rest = fuzz::text_of(data, size);
    Notice notice;
    notice.written = WallTime(std::chrono::seconds(fuzz::take_byte(rest) * 10'000'000LL));
    notice.subject = fuzz::take(rest, fuzz::take_byte(rest));
    notice.id = fuzz::take(rest, fuzz::take_byte(rest) % 64);
    std::string const sender(fuzz::take(rest, fuzz::take_byte(rest) % 64));
    std::string const recipient(fuzz::take(rest, fuzz::take_byte(rest) % 64));
    notice.text = rest;
    for (auto const& address : {sender, recipient})
        if (core::is_mail_address(address))
            fuzz::require(core::is_printable(address) &&
                          address.find_first_of(" <>,;:\"\\") == std::string::npos);
    if (core::is_mail_host(sender))
        fuzz::require(core::is_printable(sender) && sender.find_first_of(" /@?#[]") == std::string::npos);

    auto const message = core::mail_message(notice, sender, recipient);
    auto const end = message.find("\r\n\r\n");
    fuzz::require(end != std::string::npos);
    check_headers(std::string_view(message).substr(0, end), !notice.id.empty());
    check_text(std::string_view(message).substr(end + 4), notice.text);
    return 0;
}
