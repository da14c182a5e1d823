// The second half of GitPackReader: deltas, once everything they are based on is there.
#include "git_pack_entry.hpp"
#include "git_pack_reader.hpp"

#include "core/git/git_delta.hpp"
#include "core/refusals.hpp"

#include <algorithm>
#include <unordered_map>

namespace webots_cloud::adapters {
namespace {

constexpr std::uint64_t max_delta_result = std::uint64_t{512}
                                           << 20; // it is made in memory; git stops there too

} // namespace

/// Applies deltas from their bases outwards, so that only one base and one result are in memory at a time.
struct GitPackReader::Resolver
{
    explicit Resolver(GitPackReader& reader) : pack(reader) {}

    result<> run()
    {
        if (pack.deltas_.empty())
            return {};
        // A delta names its base by its place in the pack, or by its identifier.
        for (std::size_t i = 0; i < pack.deltas_.size(); ++i) {
            auto const& delta = pack.deltas_[i];
            if (delta.by_offset)
                by_offset.emplace(delta.base_offset, i);
            else
                by_id.emplace(delta.base_id, i);
        }
        // It begins with what came whole. Each object that is made may be the base of others.
        for (std::size_t i = 0; i < pack.entries_.size(); ++i)
            if (pack.entries_[i].resolved)
                waiting.push_back(i);
        std::size_t made = 0;
        while (!waiting.empty()) {
            auto const base = waiting.back();
            waiting.pop_back();
            auto const children = children_of(pack.entries_[base]);
            if (children.empty())
                continue;
            if (auto const applied = apply(base, children); !applied)
                return applied.error();
            made += children.size();
        }
        // What was not reached is based on something that did not come, or on itself.
        if (made != pack.deltas_.size())
            return malformed_pack("a delta without base");
        return {};
    }

    std::vector<std::size_t> children_of(Entry const& base)
    {
        std::vector<std::size_t> children;
        auto const [first, last] = by_offset.equal_range(base.offset);
        for (auto each = first; each != last; ++each)
            children.push_back(each->second);
        auto const [first_id, last_id] = by_id.equal_range(base.id);
        for (auto each = first_id; each != last_id; ++each)
            children.push_back(each->second);
        by_id.erase(base.id); // a pack may hold the same object twice
        return children;
    }

    /// The bytes that deltas are applied to. Those of files are read from the disk, into memory that is paid
    /// for.
    struct Base
    {
        explicit Base(GitPackReader& of) : pack(of) {}
        Base(Base const&) = delete;
        ~Base() { pack.staging_.give_back_memory(paid); }

        result<> load(Entry const& entry)
        {
            if (entry.kind != GitObjectKind::blob) {
                bytes = *pack.staging_.find(entry.id);
                return {};
            }
            auto const size = pack.staging_.blob_size(entry.id);
            if (size > max_delta_result)
                return core::refused(core::Refused::repository_objects);
            if (auto const taken = pack.staging_.take_memory(size); !taken)
                return taken;
            paid = size;
            auto text = pack.staging_.read_blob(entry.id);
            if (!text)
                return text.error();
            read = std::move(*text);
            bytes = read;
            return {};
        }

        GitPackReader& pack;
        std::uint64_t paid = 0;
        std::string read;
        std::string_view bytes;
    };

    result<> apply(std::size_t base_entry, std::vector<std::size_t> const& children)
    {
        Base base(pack);
        if (auto const loaded = base.load(pack.entries_[base_entry]); !loaded)
            return loaded;
        for (auto const child : children) {
            if (auto const may_go_on = ask(pack.interrupt_); !may_go_on)
                return may_go_on;
            if (auto const made = make(base.bytes, pack.entries_[base_entry].kind, pack.deltas_[child]);
                !made)
                return made;
            waiting.push_back(pack.deltas_[child].entry);
        }
        return {};
    }

    /// The object that a delta stands for, in the staging area.
    result<> make(std::string_view base, GitObjectKind kind, Delta& delta)
    {
        auto const size = core::delta_result_size(delta.bytes);
        if (!size)
            return size.error();
        // What it will become is paid for before it is made: some bytes can stand for gigabytes.
        if (*size > max_delta_result)
            return core::refused(core::Refused::repository_objects);
        if (auto const spent = pack.spend(*size); !spent)
            return spent;
        if (auto const paid = pack.staging_.pay_for(kind, *size); !paid)
            return paid;
        auto const passing = kind == GitObjectKind::blob ? *size : 0; // until it is on the disk
        if (auto const taken = pack.staging_.take_memory(passing); !taken)
            return taken;
        auto const stored = store(core::apply_delta(base, delta.bytes), kind, delta);
        pack.staging_.give_back_memory(passing);
        return stored;
    }

    result<> store(result<std::string> object, GitObjectKind kind, Delta& delta)
    {
        if (!object)
            return object.error();
        pack.staging_.give_back_memory(delta.bytes.size());
        pack.paid_memory_ -= delta.bytes.size();
        delta.bytes = std::string();
        auto& entry = pack.entries_[delta.entry];
        entry.kind = kind;
        entry.id = pack.digest_of(kind, *object);
        entry.resolved = true;
        return pack.staging_.put(kind, entry.id, std::move(*object));
    }

    GitPackReader& pack;
    std::unordered_multimap<std::uint64_t, std::size_t> by_offset;
    std::unordered_multimap<core::GitObjectId, std::size_t, core::GitObjectIdHash> by_id;
    std::vector<std::size_t> waiting; ///< Entries that are there and whose children are not made yet.
};

result<> GitPackReader::finish()
{
    if (state_ != State::end)
        return malformed_pack("it ends too early");
    return Resolver(*this).run();
}

} // namespace webots_cloud::adapters
