#include "git_delta.hpp"

#include "git_problem.hpp"

#include <optional>

namespace webots_cloud::core {
namespace {

Failure malformed()
{
    return {GitProblem::malformed, "the git server sent a malformed delta"};
}

/// Takes the bytes of a delta one after the other.
class Reader
{
public:
    explicit Reader(std::string_view delta) : rest_(delta) {}

    bool empty() const noexcept { return rest_.empty(); }

    std::optional<std::uint8_t> byte() noexcept
    {
        if (rest_.empty())
            return std::nullopt;
        auto const value = static_cast<std::uint8_t>(rest_.front());
        rest_.remove_prefix(1);
        return value;
    }

    /// Seven bits per byte, the lowest first.
    std::optional<std::uint64_t> size() noexcept
    {
        std::uint64_t value = 0;
        for (unsigned shift = 0; shift < 63; shift += 7) {
            auto const next = byte();
            if (!next)
                return std::nullopt;
            value |= std::uint64_t{*next & 0x7Fu} << shift;
            if (!(*next & 0x80))
                return value;
        }
        return std::nullopt;
    }

    /// The bytes of a number that `present` (a bit each, the lowest first) says are there.
    std::optional<std::uint64_t> sparse(unsigned present) noexcept
    {
        std::uint64_t value = 0;
        for (unsigned shift = 0; present != 0; present >>= 1, shift += 8) {
            if (!(present & 1))
                continue;
            auto const next = byte();
            if (!next)
                return std::nullopt;
            value |= std::uint64_t{*next} << shift;
        }
        return value;
    }

    std::optional<std::string_view> take(std::size_t count) noexcept
    {
        if (rest_.size() < count)
            return std::nullopt;
        auto const bytes = rest_.substr(0, count);
        rest_.remove_prefix(count);
        return bytes;
    }

private:
    std::string_view rest_;
};

/// What one instruction adds, or nothing when it is malformed.
std::optional<std::string_view> instruction(Reader& reader, std::string_view base)
{
    unsigned const code = *reader.byte();
    // Without the highest bit, as many new bytes follow as it says; 0 is reserved.
    if (!(code & 0x80))
        return code == 0 ? std::nullopt : reader.take(code);
    // With it, a piece of the base is repeated. Bytes of its offset and size that are zero were left out.
    auto const offset = reader.sparse(code & 0x0F);
    auto const coded_size = reader.sparse((code >> 4) & 0x07);
    if (!offset || !coded_size)
        return std::nullopt;
    // gitformat-pack(5): the size that would not fit.
    auto const size = *coded_size == 0 ? 0x10000 : *coded_size;
    if (*offset > base.size() || size > base.size() - *offset)
        return std::nullopt;
    return base.substr(*offset, size);
}

} // namespace

result<std::uint64_t> delta_result_size(std::string_view delta)
{
    Reader reader(delta);
    auto const base_size = reader.size();
    auto const size = base_size ? reader.size() : std::nullopt;
    if (!size)
        return malformed();
    return *size;
}

result<std::string> apply_delta(std::string_view base, std::string_view delta)
{
    Reader reader(delta);
    auto const base_size = reader.size();
    auto const size = base_size ? reader.size() : std::nullopt;
    if (!size || *base_size != base.size())
        return malformed();
    std::string made;
    made.reserve(*size);
    while (!reader.empty()) {
        auto const piece = instruction(reader, base);
        // At no step more than was announced, and paid for.
        if (!piece || piece->size() > *size - made.size())
            return malformed();
        made.append(*piece);
    }
    if (made.size() != *size)
        return malformed();
    return made;
}

} // namespace webots_cloud::core
