#include "websocket_handshake.hpp"

#include "core/pages/http_pages.hpp"
#include "core/text.hpp"

#include <openssl/evp.h>

#include <algorithm>

namespace webots_cloud::adapters {
namespace {

constexpr int digest_length = 20;                                               // of SHA-1
constexpr std::size_t key_length = 24;                                          // 16 bytes in base64
constexpr std::string_view key_suffix = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"; // RFC 6455, 1.3

bool is_key(std::string_view key) noexcept
{
    auto const is_base64 = [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' ||
               c == '/';
    };
    return key.size() == key_length && key.ends_with("==") &&
           std::all_of(key.begin(), key.end() - 2, is_base64);
}

HttpResponse bad_request(std::string_view sentence)
{
    return {400, std::string(core::html_type), std::string(sentence)};
}

} // namespace

bool wants_websocket(HttpRequestReader const& reader) noexcept
{
    if (!reader.wants_upgrade() || reader.request().method != "GET")
        return false;
    auto protocols = reader.request().header("Upgrade");
    while (!protocols.empty()) { // a list, of which proxies make use
        auto const comma = std::min(protocols.size(), protocols.find(','));
        if (equal_ignoring_case(core::trim(protocols.substr(0, comma)), "websocket"))
            return true;
        protocols.remove_prefix(std::min(protocols.size(), comma + 1));
    }
    return false;
}

std::optional<HttpResponse> refuse_handshake(HttpRequestReader const& reader)
{
    auto const& request = reader.request();
    if (!reader.connection_upgrades())
        return bad_request("\"Connection\" must be \"Upgrade\".");
    if (request.header("Sec-WebSocket-Version") != "13") {
        HttpResponse response(426, std::string(core::html_type), "\"Sec-WebSocket-Version\" must be 13.");
        response.headers.emplace_back("Sec-WebSocket-Version", "13");
        response.headers.emplace_back("Upgrade", "websocket");
        return response;
    }
    if (!is_key(request.header("Sec-WebSocket-Key")))
        return bad_request("\"Sec-WebSocket-Key\" must be 16 bytes in base64.");
    return std::nullopt;
}

void append_handshake_answer(std::string& out, std::string_view key)
{
    std::string text(key);
    text += key_suffix;
    unsigned char digest[digest_length];
    unsigned char accept[2 * digest_length];
    EVP_Q_digest(nullptr, "SHA1", nullptr, text.data(), text.size(), digest, nullptr);
    auto const length = EVP_EncodeBlock(accept, digest, digest_length);
    out.append("HTTP/1.1 101 Switching Protocols\r\nServer: webots_cloud\r\nUpgrade: websocket\r\n"
               "Connection: Upgrade\r\nSec-WebSocket-Accept: ");
    out.append(accept, accept + length).append("\r\n\r\n");
}

} // namespace webots_cloud::adapters
