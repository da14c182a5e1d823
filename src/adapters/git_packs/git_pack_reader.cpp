// A state machine over bytes as they arrive: header, entries, trailer. Each step checks a size and pays for
// it before it allocates. Deltas have to wait for what they are based on: git_pack_deltas.cpp.
#include "git_pack_reader.hpp"

#include "git_pack_entry.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>

namespace webots_cloud::adapters {
namespace {

// In bytes: of a file, which otherwise goes to the disk as it comes, and of all deltas of a pack, which wait
// in memory until what they are based on is there.
constexpr std::uint64_t max_size_in_memory = std::uint64_t{1} << 20;
constexpr std::uint64_t max_delta_memory = std::uint64_t{256} << 20;
constexpr std::uint32_t max_objects = 1'000'000; // of one pack
constexpr std::uint64_t delta_overhead = 256;    // to remember it, and to find it by its base
constexpr std::size_t pack_header_size = 12;
constexpr std::size_t digest_size = 20;

std::uint32_t big_endian(std::string_view bytes) noexcept
{
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
        value = value << 8 | static_cast<std::uint8_t>(bytes[i]);
    return value;
}

} // namespace

GitPackReader::GitPackReader(GitStaging& staging, std::uint64_t limit, FetchInterrupt interrupt,
                             std::uint64_t spent)
    : staging_(staging), limit_(limit), interrupt_(std::move(interrupt)), unpacked_(spent),
      inflater_(std::make_unique<z_stream>())
{
    inflateInit(inflater_.get());
}

GitPackReader::~GitPackReader()
{
    inflateEnd(inflater_.get());
    staging_.give_back_memory(paid_memory_);
}

result<> GitPackReader::push(std::string_view bytes)
{
    input_.erase(0, used_);
    used_ = 0;
    input_.append(bytes);
    for (;;) {
        auto const stepped = step();
        if (!stepped)
            return stepped.error();
        if (!*stepped)
            return {};
    }
}

void GitPackReader::consume(std::size_t count)
{
    if (state_ != State::trailer)
        pack_digest_.update(rest().substr(0, count));
    used_ += count;
    offset_ += count;
}

result<> GitPackReader::spend(std::uint64_t bytes)
{
    unpacked_ += bytes;
    if (bytes > limit_ || unpacked_ > limit_)
        return core::refused(core::Refused::project_too_large, {{"max", std::to_string(limit_ >> 20)}});
    return {};
}

/// For memory that is needed until there is no reader any more.
result<> GitPackReader::pay(std::uint64_t memory)
{
    auto const taken = staging_.take_memory(memory);
    if (taken)
        paid_memory_ += memory;
    return taken;
}

/// True when there may be more to do with what has arrived.
result<bool> GitPackReader::step()
{
    switch (state_) {
    case State::pack_header:
        return read_pack_header();
    case State::entry_header:
        return read_entry_header();
    case State::entry_body:
        return read_body();
    case State::trailer:
        return read_trailer();
    case State::end:
        break;
    }
    if (!rest().empty())
        return malformed_pack("bytes after its end");
    return false;
}

result<bool> GitPackReader::read_pack_header()
{
    if (rest().size() < pack_header_size)
        return false;
    auto const version = big_endian(rest().substr(4));
    if (!rest().starts_with("PACK") || (version != 2 && version != 3))
        return malformed_pack("no header");
    total_ = big_endian(rest().substr(8));
    if (total_ > max_objects)
        return core::refused(core::Refused::repository_files);
    consume(pack_header_size);
    state_ = total_ == 0 ? State::trailer : State::entry_header;
    return true;
}

result<bool> GitPackReader::read_entry_header()
{
    auto const parsed = parse_pack_entry(rest());
    if (!parsed)
        return parsed.error();
    if (!*parsed)
        return false;
    auto const& header = **parsed;
    entry_ = Entry();
    entry_.offset = offset_;
    delta_ = Delta();
    delta_.by_offset = header.type == pack_offset_delta;
    delta_.base_id = header.base;
    if (delta_.by_offset) {
        if (header.base_distance == 0 || header.base_distance > offset_)
            return malformed_pack("a delta without base");
        delta_.base_offset = offset_ - header.base_distance;
    }
    if (auto const begun = begin_entry(header.type, header.size); !begun)
        return begun.error();
    consume(header.length);
    state_ = State::entry_body;
    return true;
}

result<> GitPackReader::begin_entry(unsigned type, std::uint64_t size)
{
    is_delta_ = type == pack_offset_delta || type == pack_reference_delta;
    if (!is_delta_ && (type < pack_commit || type > pack_tag))
        return malformed_pack("an object of no known type");
    if (!is_delta_)
        entry_.kind = static_cast<GitObjectKind>(type - pack_commit);
    // Before any of it is unpacked, what an entry says of its size is paid for; `take_output` holds it to
    // that.
    if (auto const spent = spend(size); !spent)
        return spent.error();
    if (is_delta_)
        delta_memory_ += size;
    streamed_ = !is_delta_ && entry_.kind == GitObjectKind::blob && size > max_size_in_memory;
    if (delta_memory_ > max_delta_memory || (!streamed_ && size > max_delta_memory))
        return core::refused(core::Refused::repository_objects);
    if (auto const paid = is_delta_ ? pay(size + delta_overhead) : staging_.pay_for(entry_.kind, size); !paid)
        return paid.error();
    entry_size_ = size;
    entry_read_ = 0;
    body_.clear();
    inflateReset(inflater_.get());
    if (!is_delta_)
        begin_digest(entry_.kind, size);
    return streamed_ ? staging_.begin_blob() : result<>();
}

result<bool> GitPackReader::read_body()
{
    if (auto const may_go_on = ask(interrupt_); !may_go_on)
        return may_go_on.error();
    std::array<char, 128 * 1024> output;
    auto& z = *inflater_;
    // zlib does not write through next_in.
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(rest().data()));
    z.avail_in = static_cast<uInt>(std::min<std::size_t>(rest().size(), 1u << 30));
    auto const offered = z.avail_in;
    z.next_out = reinterpret_cast<Bytef*>(output.data());
    z.avail_out = static_cast<uInt>(output.size());
    auto const status = inflate(&z, Z_NO_FLUSH);
    if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
        return malformed_pack("an object that can't be unpacked");
    auto const made = output.size() - z.avail_out;
    consume(offered - z.avail_in);
    if (auto const taken = take_output(std::string_view(output.data(), made)); !taken)
        return taken.error();
    if (status == Z_STREAM_END) {
        if (auto const ended = end_entry(); !ended)
            return ended.error();
        return true;
    }
    // Without progress, more has to arrive.
    return made > 0 || z.avail_in < offered;
}

result<> GitPackReader::take_output(std::string_view bytes)
{
    if (bytes.size() > entry_size_ - entry_read_)
        return malformed_pack("an object larger than it says");
    entry_read_ += bytes.size();
    if (!is_delta_)
        object_digest_.update(bytes);
    if (streamed_)
        return staging_.append(bytes);
    if (body_.empty())
        body_.reserve(entry_size_);
    body_.append(bytes);
    return {};
}

result<> GitPackReader::end_entry()
{
    if (entry_read_ != entry_size_)
        return malformed_pack("an object smaller than it says");
    result<> stored;
    if (is_delta_) {
        delta_.entry = entries_.size();
        delta_.bytes = std::move(body_);
        deltas_.push_back(std::move(delta_));
    } else {
        entry_.id = object_digest_.finish();
        entry_.resolved = true;
        stored = streamed_ ? staging_.finish_blob(entry_.id, entry_size_)
                           : staging_.put(entry_.kind, entry_.id, std::move(body_));
    }
    body_ = std::string();
    entries_.push_back(entry_);
    state_ = entries_.size() == total_ ? State::trailer : State::entry_header;
    return stored;
}

result<bool> GitPackReader::read_trailer()
{
    if (rest().size() < digest_size)
        return false;
    auto const digest = pack_digest_.finish();
    if (!std::equal(digest.bytes.begin(), digest.bytes.end(), rest().begin(),
                    [](std::uint8_t ours, char theirs) { return ours == static_cast<std::uint8_t>(theirs); }))
        return malformed_pack("its checksum is wrong");
    consume(digest_size);
    state_ = State::end;
    return true;
}

void GitPackReader::begin_digest(GitObjectKind kind, std::uint64_t size)
{
    constexpr std::array<std::string_view, 4> names{"commit ", "tree ", "blob ", "tag "};
    object_digest_.update(names[static_cast<std::size_t>(kind)]);
    auto const digits = std::to_string(size);
    object_digest_.update(std::string_view(digits.c_str(), digits.size() + 1));
}

core::GitObjectId GitPackReader::digest_of(GitObjectKind kind, std::string_view bytes)
{
    begin_digest(kind, bytes.size());
    object_digest_.update(bytes);
    return object_digest_.finish();
}

} // namespace webots_cloud::adapters
