#include "unit_test.hpp"

#include "core/placement/placement_index.hpp"

#include <webots_cloud/scheduler.hpp>

#include <map>

using namespace webots_cloud;
using placement::order_key;
using placement::TournamentTree;

BOOST_AUTO_TEST_SUITE(placement_index)

BOOST_AUTO_TEST_CASE(keys_sort_by_score_and_then_by_turn)
{
    BOOST_TEST(order_key(1.0, 9) < order_key(1.001, 0));
    BOOST_TEST(order_key(1.0, 1) < order_key(1.0, 2));
    BOOST_TEST(order_key(-3.0, 1) == order_key(0.0, 1));
    BOOST_TEST(order_key(1e9, 0xffffffff) < TournamentTree::absent);
}

BOOST_AUTO_TEST_CASE(the_tree_agrees_with_sorting_after_any_changes)
{
    RandomSource random(5);
    for (std::size_t const leaves : {1u, 2u, 3u, 7u, 64u, 100u}) {
        TournamentTree tree;
        tree.reset(leaves);
        BOOST_TEST(tree.empty());
        std::map<std::size_t, std::uint64_t> keys;
        for (int step = 0; step != 500; ++step) {
            std::size_t const leaf = random.below(leaves);
            if (random.uniform() < 0.2) {
                tree.set(leaf, TournamentTree::absent);
                keys.erase(leaf);
            } else {
                keys[leaf] = order_key(random.uniform() * 100, static_cast<std::uint32_t>(step));
                tree.set(leaf, keys[leaf]);
            }
            std::vector<std::pair<std::uint64_t, std::size_t>> sorted;
            for (auto const& [which, key] : keys)
                sorted.emplace_back(key, which);
            std::ranges::sort(sorted);
            BOOST_REQUIRE(tree.empty() == sorted.empty());
            if (!sorted.empty())
                BOOST_REQUIRE(tree.first() == sorted.front().second);
            std::array<std::size_t, 10> lowest{};
            std::size_t const found = tree.lowest(lowest, 1, 0);
            BOOST_REQUIRE(found == std::min<std::size_t>(sorted.size(), lowest.size()));
            for (std::size_t rank = 0; rank != found; ++rank)
                BOOST_REQUIRE(lowest[rank] == sorted[rank].second);
        }
    }
}

BOOST_AUTO_TEST_CASE(a_part_of_the_tree_is_searched_alone)
{
    TournamentTree tree;
    tree.reset(8);
    for (std::size_t leaf = 0; leaf != 8; ++leaf)
        tree.set(leaf, order_key(static_cast<double>(leaf), 0));
    std::array<std::size_t, 8> lowest{};
    BOOST_TEST(tree.lowest(lowest, 2, 5) == 4u);
    BOOST_TEST(lowest[0] == 4u);
    BOOST_TEST(tree.lowest(lowest, 1000, 5) == 1u);
    BOOST_TEST(lowest[0] == 5u);
}

BOOST_AUTO_TEST_SUITE_END()
