#include "shared_page.hpp"

#include "core/text.hpp"

#include <charconv>
#include <cstdint>
#include <cstring>

namespace webots_cloud::core {
namespace {

/// FNV-1a of words of eight bytes, as pages of thousands of machines have megabytes: a tag only has to differ
/// when the text does; nobody gains by forging a collision.
std::uint64_t digest(std::string_view text) noexcept
{
    std::uint64_t value = 0xcbf29ce484222325U;
    auto const mix = [&value](std::uint64_t word) {
        value = (value ^ word) * 0x100000001b3U;
        value ^= value >> 32U; // products carry upwards alone
    };
    std::uint64_t word = 0;
    for (; text.size() >= sizeof word; text.remove_prefix(sizeof word)) {
        std::memcpy(&word, text.data(), sizeof word);
        mix(word);
    }
    for (char const byte : text)
        mix(static_cast<unsigned char>(byte));
    return value;
}

/// Weak, because the compressed body has the same.
std::string tag_of(std::string_view text)
{
    char digits[16];
    auto const end = std::to_chars(digits, digits + sizeof digits, digest(text), 16).ptr;
    return concat("W/\"", std::string_view(digits, static_cast<std::size_t>(end - digits)), "\"");
}

/// Whether a client that sends this If-None-Match has what `tag` names.
bool is_listed(std::string_view if_none_match, std::string_view tag)
{
    for (auto const part : split(if_none_match, ','))
        if (auto const one = trim(part); one == tag || one == "*" || one == tag.substr(2))
            return true;
    return false;
}

} // namespace

void SharedPage::set(std::string text, std::string gzip)
{
    if (body_ && body_->text == text)
        return;
    tag_ = tag_of(text);
    auto const body = std::make_shared<SharedBody>(std::move(text));
    body->gzip = std::move(gzip);
    body_ = body;
}

HttpResponse SharedPage::answer(std::string_view content_type, std::string_view if_none_match,
                                Kept kept) const
{
    HttpResponse response;
    if (is_listed(if_none_match, tag_)) {
        response.status = 304;
    } else {
        response.content_type = content_type;
        response.shared = body_;
    }
    response.headers.emplace_back("ETag", tag_);
    response.headers.emplace_back(
        "Cache-Control", kept == Kept::for_ever ? "public, max-age=31536000, immutable" : "no-cache");
    response.headers.emplace_back("Vary", "Accept-Encoding");
    return response;
}

} // namespace webots_cloud::core
