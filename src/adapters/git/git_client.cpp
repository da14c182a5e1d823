// Asks a server of git's version 2 for refs and packs. Answers are decoded while they arrive
// (core::PktLineDecoder) and are not believed: git_pack_reader.cpp checks what is in them, git_fetch.cpp
// decides what to ask for.
#include "git_client.hpp"

#include "core/git/git_pkt_line.hpp"
#include "core/git/git_problem.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <optional>

namespace webots_cloud::adapters {
namespace {

using core::concat;
using core::GitCapabilities;
using core::GitProblem;
using core::pkt_line;
using core::PktLine;
using LineKind = core::PktLine::Kind;

constexpr std::size_t max_refs = 20'000; // that begin alike

Failure malformed(std::string_view what)
{
    return {GitProblem::malformed, concat("the git server does not answer as one: ", what)};
}

/// What `CurlHttp` says of the way to the server.
Failure about_transport(Failure const& failure)
{
    auto const problem = [&]() -> std::optional<GitProblem> {
        if (failure == errc::unreachable)
            return GitProblem::unreachable;
        if (failure == errc::timed_out)
            return GitProblem::timed_out;
        if (failure == errc::too_large)
            return GitProblem::answer_too_large;
        if (failure == errc::protocol_error)
            return GitProblem::malformed;
        return std::nullopt; // aborted
    }();
    return problem ? Failure(*problem, failure.message()) : failure;
}

std::string request(std::string_view command)
{
    return concat(pkt_line(concat("command=", command, "\n")), pkt_line("agent=webots_cloud\n"),
                  core::pkt_delimiter);
}

/// An answer of frames, given to `handle` one by one.
template<class Handle>
std::function<result<>(std::string_view)> framed(core::PktLineDecoder& decoder, Handle& handle)
{
    return [&decoder, &handle](std::string_view bytes) -> result<> {
        decoder.push(bytes);
        for (;;) {
            auto const line = decoder.next();
            if (!line)
                return line.error();
            if (!*line)
                return {};
            if (auto const handled = handle(**line); !handled)
                return handled.error();
        }
    };
}

/// The answer to `fetch`: sections of lines, the last of which is the pack, multiplexed with the server's
/// words.
class FetchAnswer
{
public:
    explicit FetchAnswer(GitPackReader& pack) : pack_(pack) {}

    result<> operator()(PktLine const& line)
    {
        if (line.kind == LineKind::flush || line.kind == LineKind::response_end) {
            ended_ = in_pack_;
            return {};
        }
        if (line.kind == LineKind::delimiter)
            return {};
        if (in_pack_)
            return demultiplex(line.payload);
        if (line.text() == "packfile")
            in_pack_ = true;
        return check_for_git_error(line.text());
    }

    bool complete() const noexcept { return ended_; }

private:
    result<> demultiplex(std::string_view payload)
    {
        if (payload.empty())
            return malformed("a frame of no band");
        auto const bytes = payload.substr(1);
        switch (payload.front()) {
        case 1:
            return pack_.push(bytes);
        case 2:
            return {}; // what the server tells a person at a terminal
        case 3:
            return core::git_server_error(bytes);
        default:
            return malformed("a frame of an unknown band");
        }
    }

    GitPackReader& pack_;
    bool in_pack_ = false;
    bool ended_ = false;
};

/// What a server says of itself. Before version 2 that is a list of its refs; what it can do hides behind the
/// name of the first one, after a zero byte.
struct Offer
{
    Offer() { capabilities.version_2 = capabilities.shallow = capabilities.filter = false; }

    result<> operator()(PktLine const& line)
    {
        auto const text = line.text();
        if (text == "version 2")
            is_smart = capabilities.version_2 = true;
        else if (text == "# service=git-upload-pack")
            is_smart = true;
        else if (text == "object-format=sha256")
            return Failure(GitProblem::unknown_format);
        constexpr std::string_view fetch = "fetch=";
        if (text.starts_with(fetch))
            note(text.substr(fetch.size()));
        else if (auto const zero = text.find('\0'); zero != std::string_view::npos && !capabilities.version_2)
            note(text.substr(zero + 1));
        return check_for_git_error(text);
    }

    void note(std::string_view words)
    {
        for (auto const word : core::split(words, ' ')) {
            capabilities.shallow = capabilities.shallow || word == "shallow";
            capabilities.filter = capabilities.filter || word == "filter";
        }
    }

    bool is_smart = false;
    GitCapabilities capabilities;
};

} // namespace

result<> check_for_git_error(std::string_view line)
{
    constexpr std::string_view mark = "ERR ";
    if (line.starts_with(mark))
        return core::git_server_error(line.substr(mark.size()));
    return {};
}

result<> GitClient::ask(std::string url, std::string body, Sink sink)
{
    CurlRequest request;
    request.peer = "the git server";
    request.base = remote_.base;
    request.url = std::move(url);
    request.agent = "git/webots_cloud";
    if (remote_.version_2)
        request.headers.emplace_back("Git-Protocol: version=2");
    if (!body.empty()) {
        request.headers.emplace_back("Content-Type: application/x-git-upload-pack-request");
        request.headers.emplace_back("Accept: application/x-git-upload-pack-result");
    }
    request.body = std::move(body);
    request.sink = std::move(sink);
    request.explain = about_transport;
    auto const status = http_.send(request, limits_);
    if (!status)
        return status.error();
    if (*status == 200)
        return {};
    // Forges answer 401 for what does not exist, so as not to tell what is private.
    if (*status == 404 || *status == 401 || *status == 403 || *status == 410)
        return Failure(GitProblem::no_such_repository);
    if (*status == 429 || *status >= 500)
        return Failure(GitProblem::unreachable,
                       concat("the git server answers with status ", std::to_string(*status)));
    return malformed(concat("status ", std::to_string(*status)));
}

result<> GitClient::post(std::string body, Sink sink)
{
    return ask(concat(remote_.url, "/git-upload-pack"), std::move(body), std::move(sink));
}

result<std::vector<core::GitRef>> GitClient::ls_refs(std::vector<std::string> const& prefixes)
{
    auto body = concat(request("ls-refs"), pkt_line("peel\n"));
    if (std::ranges::find(prefixes, "HEAD") != prefixes.end())
        body += pkt_line("symrefs\n"); // which branch it is
    for (auto const& prefix : prefixes)
        body += pkt_line(concat("ref-prefix ", prefix, "\n"));
    body += core::pkt_flush;

    std::vector<core::GitRef> refs;
    bool ended = false;
    auto handle = [&](PktLine const& line) -> result<> {
        if (line.kind != LineKind::data) {
            ended = line.kind == LineKind::flush;
            return {};
        }
        if (auto const fine = check_for_git_error(line.text()); !fine)
            return fine.error();
        auto ref = core::parse_ref_line(line.text());
        if (!ref)
            return ref.error();
        if (refs.size() >= max_refs)
            return Failure(GitProblem::too_many_refs);
        refs.push_back(std::move(*ref));
        return {};
    };
    core::PktLineDecoder decoder;
    if (auto const posted = post(std::move(body), framed(decoder, handle)); !posted)
        return posted.error();
    if (!ended)
        return malformed("no end of the refs");
    return refs;
}

result<> GitClient::advertise(Sink sink)
{
    return ask(concat(remote_.url, "/info/refs?service=git-upload-pack"), {}, std::move(sink));
}

result<GitCapabilities> GitClient::capabilities()
{
    Offer offer;
    core::PktLineDecoder decoder;
    // An answer that does not consist of git's frames, a web page say, comes to the same as one without git's
    // first line.
    auto const asked = advertise(framed(decoder, offer));
    if (!asked && !core::fails_as(asked.error(), errc::protocol_error))
        return asked.error();
    if (!asked || !offer.is_smart)
        return malformed("it does not speak git's smart protocol");
    return offer.capabilities;
}

result<> GitClient::fetch(GitWants const& wants, GitPackReader& pack, Progress const& progress)
{
    auto body = concat(request("fetch"), pkt_line("ofs-delta\n"), pkt_line("no-progress\n"));
    if (wants.shallow)
        body += pkt_line("deepen 1\n");
    if (!wants.filter.empty())
        body += pkt_line(concat("filter ", wants.filter, "\n"));
    for (auto const& id : wants.ids)
        body += pkt_line(concat("want ", to_hex(id), "\n"));
    // `done`: there is nothing to negotiate, as we name nothing that we have.
    body += concat(pkt_line("done\n"), core::pkt_flush);

    FetchAnswer answer(pack);
    core::PktLineDecoder decoder;
    auto const frames = framed(decoder, answer);
    std::uint64_t received = 0;
    auto sink = [&](std::string_view bytes) -> result<> {
        received += bytes.size();
        auto const handled = frames(bytes);
        progress(pack, received);
        return handled;
    };
    if (auto const posted = post(std::move(body), sink); !posted)
        return posted.error();
    if (!answer.complete())
        return malformed("no end of the pack");
    return pack.finish();
}

} // namespace webots_cloud::adapters
