// Packs, the form in which git sends objects: unpacked while they arrive, with a budget.
#pragma once

#include "adapters/projects/fetch_interrupt.hpp"
#include "git_digest.hpp"
#include "git_staging.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct z_stream_s;

namespace webots_cloud::adapters {

/// Unpacks one pack into a staging area. Nothing in it is trusted: every size is checked against the limit,
/// and reserved from the share of the staging area, before memory is allocated or a byte is written, so that
/// a small pack can't become a large one.
///
/// Lifetime: `staging` must outlive it.   Thread-safety: one thread at a time.
class GitPackReader
{
public:
    /// `limit`: how many bytes all objects may have together, unpacked, with the `spent` ones of packs that
    /// were read before.
    GitPackReader(GitStaging& staging, std::uint64_t limit, FetchInterrupt interrupt = {},
                  std::uint64_t spent = 0);
    ~GitPackReader();

    /// The next bytes of the pack.   Errors: `malformed`, `too_large`, `unavailable` (disk), the
    /// interrupt's.
    result<> push(std::string_view bytes);

    /// The pack has ended: resolves the deltas.   Errors: as `push`.
    result<> finish();

    /// True when something has come that looks like a pack.
    bool begun() const noexcept { return state_ != State::pack_header; }

    std::uint32_t objects_total() const noexcept { return total_; }
    std::uint32_t objects_read() const noexcept { return static_cast<std::uint32_t>(entries_.size()); }

    /// Bytes of all objects so far, unpacked, with those of packs that were read before.
    std::uint64_t unpacked() const noexcept { return unpacked_; }

private:
    enum class State
    {
        pack_header,
        entry_header,
        entry_body,
        trailer,
        end
    };

    /// The record of an object that has arrived.
    struct Entry
    {
        std::uint64_t offset = 0;
        GitObjectKind kind = GitObjectKind::blob;
        core::GitObjectId id;
        bool resolved = false;
    };

    /// An object that arrived as a delta.
    struct Delta
    {
        std::size_t entry = 0;
        bool by_offset = false;
        std::uint64_t base_offset = 0;
        core::GitObjectId base_id;
        std::string bytes;
    };

    struct Resolver;

    result<bool> step();
    result<bool> read_pack_header();
    result<bool> read_entry_header();
    result<> begin_entry(unsigned type, std::uint64_t size);
    result<bool> read_body();
    result<> take_output(std::string_view bytes);
    result<> end_entry();
    result<bool> read_trailer();
    result<> spend(std::uint64_t bytes);
    result<> pay(std::uint64_t memory);
    std::string_view rest() const noexcept { return std::string_view(input_).substr(used_); }
    void consume(std::size_t count);
    core::GitObjectId digest_of(GitObjectKind kind, std::string_view bytes);
    void begin_digest(GitObjectKind kind, std::uint64_t size);

    GitStaging& staging_;
    std::uint64_t limit_;
    FetchInterrupt interrupt_;
    std::uint64_t unpacked_;
    State state_ = State::pack_header;
    std::string input_; ///< Arrived and not used yet; `used_` bytes at its start are.
    std::size_t used_ = 0;
    std::uint64_t offset_ = 0; ///< In the pack, of `rest()`.
    std::uint32_t total_ = 0;
    GitDigest pack_digest_;
    GitDigest object_digest_;
    std::unique_ptr<z_stream_s> inflater_;

    Entry entry_; ///< The object that is arriving.
    bool is_delta_ = false;
    bool streamed_ = false; ///< It goes to a file while it arrives.
    std::uint64_t entry_size_ = 0;
    std::uint64_t entry_read_ = 0;
    std::string body_;
    Delta delta_;
    std::vector<Entry> entries_;
    std::vector<Delta> deltas_;
    std::uint64_t delta_memory_ = 0;
    std::uint64_t paid_memory_ = 0; ///< For what is here and not in the staging area.
};

} // namespace webots_cloud::adapters
