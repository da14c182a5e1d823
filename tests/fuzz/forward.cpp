// What is passed on between browsers and other servers: both sides are written one head that nobody can read
// as two, and that means what the other side has meant.
#include "fuzz.hpp"

#include "adapters/messages/forward_text.hpp"
#include "adapters/messages/websocket_handshake.hpp"

#include <algorithm>
#include <string>

using namespace webots_cloud;
using adapters::ForwardedResponse;
using adapters::HttpRequestReader;

namespace {

constexpr unsigned is_request = 1;
constexpr unsigned is_head = 2;
constexpr unsigned is_upgrade = 4;

HttpRequestReader::Progress read(HttpRequestReader& reader, std::string_view text)
{
    while (!text.empty()) {
        auto const space = reader.prepare();
        auto const bytes = fuzz::take(text, space.size());
        std::copy(bytes.begin(), bytes.end(), space.begin());
        reader.commit(bytes.size());
    }
    return reader.parse();
}

void check_forwarded(HttpRequestReader const& reader, IncomingRequest const& request, bool keep_alive)
{
    Forward forward;
    forward.kind = UpstreamKind::machine;
    forward.target = "/there";
    forward.headers.emplace_back("Host", "there");
    auto const sent = adapters::forwarded_request(reader, request, forward, keep_alive);
    HttpRequestReader other;
    if (read(other, sent) != HttpRequestReader::Progress::complete) {
        fuzz::require(other.refusal() == 431); // it has become a little longer
        return;
    }
    fuzz::require(other.rest().empty());
    fuzz::require(other.request().method == request.method && other.request().path == "/there");
    fuzz::require(adapters::wants_websocket(other) == request.upgrade);
    fuzz::require(request.upgrade || other.keep_alive() == keep_alive);
    std::size_t chains = 0;
    for (auto const& [name, value] : other.request().headers) {
        fuzz::require(!equal_ignoring_case(name, "Transfer-Encoding"));
        if (!equal_ignoring_case(name, "X-Forwarded-For"))
            continue;
        ++chains;
        fuzz::require(value.ends_with("203.0.113.7"));
    }
    fuzz::require(chains == 1);
}

void check_request(std::string_view text)
{
    HttpRequestReader reader;
    if (read(reader, text) != HttpRequestReader::Progress::complete)
        return;
    auto request = reader.request();
    request.peer = request.client = "203.0.113.7";
    request.upgrade = adapters::wants_websocket(reader) && !adapters::refuse_handshake(reader);
    check_forwarded(reader, request, false);
    check_forwarded(reader, request, true);
}

/// Whether the answer was understood, when it comes in pieces.
bool read(ForwardedResponse& response, std::string_view text, std::size_t piece)
{
    for (std::size_t size = 0; size < text.size();) {
        size = std::min(text.size(), size + piece);
        auto const progress = response.parse(text.substr(0, size));
        if (progress != ForwardedResponse::Progress::need_more)
            return progress == ForwardedResponse::Progress::complete;
    }
    return false;
}

void check_answer(std::string_view text, bool head, bool upgrade)
{
    ForwardedResponse whole(UpstreamKind::trusted_monitor, head, upgrade);
    ForwardedResponse pieces(UpstreamKind::trusted_monitor, head, upgrade);
    bool const is_understood = read(whole, text, text.size());
    fuzz::require(read(pieces, text, 7) == is_understood);
    if (!is_understood)
        return;
    fuzz::require(pieces.head_size() == whole.head_size());
    bool const lasts =
        whole.body() != ForwardedResponse::Body::none && whole.body() != ForwardedResponse::Body::counted;
    std::string sent;
    whole.append_head(sent, !lasts);
    ForwardedResponse again(UpstreamKind::trusted_monitor, head, upgrade);
    fuzz::require(again.parse(sent) == ForwardedResponse::Progress::complete);
    fuzz::require(again.head_size() == sent.size() && again.status() == whole.status());
    fuzz::require(again.body() == whole.body() && again.length() == whole.length());
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto text = fuzz::text_of(data, size);
    auto const kind = fuzz::take_byte(text);
    if ((kind & is_request) != 0)
        check_request(text);
    else
        check_answer(text, (kind & is_head) != 0, (kind & is_upgrade) != 0);
    return 0;
}
