// Reading packs, valid and damaged, in pieces of any size.
#include "unit_test.hpp"

#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/git_packs/git_digest.hpp"
#include "adapters/git_packs/git_pack_reader.hpp"
#include "core/git/git_problem.hpp"

#include <zlib.h>

#include <fcntl.h>
#include <unistd.h>

#include <optional>
#include <random>
#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::adapters;
using namespace std::string_literals;

namespace {

std::string deflated(std::string const& bytes)
{
    std::string out(compressBound(bytes.size()), '\0');
    uLongf size = out.size();
    compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<Bytef const*>(bytes.data()),
              bytes.size(), 9);
    out.resize(size);
    return out;
}

std::string digest(std::string_view bytes)
{
    GitDigest made;
    made.update(bytes);
    auto const id = made.finish();
    return std::string(id.bytes.begin(), id.bytes.end());
}

/// An object of less than 2048 bytes; `base` stands between its header and its content.
std::string object(unsigned type, std::string const& content, std::string const& base = {})
{
    std::string header;
    header += static_cast<char>(0x80 | type << 4 | (content.size() & 15));
    header += static_cast<char>(content.size() >> 4);
    return header + base + deflated(content);
}

std::string pack(std::vector<std::string> const& objects)
{
    auto body = "PACK\0\0\0\2\0\0\0"s + static_cast<char>(objects.size());
    for (auto const& each : objects)
        body += each;
    return body + digest(body);
}

/// A staging area of its own.
struct GitPackReaderFixture
{
    GitPackReaderFixture()
    {
        char name[] = "/tmp/webots_cloud_pack_XXXXXX";
        path = ::mkdtemp(name);
    }
    ~GitPackReaderFixture() { remove_tree(path); }

    result<> read(std::string_view bytes, std::size_t piece = 1 << 20, std::uint64_t budget = 1 << 20,
                  FetchInterrupt interrupt = {}, std::uint64_t spent = 0)
    {
        if (staging)
            remove_tree(path + "/objects");
        folder = make_folder(AT_FDCWD, (path + "/objects").c_str()).value();
        staging.emplace(folder.get());
        GitPackReader reader(*staging, budget, std::move(interrupt), spent);
        for (std::size_t i = 0; i < bytes.size(); i += piece)
            if (auto const pushed = reader.push(bytes.substr(i, piece)); !pushed)
                return pushed.error();
        return reader.finish();
    }

    bool has(std::string const& content) const
    {
        GitDigest made;
        made.update("blob " + std::to_string(content.size()));
        made.update(std::string_view("\0", 1));
        made.update(content);
        auto const id = made.finish();
        return staging->has_blob(id) && staging->read_blob(id).value() == content;
    }

    std::string path;
    FileDescriptor folder;
    std::optional<GitStaging> staging;
};

std::string const base = "0123456789";
std::string const copy_and_add = "\x0a\x09\x91\x02\x04\x03XYZ\x90\x02"s; // 2345XYZ01

} // namespace

BOOST_FIXTURE_TEST_SUITE(git_pack_reader, GitPackReaderFixture)

BOOST_AUTO_TEST_CASE(objects_are_unpacked_however_the_pack_is_cut)
{
    auto const first = object(3, base);
    auto const by_offset = object(6, copy_and_add, std::string(1, static_cast<char>(first.size())));
    auto const bytes = pack({first, by_offset, object(3, "")});
    for (std::size_t piece = 1; piece <= bytes.size(); ++piece) {
        BOOST_REQUIRE(read(bytes, piece).has_value());
        BOOST_TEST(has(base));
        BOOST_TEST(has("2345XYZ01"));
        BOOST_TEST(has(""));
    }
}

BOOST_AUTO_TEST_CASE(a_delta_may_come_before_its_base_and_be_a_base_itself)
{
    auto const id = digest("blob 10\0"s + base);
    auto const middle = digest("blob 9\0"s + "2345XYZ01");
    auto const more = "\x09\x02\x90\x02"s; // the first two bytes
    BOOST_REQUIRE(
        read(pack({object(7, more, middle), object(7, copy_and_add, id), object(3, base)})).has_value());
    BOOST_TEST(has("23"));
    BOOST_TEST(has("2345XYZ01"));
}

BOOST_AUTO_TEST_CASE(folders_and_commits_stay_in_memory)
{
    BOOST_REQUIRE(read(pack({object(1, "tree x"), object(2, "")})).has_value());
    GitDigest made;
    made.update("commit 6\0tree x"s);
    auto const* const commit = staging->find(made.finish());
    BOOST_REQUIRE(commit);
    BOOST_TEST(*commit == "tree x");
}

BOOST_AUTO_TEST_CASE(every_cut_of_a_pack_is_an_error)
{
    auto const bytes = pack({object(3, base), object(7, copy_and_add, digest("blob 10\0"s + base))});
    for (std::size_t size = 0; size < bytes.size(); ++size)
        BOOST_TEST(read(std::string_view(bytes).substr(0, size)).has_error(), size);
    BOOST_TEST(read(bytes + "x").has_error());
}

BOOST_AUTO_TEST_CASE(every_changed_byte_is_an_error)
{
    auto const bytes = pack({object(3, base), object(7, copy_and_add, digest("blob 10\0"s + base))});
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        auto changed = bytes;
        changed[i] = static_cast<char>(changed[i] ^ 0x11);
        BOOST_TEST(read(changed).has_error(), i);
    }
}

BOOST_AUTO_TEST_CASE(noise_with_a_right_checksum_never_does_harm)
{
    std::mt19937 random(1); // the same noise in each run
    auto const good = pack({object(3, base), object(6, copy_and_add, "\x14"),
                            object(7, copy_and_add, digest("blob 10\0"s + base))});
    for (int i = 0; i < 3000; ++i) {
        auto noise = good.substr(0, good.size() - 20);
        for (int changes = 1 + static_cast<int>(random() % 4); changes > 0; --changes)
            noise[12 + random() % (noise.size() - 12)] = static_cast<char>(random());
        auto const outcome = read(noise + digest(noise), 1 + random() % 40);
        auto const refused = outcome.has_error() && (outcome.error() == core::GitProblem::malformed ||
                                                     outcome.error() == errc::too_large);
        BOOST_TEST((outcome.has_value() || refused));
    }
}

BOOST_AUTO_TEST_CASE(nothing_is_unpacked_beyond_the_budget)
{
    auto const bytes = pack({object(3, base), object(7, copy_and_add, digest("blob 10\0"s + base))});
    auto const needed = base.size() + copy_and_add.size() + 9;
    BOOST_TEST(read(bytes, 100, needed).has_value());
    BOOST_TEST((read(bytes, 100, needed - 1).error() == errc::too_large));
}

BOOST_AUTO_TEST_CASE(packs_that_were_read_before_count_and_the_whole_limit_is_named)
{
    auto const bytes = pack({object(3, base)});
    std::uint64_t const limit = 1 << 20;
    BOOST_TEST(read(bytes, 100, limit, {}, limit - base.size()).has_value());
    auto const refused = read(bytes, 100, limit, {}, limit - base.size() + 1);
    BOOST_REQUIRE(refused.has_error());
    BOOST_TEST(refused.error().message() == "The project is larger than 1 MB.");
}

BOOST_AUTO_TEST_CASE(it_stops_at_any_object_and_any_delta_when_it_is_told_to)
{
    auto const bytes = pack({object(3, base), object(7, copy_and_add, digest("blob 10\0"s + base)),
                             object(7, "\x09\x02\x90\x02"s, digest("blob 9\0"s + "2345XYZ01"))});
    int asked = 0;
    int most = 1000;
    auto const interrupt = [&]() -> result<> {
        return asked++ < most ? result<>() : result<>(Failure(errc::timed_out));
    };
    BOOST_TEST(read(bytes, 1 << 20, 1 << 20, interrupt).has_value());
    auto const questions = asked;
    BOOST_TEST(questions >= 5); // three objects arrive, two are made from deltas
    for (most = 0; most < questions; ++most) {
        asked = 0;
        BOOST_CHECK(read(bytes, 1 << 20, 1 << 20, interrupt).error() == errc::timed_out);
        BOOST_TEST(asked == most + 1);
    }
}

BOOST_AUTO_TEST_SUITE_END()
