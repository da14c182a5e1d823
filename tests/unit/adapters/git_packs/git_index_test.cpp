// The list of files that lies beside each folder in the cache.
#include "unit_test.hpp"

#include "adapters/git_packs/git_digest.hpp"
#include "adapters/git_packs/git_index.hpp"

using namespace webots_cloud;
using namespace webots_cloud::adapters;

BOOST_AUTO_TEST_SUITE(git_index)

using Kind = core::GitTreeEntry::Kind;

namespace {

GitIndexEntry entry(Kind kind, std::string path, std::uint64_t size)
{
    GitIndexEntry made;
    made.kind = kind;
    made.id = *core::git_object_id(std::string(40, 'a'));
    made.path = std::move(path);
    made.size = size;
    return made;
}

GitIndex example()
{
    GitIndex index;
    index.entries = {entry(Kind::folder, "worlds", 0), entry(Kind::file, "worlds/my demo.wbt", 1234),
                     entry(Kind::executable, "run", 1), entry(Kind::link, "latest", 6)};
    return index;
}

std::string const pointer =
    "version https://git-lfs.github.com/spec/v1\noid sha256:" + std::string(64, 'a') + "\nsize 123456\n";

GitIndex large_example()
{
    GitIndex index;
    index.entries = {entry(Kind::file, "mesh.stl", 123'456),
                     entry(Kind::executable, "tools/my tool", 123'456)};
    for (auto& each : index.entries) {
        GitDigest digest;
        digest.update("blob " + std::to_string(pointer.size()) + std::string(1, '\0') + pointer);
        each.id = digest.finish();
        each.pointer = pointer;
    }
    return index;
}

} // namespace

BOOST_AUTO_TEST_CASE(what_is_written_is_read_again)
{
    auto const read = parse_index(write_index(example()));
    BOOST_REQUIRE(read.has_value());
    BOOST_TEST(read->bytes == 1241u);
    BOOST_REQUIRE(read->entries.size() == 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        auto const expected = example().entries[i];
        BOOST_TEST((read->entries[i].kind == expected.kind));
        BOOST_TEST((read->entries[i].id == expected.id));
        BOOST_TEST(read->entries[i].path == expected.path);
        BOOST_TEST(read->entries[i].size == expected.size);
    }
}

BOOST_AUTO_TEST_CASE(a_large_file_is_kept_with_its_pointer)
{
    auto const text = write_index(large_example());
    auto const read = parse_index(text);
    BOOST_REQUIRE(read.has_value());
    BOOST_TEST(read->bytes == 2 * 123'456u);
    BOOST_TEST(read->entries[0].pointer == pointer);
    BOOST_TEST((read->entries[1].kind == Kind::executable));
    BOOST_TEST(read->entries[1].path == "tools/my tool");
    BOOST_TEST(write_index(*read) == text);
}

BOOST_AUTO_TEST_CASE(a_pointer_has_to_be_what_the_identifier_names)
{
    auto another_id = large_example();
    another_id.entries[0].id.bytes[3] ^= 1;
    BOOST_TEST(parse_index(write_index(another_id)).has_error());
    auto another_size = large_example();
    another_size.entries[0].size = 123'457;
    BOOST_TEST(parse_index(write_index(another_size)).has_error());
    auto another_pointer = large_example();
    another_pointer.entries[0].pointer.back() = 'x';
    BOOST_TEST(parse_index(write_index(another_pointer)).has_error());
    auto text = write_index(large_example());
    auto const hex = text.find("76657273"); // "vers"
    BOOST_TEST_REQUIRE(hex != std::string::npos);
    for (auto const* const other : {"7665727", "zz657273", "", " "}) {
        auto changed = text;
        changed.replace(hex, 8, other);
        BOOST_TEST(parse_index(changed).has_error(), other);
    }
}

// Such folders lack files with odd names; older ones may hold pointers in place of large files.
BOOST_AUTO_TEST_CASE(an_index_of_an_older_server_is_none)
{
    auto text = write_index(example());
    auto const number = text.find('4');
    BOOST_TEST(text.substr(0, number + 1) == "webots_cloud folder 4");
    text[number] = '3';
    BOOST_TEST(parse_index(text).has_error());
}

BOOST_AUTO_TEST_CASE(every_cut_of_it_is_an_error)
{
    auto const text = write_index(example());
    for (std::size_t size = 0; size < text.size(); ++size)
        BOOST_TEST(parse_index(std::string_view(text).substr(0, size)).has_error(), size);
    BOOST_TEST(parse_index(text + "x").has_error());
}

BOOST_AUTO_TEST_CASE(odd_names_are_kept_and_so_is_what_was_left_out)
{
    auto index = example();
    for (auto const* const path :
         {"Icon\r", "textures/h\xf6he.png", "a\nb", "\nend\n", "n\n\nn/n", "- ", "\x1b[2J"})
        index.entries.push_back(entry(Kind::file, path, 1));
    index.forbidden = {".git", "a\\b", "- x"};
    auto const text = write_index(index);
    auto const read = parse_index(text);
    BOOST_TEST_REQUIRE(read.has_value());
    BOOST_TEST(read->forbidden == index.forbidden, boost::test_tools::per_element());
    BOOST_TEST_REQUIRE(read->entries.size() == index.entries.size());
    for (std::size_t i = 0; i < index.entries.size(); ++i)
        BOOST_TEST(read->entries[i].path == index.entries[i].path);
    BOOST_TEST(write_index(*read) == text);
    index.forbidden = {"a\x1b"};
    BOOST_TEST(parse_index(write_index(index)).has_error());
    index.forbidden.assign(17, "x");
    BOOST_TEST(parse_index(write_index(index)).has_error());
}

BOOST_AUTO_TEST_CASE(paths_that_lead_elsewhere_are_errors)
{
    for (auto const* const path : {"../x", "/x", "a//b", "a/../b", "", ".git/config", "a/", "a\\b", "\\\n"}) {
        GitIndex index;
        index.entries = {entry(Kind::file, path, 1)};
        BOOST_TEST(parse_index(write_index(index)).has_error(), path);
    }
}

BOOST_AUTO_TEST_SUITE_END()
