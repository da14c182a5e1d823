// Keeps the minimum of many scores, so that a placement's cost does not depend on the number of machines.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace webots_cloud::placement {

/// A score and what breaks its ties, as one integer that sorts like the pair. Negative scores count as 0.
inline std::uint64_t order_key(double score, std::uint32_t tie) noexcept
{
    // The bits of floats that are not negative sort like the floats; 24 bits tell 95 % from 95.00001 %.
    auto const bits = std::bit_cast<std::uint32_t>(static_cast<float>(std::max(score, 0.0)));
    return (std::uint64_t(bits) << 32) | tie;
}

/// A tournament tree: leaves hold keys, every inner node the smaller key of its two children.
///
/// Rejected: a scan (10,000 machines take 10 µs), and a binary heap with positions (moves entries about, and
/// cannot list the k smallest without being taken apart).
class TournamentTree
{
public:
    static constexpr std::uint64_t absent = std::numeric_limits<std::uint64_t>::max();
    /// A bit that puts a key after all keys without it: the sign bit of the score, which is never set
    /// otherwise.
    static constexpr std::uint64_t last = std::uint64_t(1) << 63;

    /// All keys become `absent`.
    void reset(std::size_t leaves)
    {
        width_ = std::bit_ceil(std::max<std::size_t>(leaves, 1));
        nodes_.assign(2 * width_, absent);
    }

    /// More leaves, whose keys are `absent`; the others keep theirs.
    void grow(std::size_t leaves)
    {
        if (leaves <= width_)
            return;
        auto const before = std::exchange(nodes_, {});
        auto const first = before.begin() + static_cast<std::ptrdiff_t>(width_);
        reset(leaves);
        std::copy(first, before.end(), nodes_.begin() + static_cast<std::ptrdiff_t>(width_));
        for (std::size_t node = width_ - 1; node != 0; --node)
            nodes_[node] = std::min(nodes_[2 * node], nodes_[2 * node + 1]);
    }

    /// `absent`, or what was set.
    std::uint64_t key(std::size_t leaf) const noexcept { return nodes_[width_ + leaf]; }

    /// O(log n), and less where the key does not win its first rounds.
    void set(std::size_t leaf, std::uint64_t key) noexcept
    {
        std::size_t node = width_ + leaf;
        nodes_[node] = key;
        while (node > 1) {
            std::uint64_t const winner = std::min(nodes_[node], nodes_[node ^ 1]);
            node /= 2;
            if (nodes_[node] == winner)
                return;
            nodes_[node] = winner;
        }
    }

    bool empty() const noexcept { return nodes_[1] == absent; }

    /// The leaf of the smallest key.   Precondition: not empty().
    std::size_t first() const noexcept
    {
        std::size_t node = 1;
        while (node < width_)
            node = 2 * node + (nodes_[2 * node] == nodes_[node] ? 0 : 1);
        return node - width_;
    }

    /// Fills `leaves` with those of the smallest keys in order; returns how many there are. At most `max`.
    ///
    /// Looks only into the subtree that holds the leaf `near`, of those that are left when the tree is cut in
    /// at least `parts`.
    static constexpr std::size_t max = 16;
    std::size_t lowest(std::span<std::size_t> leaves, std::size_t parts, std::size_t near) const noexcept
    {
        std::size_t root = width_ + near;
        while (root >= 2 * parts)
            root /= 2;
        Frontier frontier;
        frontier.push(nodes_[root], root);
        std::size_t const wanted = std::min(leaves.size(), max);
        std::size_t found = 0;
        while (found < wanted && !frontier.empty()) {
            std::size_t node = frontier.pop();
            while (node < width_) { // follow the winner down; the losers beside its way may win later
                node *= 2;
                if (nodes_[node + 1] < nodes_[node])
                    ++node;
                frontier.push(nodes_[node ^ 1], node ^ 1);
            }
            leaves[found++] = node - width_;
        }
        return found;
    }

private:
    /// The subtrees not looked into yet, smallest key on top; on the stack, as placing must not allocate.
    class Frontier
    {
    public:
        bool empty() const noexcept { return size_ == 0; }
        void push(std::uint64_t key, std::size_t node) noexcept
        {
            if (key == absent)
                return;
            entries_[size_++] = {key, node};
            std::push_heap(entries_.data(), entries_.data() + size_, later);
        }
        std::size_t pop() noexcept
        {
            std::pop_heap(entries_.data(), entries_.data() + size_, later);
            return entries_[--size_].node;
        }

    private:
        struct Entry
        {
            std::uint64_t key;
            std::size_t node;
        };
        static bool later(Entry const& left, Entry const& right) noexcept { return left.key > right.key; }
        // One entry per level and leaf found; 2^31 leaves are more than slots can be numbered.
        std::array<Entry, max * 31 + 1> entries_;
        std::size_t size_ = 0;
    };

    std::size_t width_ = 1;
    std::vector<std::uint64_t> nodes_ = {absent, absent};
};

} // namespace webots_cloud::placement
