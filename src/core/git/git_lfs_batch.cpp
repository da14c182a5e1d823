// The LFS server's answer names addresses and headers for our next requests, so it is the answer of somebody
// who would like us to ask elsewhere. Only what storage needs passes; git_lfs.cpp does the requests.
#include "git_lfs_batch.hpp"

#include "core/text.hpp"

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value.hpp>

#include <algorithm>
#include <array>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;
using Downloads = std::vector<LfsDownload>;

constexpr std::size_t max_address_length = 8192;
constexpr std::size_t max_headers = 32;
constexpr std::size_t max_header_bytes = 16 * 1024;
constexpr std::size_t max_words_length = 160; // of what a server says of an error

Failure malformed(std::string_view what)
{
    return {errc::protocol_error, std::string(what)};
}

std::string_view text_of(json::object const& object, std::string_view key)
{
    auto const* const value = object.if_contains(key);
    auto const* const text = value ? value->if_string() : nullptr;
    return text ? std::string_view(*text) : std::string_view();
}

json::object const* object_of(json::object const& object, std::string_view key)
{
    auto const* const value = object.if_contains(key);
    return value ? value->if_object() : nullptr;
}

bool is_token(std::string_view name)
{
    constexpr std::string_view others = "!#$%&'*+-.^_`|~";
    return !name.empty() && std::all_of(name.begin(), name.end(), [&](char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
               others.find(c) != std::string_view::npos;
    });
}

/// What storage asks for: credentials, and what the large providers of storage sign. Nothing else is sent,
/// since other headers open services that trust who can reach them (`Metadata-Flavor`, `X-Forwarded-For`).
bool is_for_storage(std::string_view name)
{
    auto const lower = lower_case(name);
    constexpr std::array<std::string_view, 3> names{"accept", "authorization", "content-type"};
    constexpr std::array<std::string_view, 3> prefixes{"x-amz-", "x-goog-", "x-ms-"};
    return std::find(names.begin(), names.end(), lower) != names.end() ||
           std::any_of(prefixes.begin(), prefixes.end(),
                       [&lower](std::string_view prefix) { return lower.starts_with(prefix); });
}

result<std::vector<std::string>> read_headers(json::object const& headers)
{
    std::vector<std::string> lines;
    std::size_t bytes = 0;
    for (auto const& [name, value] : headers) {
        std::string_view const key = name;
        auto const* const text = value.if_string();
        if (!text || !is_token(key) || !is_printable(*text))
            return malformed("sends a header that is none");
        if (!is_for_storage(key) || text->empty())
            continue;
        lines.push_back(concat(key, ": ", std::string_view(*text)));
        bytes += lines.back().size();
        if (lines.size() > max_headers || bytes > max_header_bytes)
            return malformed("asks for too many headers");
    }
    return lines;
}

void read_error(json::object const& error, LfsDownload& download)
{
    constexpr int max_status_length = 999;
    auto const* const code = error.if_contains("code");
    auto const* const number = code ? code->if_int64() : nullptr;
    if (number && *number > 0 && *number <= max_status_length)
        download.error = static_cast<int>(*number);
    download.words = printable(trim(text_of(error, "message")), max_words_length);
}

result<LfsDownload> read_object(json::object const& object)
{
    LfsDownload download;
    if (auto const* const error = object_of(object, "error")) {
        read_error(*error, download);
        return download;
    }
    auto const* const actions = object_of(object, "actions");
    auto const* const action = actions ? object_of(*actions, "download") : nullptr;
    if (!action)
        return download;
    auto const address = text_of(*action, "href");
    if (address.empty() || address.size() > max_address_length || !is_printable(address))
        return malformed("sends an address that is none");
    if (auto const* const headers = object_of(*action, "header")) {
        auto lines = read_headers(*headers);
        if (!lines)
            return lines.error();
        download.headers = std::move(*lines);
    }
    download.address = address;
    return download;
}

/// Whether it is about the object that was asked for, and not about one of another size.
bool agrees(json::object const& object, LfsPointer const& pointer)
{
    auto const* const size = object.if_contains("size");
    auto const* const number = size ? size->if_int64() : nullptr;
    return number && *number >= 0 && static_cast<std::uint64_t>(*number) == pointer.size;
}

} // namespace

std::string lfs_batch_request(std::vector<LfsPointer> const& objects)
{
    json::array wanted;
    wanted.reserve(objects.size());
    for (auto const& pointer : objects)
        wanted.push_back(json::object{{"oid", pointer.object}, {"size", pointer.size}});
    return json::serialize(json::object{{"operation", "download"},
                                        {"transfers", json::array{"basic"}},
                                        {"objects", std::move(wanted)},
                                        {"hash_algo", "sha256"}});
}

result<Downloads> parse_lfs_batch(std::string_view answer, std::vector<LfsPointer> const& objects)
{
    boost::system::error_code failed;
    auto const value = json::parse(answer, failed); // at most 32 levels deep
    if (failed || !value.is_object())
        return malformed("sends no JSON");
    auto const& message = value.get_object();
    auto const transfer = text_of(message, "transfer");
    if (!transfer.empty() && transfer != "basic")
        return malformed("wants a transfer that was not asked for");
    auto const* const list = message.if_contains("objects");
    auto const* const answers = list ? list->if_array() : nullptr;
    if (!answers)
        return malformed("sends no objects");
    if (answers->size() > objects.size())
        return malformed("sends more objects than it was asked for");
    // The answer may have another order, and lack some: what it has must have been asked for, and comes once.
    std::unordered_map<std::string_view, std::size_t> wanted;
    for (std::size_t i = 0; i < objects.size(); ++i)
        wanted.emplace(objects[i].object, i);
    Downloads downloads(objects.size());
    for (auto const& each : *answers) {
        auto const* const object = each.if_object();
        auto const found = object ? wanted.find(text_of(*object, "oid")) : wanted.end();
        if (found == wanted.end())
            return malformed("sends an object that it was not asked for");
        auto const index = found->second;
        wanted.erase(found); // each once
        auto download = read_object(*object);
        if (!download)
            return download.error();
        if (!download->address.empty() && !agrees(*object, objects[index]))
            return malformed("has another size for an object");
        downloads[index] = std::move(*download);
    }
    return downloads;
}

} // namespace webots_cloud::core
