// Heads of HTTP requests: the same are accepted in one piece as byte by byte, nothing that could split an
// answer, and no client names another client, or where we are.
#include "fuzz.hpp"

#include "adapters/messages/http_request_reader.hpp"
#include "adapters/messages/websocket_handshake.hpp"
#include "core/access/asked_name.hpp"
#include "core/access/client_address.hpp"
#include "core/pages/page_language.hpp"
#include "core/public_place.hpp"

#include <algorithm>
#include <string>
#include <vector>

using namespace webots_cloud;
using adapters::HttpRequestReader;
using Progress = HttpRequestReader::Progress;

namespace {

void check_client(HttpRequestReader const& reader)
{
    static core::IpNetworks const proxies({"127.0.0.0/8", "::1", "10.0.0.0/8"});
    auto fields = std::vector(reader.request().headers.begin(), reader.request().headers.end());
    auto const asked = core::asked_address(fields, true);
    fuzz::require(asked.path.empty() || core::is_site_path(asked.path));
    auto const direct = core::asked_address(fields, false);
    fuzz::require(direct.path.empty() && !direct.tls && direct.host == asked.host);
    auto const client = core::forwarded_client(fields, proxies);
    fuzz::require(!client || (reader.is_forwarded() && core::IpAddress::parse(client->text()) == client));
    fields.emplace_back("X-Forwarded-For", "203.0.113.7, 10.0.0.1"); // as a proxy appends it
    fuzz::require(core::forwarded_client(fields, proxies)->text() == "203.0.113.7");
}

void check(HttpRequestReader const& reader)
{
    auto const& request = reader.request();
    fuzz::require(!request.method.empty() && request.path.starts_with('/'));
    auto const splits = [](std::string_view text) {
        return text.find_first_of(std::string_view("\r\n\0", 3)) != std::string_view::npos;
    };
    fuzz::require(!splits(request.path) && !splits(request.query));
    for (auto const& [name, value] : request.headers)
        fuzz::require(!name.empty() && !splits(name) && !splits(value));
    check_client(reader);
    auto const language = core::preferred_language(request.header("Accept-Language"), {"en", "de"});
    fuzz::require(language == "en" || language == "de");
    if (adapters::wants_websocket(reader))
        (void)adapters::refuse_handshake(reader);
}

/// The requests that are accepted, when the text comes in pieces. What is wrong may be seen earlier in small
/// pieces.
std::vector<std::string> read(std::string_view text, std::size_t piece)
{
    std::vector<std::string> found;
    HttpRequestReader reader;
    while (!text.empty()) {
        auto const space = reader.prepare();
        fuzz::require(!space.empty());
        auto const bytes = fuzz::take(text, std::min(space.size(), piece));
        std::copy(bytes.begin(), bytes.end(), space.begin());
        reader.commit(bytes.size());
        for (;;) {
            auto const progress = reader.parse();
            if (progress == Progress::need_more)
                break;
            if (progress == Progress::refused) {
                fuzz::require(reader.refusal() >= 400);
                return found;
            }
            check(reader);
            if (progress == Progress::with_body) { // which may look like requests, and is none
                fuzz::require(reader.body_length() > 0);
                auto const begun = std::min<std::uint64_t>(reader.body_length(), reader.rest().size());
                reader.skip(static_cast<std::size_t>(begun));
                text.remove_prefix(static_cast<std::size_t>(
                    std::min<std::uint64_t>(reader.body_length() - begun, text.size())));
            }
            found.emplace_back(reader.request().method).append(" ").append(reader.request().path);
            reader.next();
        }
    }
    return found;
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    fuzz::require(read(text, size + 1) == read(text, 1));
    return 0;
}
