// The small parsers of git's protocol: frames, refs, folders, commits and deltas; and what is changed between
// libgit2 and a server.
#include "fuzz.hpp"

#include "adapters/git/git2_transport.hpp"
#include "core/git/git_delta.hpp"
#include "core/git/git_pkt_line.hpp"
#include "core/git/git_refs.hpp"
#include "core/git/git_tree.hpp"

#include <optional>
#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

struct Frames
{
    std::vector<std::string> payloads;
    bool failed = false;
    bool at_boundary = false;
};

Frames decode(std::string_view text, std::size_t piece)
{
    Frames frames;
    core::PktLineDecoder decoder;
    while (!text.empty() && !frames.failed) {
        decoder.push(fuzz::take(text, piece));
        for (;;) {
            auto const line = decoder.next();
            frames.failed = !line;
            if (!line || !*line)
                break;
            frames.payloads.emplace_back((*line)->payload);
        }
    }
    frames.at_boundary = decoder.at_boundary();
    return frames;
}

void read_refs(std::vector<std::string> const& lines, std::string_view wanted)
{
    std::vector<core::GitRef> refs;
    for (auto const& line : lines)
        if (auto ref = core::parse_ref_line(line))
            refs.push_back(std::move(*ref));
    (void)core::ref_prefixes(wanted);
    auto const target = core::resolve_ref(wanted, refs);
    if (target)
        fuzz::require(wanted.ends_with(target->folder));
}

void read_delta(std::string_view text)
{
    auto const size = core::delta_result_size(text);
    if (!size || *size > 1 << 20) // readers have refused larger ones by their budget
        return;
    auto const made = core::apply_delta("0123456789", text);
    if (made)
        fuzz::require(made->size() == *size);
}

void make_shallow(std::string_view request)
{
    constexpr std::string_view addition = "000ddeepen 1\n";
    auto made = adapters::make_shallow(request);
    if (!made)
        return;
    auto const at = made->find(addition);
    fuzz::require(at != std::string::npos);
    fuzz::require(made->size() == request.size() + addition.size());
}

/// What passes of an answer in pieces; nothing when it is refused.
std::optional<std::string> passed(std::string_view answer, std::size_t piece)
{
    adapters::GitAnswerStart start;
    std::string all;
    while (!answer.empty()) {
        auto const more = start.push(fuzz::take(answer, piece));
        if (!more)
            return std::nullopt;
        all += *more;
    }
    return all;
}

void pass_answer(std::string_view answer)
{
    auto const whole = passed(answer, answer.size() + 1);
    fuzz::require(whole == passed(answer, 1) && whole == passed(answer, 3));
    if (whole)
        fuzz::require(answer.ends_with(*whole));
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    auto const whole = decode(text, text.size() + 1);
    auto const pieces = decode(text, 1);
    fuzz::require(whole.payloads == pieces.payloads && whole.failed == pieces.failed);
    fuzz::require(whole.failed || whole.at_boundary == pieces.at_boundary);
    read_refs(whole.payloads, text.substr(text.size() / 2));
    (void)core::parse_git_tree(text);
    (void)core::tree_of_commit(text);
    (void)core::parents_of_commit(text);
    read_delta(text);
    make_shallow(text);
    pass_answer(text);
    return 0;
}
